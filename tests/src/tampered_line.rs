//! A line between a board and a host on which somebody changes what the board says.

use std::io::{Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use ballbar::wire::{FrameReader, MAX_FRAME, ToHost, decode, encode};
use serialport::{SerialPort, TTYPort};

/// A line that is carried until it is dropped.
pub struct TamperedLine {
    port: String,
    is_stopped: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

const LOOK: Duration = Duration::from_millis(5);

impl TamperedLine {
    /// To the board at a port; every message of the board is replaced by those that `tamper` makes of it.
    ///
    /// # Panics
    /// When the board's port cannot be opened, or there is no pseudo-terminal to be had.
    pub fn start(board_port: &str, mut tamper: impl FnMut(ToHost) -> Vec<ToHost> + Send + 'static) -> Self {
        let mut board = serialport::new(board_port, 921_600).timeout(LOOK).open_native().expect("the board's port");
        let (mut host, slave) = TTYPort::pair().expect("a pseudo-terminal");
        host.set_timeout(LOOK).expect("a terminal takes a time limit");
        let port = slave.name().expect("it has a name");
        // Held open here, it would be locked for others.
        drop(slave);
        let is_stopped = Arc::new(AtomicBool::new(false));
        let stop = Arc::clone(&is_stopped);
        let thread = std::thread::spawn(move || {
            let mut reader = FrameReader::new();
            let mut bytes = [0; 4096];
            while !stop.load(Ordering::Relaxed) {
                if let Ok(count) = host.read(&mut bytes) {
                    write(&mut board, &bytes[..count], &stop);
                }
                let Ok(count) = board.read(&mut bytes) else { continue };
                for &byte in &bytes[..count] {
                    let Some(Ok(payload)) = reader.push(byte) else { continue };
                    let messages = decode(payload).map_or_else(Vec::new, &mut tamper);
                    for message in &messages {
                        write(&mut host, encode(message, &mut [0; MAX_FRAME]).expect("it fits"), &stop);
                    }
                }
            }
        });
        Self { port, is_stopped, thread: Some(thread) }
    }

    /// Name of the port that the host opens.
    pub fn port(&self) -> &str {
        &self.port
    }
}

impl Drop for TamperedLine {
    fn drop(&mut self) {
        self.is_stopped.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            assert!(ended.is_ok() || std::thread::panicking(), "the line has failed");
        }
    }
}

/// Writes all, however slow the other end is; what nobody is there to take is dropped.
fn write(port: &mut TTYPort, mut bytes: &[u8], stop: &AtomicBool) {
    while !bytes.is_empty() && !stop.load(Ordering::Relaxed) {
        match port.write(bytes) {
            Ok(count) => bytes = &bytes[count..],
            Err(error) if error.kind() == std::io::ErrorKind::TimedOut => {}
            Err(_) => return,
        }
    }
}
