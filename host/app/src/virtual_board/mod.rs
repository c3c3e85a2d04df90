//! A virtual board: the firmware's library with a simulated robot and ball-bar, behind a pseudo-terminal that a program opens
//! like any serial port.
//!
//! ```text
//! Script ──▶ Plant ──EncoderLatch, LvdtScan──▶ Sampler, Board (the firmware's) ──QueuedLink──▶ Pty ──▶ host
//! ```
//!
//! The robot, the bar and the wiring are simulated; all that the host talks to is the code that runs on a board.

mod bench;
mod controller;
mod counters;
mod driver;
mod flash_file;
mod lvdt;
mod machine;
mod motion;
mod plant;
mod play;
mod pty;
mod runner;
mod script;
#[cfg(test)]
mod tests;

use std::io;
use std::num::NonZeroU64;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Sender, channel};
use std::thread::{JoinHandle, sleep};
use std::time::{Duration, Instant};

use ballbar::wire::ParameterSet;
use ballbar_firmware::Slots;
use miette::Diagnostic;
use thiserror::Error;

use crate::deadline::StopFlag;
use flash_file::FlashFile;
use machine::{BitErrors, Machine};
use pty::Pty;
use runner::{Runner, Shared};

pub use bench::{Bench, BenchError, BenchRun, Scene};
pub use controller::{Controller, ControllerOptions};
pub use counters::COUNTER_WIDTHS;
pub use driver::{Driven, Driver, Order, Stance, driver};
pub use lvdt::lvdt_curve;
pub use plant::{Plant, PlantError, PlantState};
pub use script::{AttachedBar, Script, Station};

/// What a virtual board is made of.
#[derive(Debug)]
pub struct VirtualBoardOptions {
    /// The robot and the bar.
    pub plant: Plant,
    /// How fast time passes.
    pub pace: Pace,
    /// Goes into flash before power-up, unless a set is there already.
    pub parameters: Option<ParameterSet>,
    /// Whether the encoders are preset to where the robot stands at power-up. They never are after a reset.
    pub is_homed: bool,
    /// A file that keeps the flash; memory does where there is none.
    pub flash_file: Option<PathBuf>,
    /// A symbolic link to the port, so that its name is known beforehand.
    pub port_name: Option<PathBuf>,
    /// One bit is flipped every so many bytes to the host.
    pub bit_errors: Option<NonZeroU64>,
    /// Who drives the robot besides the scripts.
    pub driven: Option<Driven>,
}

impl VirtualBoardOptions {
    /// A board as it comes from the shelf, at this plant and pace: nothing in flash, nothing homed, a sound line.
    pub fn new(plant: Plant, pace: Pace) -> Self {
        Self { plant, pace, parameters: None, is_homed: false, flash_file: None, port_name: None, bit_errors: None, driven: None }
    }
}

/// How fast a virtual board's time passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// As the wall clock.
    Real,
    /// While a script plays, as fast as it can be computed and the host takes the bytes: time stands still while the host is
    /// slow, so that nothing is dropped for it. Otherwise as the wall clock.
    Free,
}

