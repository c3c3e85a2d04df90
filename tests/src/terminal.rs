//! `host-cal` at a terminal of its own, whose screen can be read.

use std::io::{Read, Write};
use std::num::NonZero;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use portable_pty::{Child, CommandBuilder, MasterPty, PtySize, native_pty_system};

use crate::command::host_cal_command;

/// Longer than anything takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// A run of `host-cal` at a terminal.
pub struct AtTerminal {
    master: Option<Box<dyn MasterPty + Send>>,
    keyboard: Option<Box<dyn Write + Send>>,
    child: Box<dyn Child + Send + Sync>,
    screen: Arc<Mutex<vt100::Parser>>,
    /// Reads what is shown, until the terminal is closed at the other end or by `is_hung_up`.
    reader: Option<JoinHandle<()>>,
    is_hung_up: Arc<AtomicBool>,
    /// How the terminal was before.
    modes: String,
}

impl AtTerminal {
    /// Starts `host-cal` in a folder, in a window of so many columns and rows.
    ///
    /// # Panics
    /// When there is no pseudo-terminal to be had.
    pub fn start(folder: &Path, args: &[&str], size: (u16, u16)) -> Self {
        Self::start_as("xterm-256color", folder, args, size)
    }

    /// [`AtTerminal::start`] with a terminal of another kind.
    ///
    /// # Panics
    /// When there is no pseudo-terminal to be had.
    pub fn start_as(kind: &str, folder: &Path, args: &[&str], size: (u16, u16)) -> Self {
        let pair = native_pty_system().openpty(pty_size(size)).expect("a pseudo-terminal");
        let modes = modes(pair.master.as_ref());
        let plain = host_cal_command(folder, args);
        let mut command = CommandBuilder::new(plain.get_program());
        command.args(plain.get_args());
        command.cwd(folder);
        command.env("TERM", kind);
        let child = pair.slave.spawn_command(command).expect("host-cal starts");
        drop(pair.slave);
        let keyboard = pair.master.take_writer().expect("a keyboard");
        let mut output = pair.master.try_clone_reader().expect("a screen");
        let screen = Arc::new(Mutex::new(vt100::Parser::new(rows(size), columns(size), 500)));
        let is_hung_up = Arc::new(AtomicBool::new(false));
        let (shown, is_over) = (Arc::clone(&screen), Arc::clone(&is_hung_up));
        let reader = std::thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let (Ok(count @ 1..), false) = (output.read(&mut bytes), is_over.load(Ordering::Relaxed)) {
                shown.lock().expect("no panic at the screen").process(&bytes[..count]);
            }
        });
        Self { master: Some(pair.master), keyboard: Some(keyboard), child, screen, reader: Some(reader), is_hung_up, modes }
    }

    /// What the window shows.
    ///
    /// # Panics
    /// When the screen's thread has.
    pub fn text(&self) -> String {
        self.screen.lock().expect("no panic at the screen").screen().contents()
    }

    /// Waits until the window shows something.
    ///
    /// # Panics
    /// When it does not come.
    pub fn wait_for(&mut self, what: &str) {
        let began = Instant::now();
        while !self.text().contains(what) {
            let is_over = self.child.try_wait().expect("a child").is_some() && began.elapsed() > Duration::from_secs(1);
            assert!(!is_over && began.elapsed() < PATIENCE, "waited in vain for `{what}`; the window shows\n{}", self.text());
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits until a whole frame is drawn that shows something: until it is there, and nothing changes any more but numbers.
    ///
    /// # Panics
    /// When it does not come.
    pub fn wait_for_frame(&mut self, what: &str) {
        self.wait_for(what);
        std::thread::sleep(Duration::from_millis(400));
        self.wait_for(what);
    }

    /// Presses keys.
    ///
    /// # Panics
    /// When the terminal is gone.
    pub fn press(&mut self, keys: &str) {
        let keyboard = self.keyboard.as_mut().expect("not hung up");
        keyboard.write_all(keys.as_bytes()).and_then(|()| keyboard.flush()).expect("a keyboard");
    }

    /// Makes the window larger or smaller.
    ///
    /// # Panics
    /// When the terminal is gone.
    pub fn resize(&mut self, size: (u16, u16)) {
        self.screen.lock().expect("no panic at the screen").screen_mut().set_size(rows(size), columns(size));
        self.master.as_ref().expect("not hung up").resize(pty_size(size)).expect("a window");
    }

    /// Sends a signal, as `kill` names it.
    ///
    /// # Panics
    /// When it cannot be sent.
    pub fn signal(&self, name: &str) {
        let process = self.child.process_id().expect("it runs").to_string();
        let status = std::process::Command::new("kill").args([name, &process]).status();
        assert!(status.expect("there is a kill").success());
    }

    /// Whether the steady screen is shown.
    ///
    /// # Panics
    /// When the screen's thread has.
    pub fn is_steady(&self) -> bool {
        self.screen.lock().expect("no panic at the screen").screen().alternate_screen()
    }

    /// Waits for the end, and makes sure that the terminal is as it was. The exit code, and what the window shows.
    ///
    /// # Panics
    /// When it does not end, or leaves the terminal otherwise than it was.
    pub fn finish(mut self) -> (u32, String) {
        let code = self.wait_for_end();
        // The terminal is closed at the other end now: the reader ends when all is shown.
        self.reader.take().map(JoinHandle::join).expect("not hung up").expect("no panic at the screen");
        let screen = self.screen.lock().expect("no panic at the screen");
        assert!(!screen.screen().alternate_screen(), "the steady screen was left on");
        assert!(!screen.screen().hide_cursor(), "the cursor was left off");
        let now = modes(self.master.as_ref().expect("not hung up").as_ref());
        assert_eq!(now, self.modes, "the terminal's modes were changed");
        (code, screen.screen().contents())
    }

    /// Closes the window, as a lost connection does, and waits for the end. The exit code.
    ///
    /// # Panics
    /// When it does not end.
    pub fn hang_up(mut self) -> u32 {
        self.is_hung_up.store(true, Ordering::Relaxed);
        // The reader notices with the next frame: there is one every second at least.
        self.reader.take().map(JoinHandle::join).expect("not hung up before").expect("no panic at the screen");
        (self.keyboard, self.master) = (None, None);
        self.wait_for_end()
    }

    fn wait_for_end(&mut self) -> u32 {
        let began = Instant::now();
        loop {
            match self.child.try_wait().expect("a child") {
                Some(status) => return status.exit_code(),
                None if began.elapsed() > PATIENCE => panic!("it does not end; the window shows\n{}", self.text()),
                None => std::thread::sleep(Duration::from_millis(20)),
            }
        }
    }
}

impl Drop for AtTerminal {
    /// A test that failed leaves nothing behind.
    fn drop(&mut self) {
        let _ = self.child.kill();
    }
}

fn columns((columns, _): (u16, u16)) -> NonZero<u16> {
    NonZero::new(columns).expect("a window has columns")
}

fn rows((_, rows): (u16, u16)) -> NonZero<u16> {
    NonZero::new(rows).expect("a window has rows")
}

fn pty_size((cols, rows): (u16, u16)) -> PtySize {
    PtySize { rows, cols, pixel_width: 0, pixel_height: 0 }
}

/// Input, output and local modes of a terminal.
fn modes(master: &dyn MasterPty) -> String {
    let termios = master.get_termios().expect("a terminal's modes");
    format!("{:?} {:?} {:?}", termios.input_flags, termios.output_flags, termios.local_flags)
}
