//! The shipped image, byte for byte, on a strict emulator of its chip: `tests/f405_emulator/`, in Python, as a child process.
//!
//! ```text
//! host ═ PTY ═ Bridge ═══ socket ══ USART2 of the emulator ◀── stdin, stdout ── commands, reports
//! ```
//!
//! Its robot stands still and its LVDT has no bar: what a board computes is the other emulator's matter ([`crate::emulator`]), what
//! an image does to its chip is this one's.

use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde::Deserialize;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::bridge::Bridge;
use crate::emulator::{self, Image, wait_for};
use crate::scenarios::Bench;
use crate::workspace::{target_folder, workspace};

/// Set by `check` when it could not install the emulator's libraries, and said so.
const WITHOUT_EMULATOR: &str = "BALLBAR_WITHOUT_F405_EMULATOR";
/// For what takes the emulator a moment, on a busy machine.
const LIMIT: Duration = Duration::from_secs(120);

/// How the image comes to run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// The power comes.
    PowerOn,
    /// The boot loader in ROM jumps to it.
    AfterDfu,
    /// Every reset leaves other memory than the flash at address 0.
    AlwaysRemapped,
}

/// A board with the shipped image. Two that run at once on a machine of two cores take longer than one after the other: each holds
/// the turn to have one.
pub struct F405Board {
    bridge: Bridge,
    child: Child,
    commands: Mutex<(ChildStdin, BufReader<ChildStdout>)>,
    _folder: TempDir,
    _turn: MutexGuard<'static, ()>,
}

/// What happened on a board so far.
#[derive(Clone, Debug, Deserialize)]
pub struct Report {
    /// Time since power-on, seconds.
    pub now_s: f64,
    /// All that the program must not have done, each beginning with its name.
    pub violations: Vec<String>,
    /// Whether the processor can go no further.
    pub is_dead: bool,
    /// The resets behind the power-on.
    pub resets: Vec<ResetReport>,
    /// Periods of the sampling timer that ended, and those of them that found the one before unserved.
    pub sampling_periods: u64,
    /// See [`Self::sampling_periods`].
    pub missed_periods: u64,
    /// Interrupts of the index lines.
    pub index_interrupts: u64,
    /// Sectors of the flash in the order in which they were erased.
    pub erases: Vec<u8>,
    /// The flash controller's control register.
    pub flash_control: u32,
}

/// A reset.
#[derive(Clone, Debug, Deserialize)]
pub struct ResetReport {
    /// When, seconds since power-on.
    pub at_s: f64,
    /// What made it: software, watchdog.
    pub cause: String,
}

/// Whether tests on this emulator are to be skipped; says so.
pub fn is_skipped() -> bool {
    let is_skipped = std::env::var_os(WITHOUT_EMULATOR).is_some_and(|value| value == "1");
    if is_skipped {
        eprintln!("SKIPPED, as {WITHOUT_EMULATOR}=1 asks for: this needs Python's libraries unicorn and pyelftools");
    }
    is_skipped || emulator::is_skipped()
}

/// A module of the emulator's package, to be run.
pub fn module(name: &str) -> Command {
    let mut command = Command::new(target_folder().join("f405_emulator/bin/python"));
    command.args(["-B", "-m", name]).current_dir(workspace().join("tests"));
    command
}

impl F405Board {
    /// Starts a board with nothing in its parameter slots; none when boards are to be skipped.
    ///
    /// # Panics
    /// When the emulator does not start.
    pub fn start(start: Start) -> Option<Self> {
        static TURN: Mutex<()> = Mutex::new(());
        if is_skipped() {
            return None;
        }
        // A test that failed was the last user of its board all the same.
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = tempfile::tempdir().expect("a folder for a socket");
        let socket = folder.path().join("link");
        let start = match start {
            Start::PowerOn => "power-on",
            Start::AfterDfu => "after-dfu",
            Start::AlwaysRemapped => "always-remapped",
        };
        let spawned = module("f405_emulator")
            .args([Image::F405.elf(), &socket])
            .args(["--start", start])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn();
        let mut child = spawned.unwrap_or_else(|error| panic!("the emulator does not start: {error}; ./check installs it"));
        let commands = child.stdin.take().expect("a pipe was asked for");
        let answers = BufReader::new(child.stdout.take().expect("a pipe was asked for"));
        let link = wait_for(LIMIT, "the emulator's socket", || {
            let exit = child.try_wait().expect("a child can be asked for");
            assert!(exit.is_none(), "the emulator has ended: {exit:?}");
            UnixStream::connect(&socket).ok()
        });
        let bridge = Bridge::start(link);
        Some(Self { bridge, child, commands: Mutex::new((commands, answers)), _folder: folder, _turn: turn })
    }

    /// Pulses without end on the index line of a joint (from zero), until [`Self::quiet`].
    pub fn ring(&self, joint: usize, pulses_per_s: u32, high_ns: u32) {
        self.command(&json!({ "ring": { "joint": joint, "pulses_per_s": pulses_per_s, "high_ns": high_ns } }));
    }

    /// Ends the pulses on a joint's index line.
    pub fn quiet(&self, joint: usize) {
        self.command(&json!({ "quiet": joint }));
    }

    /// What happened so far.
    pub fn report(&self) -> Report {
        serde_json::from_value(self.command(&json!({ "report": null }))).expect("a report has its fields")
    }

    /// Waits for a time on the board; what happened until then.
    pub fn report_at(&self, now_s: f64) -> Report {
        wait_for(LIMIT, &format!("second {now_s} of the board"), || {
            Some(self.report()).filter(|report| report.now_s >= now_s || report.is_dead)
        })
    }

    fn command(&self, command: &Value) -> Value {
        let mut pipes = self.commands.lock().expect("no thread failed here");
        let (commands, answers) = &mut *pipes;
        writeln!(commands, "{command}").unwrap_or_else(|error| panic!("the emulator takes no command: {error}"));
        let mut line = String::new();
        answers.read_line(&mut line).unwrap_or_else(|error| panic!("the emulator gives no answer: {error}"));
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("the emulator answers {line:?}: {error}"))
    }
}

impl Report {
    /// The program has done nothing that it must not, and runs.
    ///
    /// # Panics
    /// When it has.
    pub fn is_clean(&self) {
        assert!(self.violations.is_empty() && !self.is_dead, "violations:\n{}\n{self:#?}", self.violations.join("\n"));
    }
}

impl Bench for F405Board {
    fn board(&self) -> &'static str {
        "f405"
    }

    fn port(&self) -> String {
        self.bridge.port().to_owned()
    }
}

impl Drop for F405Board {
    fn drop(&mut self) {
        // A host that got no answer is only what came of it.
        let is_running = self.child.try_wait().is_ok_and(|exit| exit.is_none());
        if std::thread::panicking() && is_running && !self.commands.is_poisoned() {
            eprintln!("violations:\n{}", self.report().violations.join("\n"));
        }
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