/// Why a virtual board could not be started.
#[derive(Debug, Error, Diagnostic)]
pub enum VirtualBoardError {
    /// No pseudo-terminal, or no link to it.
    #[error("no port could be made: {0}")]
    #[diagnostic(help("With --port, only a link is replaced; nothing else may stand there, and its folder must be writable."))]
    Port(io::Error),
    /// The file for the flash cannot be used.
    #[error("{}: cannot be used as flash: {error}", path.display())]
    #[diagnostic(help("Name a file that a virtual board has made, or one that is not there yet."))]
    Flash {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// The flash did not take the parameters.
    #[error("the parameters cannot be stored in the board's flash")]
    Parameters,
    /// The thread could not be started.
    #[error("no thread could be started: {0}")]
    Thread(io::Error),
}

/// A virtual board, running on a thread of its own. Dropping it ends the thread and closes the port.
#[derive(Debug)]
pub struct VirtualBoard {
    port: String,
    plays: Sender<Play>,
    scripts_given: u64,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// Time between two looks at a board that is waited for.
const LOOK: Duration = Duration::from_millis(20);
/// So often must the host have had nothing to read, and so long is one waited for that does not read.
const DRAINED_LOOKS: u32 = 5;
const READER_PATIENCE: Duration = Duration::from_secs(5);

/// A script for the thread.
#[derive(Debug)]
struct Play {
    script: Script,
    /// Whether it waits for the host to stream.
    with_stream: bool,
}

impl VirtualBoard {
    /// Powers a board up. The robot stands still until a script is played.
    ///
    /// # Errors
    /// [`VirtualBoardError`] when the system gives no port or thread, or the file for the flash cannot be used.
    pub fn start(options: VirtualBoardOptions) -> Result<Self, VirtualBoardError> {
        let mut flash = FlashFile::open(options.flash_file.as_deref())
            .map_err(|error| VirtualBoardError::Flash { path: options.flash_file.unwrap_or_default(), error })?;
        if let Some(set) = &options.parameters {
            let (mut slots, stored) = Slots::load(&mut flash);
            if stored.is_none() {
                slots.commit(&mut flash, set).map_err(|_| VirtualBoardError::Parameters)?;
            }
        }
        let pty = Pty::open(options.port_name.as_deref()).map_err(VirtualBoardError::Port)?;
        let port = pty.port();
        let shared = Arc::new(Shared::default());
        let (plays, plays_taken) = channel();
        let mut runner = Runner::new(options.plant, pty, options.pace, plays_taken, Arc::clone(&shared));
        runner.driven = options.driven;
        runner.bit_errors = options.bit_errors.map(|every| BitErrors::new(every.get(), Arc::clone(&shared.flips)));
        let machine = Machine::new(flash);
        let thread = std::thread::Builder::new()
            .name("virtual-board".into())
            .spawn(move || runner.run(machine, options.is_homed))
            .map_err(VirtualBoardError::Thread)?;
        Ok(Self { port, plays, scripts_given: 0, shared, thread: Some(thread) })
    }

    /// Name of the serial port to open: the link's, where one was asked for.
    pub fn port(&self) -> &str {
        &self.port
    }

    /// Plays a script from where the robot stands, instead of what is left of the one before; a move under way is finished
    /// first.
    pub fn play(&mut self, script: Script) {
        self.give(Play { script, with_stream: false });
    }

    /// As [`VirtualBoard::play`], but the robot begins when the host lets the board stream, so that no pose is missed. This
    /// is seen on the board's lamp, a fifth of a second late.
    pub fn play_with_stream(&mut self, script: Script) {
        self.give(Play { script, with_stream: true });
    }

    fn give(&mut self, play: Play) {
        self.scripts_given += 1;
        // Without the thread there is nothing to move.
        let _ = self.plays.send(play);
    }

    /// Whether all scripts are over, the last stay at a station included.
    pub fn is_done(&self) -> bool {
        self.shared.scripts_done.load(Ordering::Acquire) == self.scripts_given
    }

    /// Whether a moment ago no byte was on its way to the host, as far as the system tells.
    pub fn is_drained(&self) -> bool {
        self.shared.is_drained.load(Ordering::Acquire)
    }

    /// Waits until all scripts are over and the host has read everything, or has read nothing for a while; no longer once the flag is set.
    pub fn wait_until_read(&self, stop: &StopFlag) {
        let (mut done_at, mut drained) = (None, 0);
        while !stop.is_set() {
            sleep(LOOK);
            if !self.is_done() {
                continue;
            }
            drained = if self.is_drained() { drained + 1 } else { 0 };
            let done_at = *done_at.get_or_insert_with(Instant::now);
            if drained >= DRAINED_LOOKS || done_at.elapsed() > READER_PATIENCE {
                break;
            }
        }
    }

    /// Time that has passed for the robot since the start.
    pub fn robot_time(&self) -> Duration {
        Duration::from_nanos(self.shared.now_ns.load(Ordering::Relaxed))
    }

    /// Bits flipped so far on the way to the host.
    pub fn bit_flips(&self) -> u64 {
        self.shared.flips.load(Ordering::Relaxed)
    }
}

impl Drop for VirtualBoard {
    fn drop(&mut self) {
        self.shared.is_stopped.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
