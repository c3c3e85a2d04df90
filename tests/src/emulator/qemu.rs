//! QEMU as a child process, and the JSON messages (QMP) by which it is started, reset and watched.

use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use serde_json::{Value, json};

use super::{path_text, wait_for};

const PROGRAM: &str = "qemu-system-arm";
/// QEMU makes its sockets in some milliseconds; a busy machine may take longer.
const START_LIMIT: Duration = Duration::from_secs(20);

/// A running QEMU, killed when dropped. Until [`Qemu::go`] the processor stands still.
pub struct Qemu {
    child: Mutex<Child>,
    folder: PathBuf,
    commands: Mutex<UnixStream>,
    events: Arc<Mutex<Vec<Value>>>,
}

impl Qemu {
    /// Loads an image; `folder` takes the sockets, `more` are further arguments.
    pub fn start(elf: &Path, folder: &Path, more: &[&str]) -> Self {
        let socket = |name: &str| format!("socket,id={name},server=on,wait=off,path={}", path_text(&folder.join(name)));
        let log = File::create(folder.join("qemu.log")).expect("a file for what QEMU says");
        let spawned = Command::new(PROGRAM)
            .args(["-M", "mps2-an386", "-display", "none", "-nodefaults", "-monitor", "none", "-S"])
            .args(["-chardev", &socket("link"), "-serial", "chardev:link"])
            .args(["-chardev", &socket("plant"), "-serial", "chardev:plant"])
            .args(["-chardev", &socket("qmp"), "-mon", "chardev=qmp,mode=control"])
            // One instruction is one nanosecond, and sleep takes no time.
            .args(["-icount", "shift=0,sleep=off"])
            .args(["-kernel", path_text(elf)])
            .args(more)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(log)
            .spawn();
        let child = spawned.unwrap_or_else(|error| {
            panic!("{PROGRAM} does not start: {error}. On Debian it is in the package qemu-system-arm; `./check` installs it")
        });
        let child = Mutex::new(child);
        let commands = connect(&child, folder, "qmp");
        let events = Arc::new(Mutex::new(Vec::new()));
        let incoming = BufReader::new(commands.try_clone().expect("a socket has two ends"));
        let collected = Arc::clone(&events);
        // Ends with the socket, when QEMU does.
        std::thread::spawn(move || collect_events(incoming, &collected));
        let qemu = Self { child, folder: folder.to_owned(), commands: Mutex::new(commands), events };
        qemu.command("qmp_capabilities");
        qemu
    }

    /// Connects to one of the emulated UARTs.
    pub fn connect(&self, name: &str) -> UnixStream {
        connect(&self.child, &self.folder, name)
    }

    /// Lets the processor run.
    pub fn go(&self) {
        self.command("cont");
    }

    /// Sends a command, without waiting for what comes of it.
    pub fn command(&self, name: &str) {
        let line = format!("{}\n", json!({ "execute": name }));
        let sent = self.commands.lock().expect("no thread failed here").write_all(line.as_bytes());
        sent.unwrap_or_else(|error| panic!("QEMU takes no command: {error}; it said:\n{}", said(&self.folder)));
    }

    /// Resets that the firmware caused.
    pub fn own_resets(&self) -> usize {
        let events = self.events.lock().expect("no thread failed here");
        let is_own = |event: &&Value| event["event"] == "RESET" && event["data"]["guest"] == true;
        events.iter().filter(is_own).count()
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        if let Ok(child) = self.child.get_mut() {
            // It may have ended by itself.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn connect(child: &Mutex<Child>, folder: &Path, name: &str) -> UnixStream {
    wait_for(START_LIMIT, &format!("QEMU's socket {name}"), || {
        let exit = child.lock().expect("no thread failed here").try_wait();
        if let Ok(Some(exit)) = exit {
            panic!("QEMU ended with {exit}; it said:\n{}", said(folder));
        }
        match UnixStream::connect(folder.join(name)) {
            Ok(stream) => Some(stream),
            Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::ConnectionRefused) => None,
            Err(error) => panic!("QEMU's socket {name}: {error}"),
        }
    })
}

fn said(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("qemu.log")).unwrap_or_default()
}

fn collect_events(incoming: BufReader<UnixStream>, events: &Mutex<Vec<Value>>) {
    for line in incoming.lines() {
        let Ok(line) = line else { return };
        let message: Value = serde_json::from_str(&line).unwrap_or_else(|error| panic!("QEMU says {line:?}: {error}"));
        assert!(message.get("error").is_none(), "QEMU refuses a command: {line}");
        if message.get("event").is_some() {
            events.lock().expect("no thread failed here").push(message);
        }
    }
}
