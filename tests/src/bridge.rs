//! The line between an emulated board and a host: one end is the socket of a UART, the other a pseudo-terminal that the host opens
//! like any serial port.
//!
//! What the board sends goes on frame by frame, so that chosen frames can be damaged, and every frame is kept as it was.

use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use ballbar::wire::{FrameReader, ToHost, decode};
use rustix::fd::OwnedFd;
use rustix::fs::{Mode, OFlags};
use rustix::io::ioctl_fionread;
use rustix::termios::ioctl_tiocnxcl;
use serialport::{SerialPort, TTYPort};

/// A line that carries bytes until it is dropped.
pub struct Bridge {
    port: String,
    uart: UnixStream,
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

/// A view of the line for who feeds the board.
pub struct LineWatcher {
    shared: Arc<Shared>,
    uart: UnixStream,
}

/// A message that the board has streamed.
#[derive(Clone, Debug)]
pub struct Streamed {
    /// The message.
    pub message: ballbar::wire::Stream,
    /// Whether it was damaged on its way to the host.
    pub is_damaged: bool,
}

#[derive(Default)]
struct Shared {
    is_stopped: AtomicBool,
    /// Stream messages so far.
    streamed: AtomicU64,
    /// Bytes that wait for the host to read them.
    backlog: Mutex<usize>,
    taken: Condvar,
    recording: Mutex<Recording>,
}

#[derive(Default)]
struct Recording {
    is_on: bool,
    messages: Vec<Streamed>,
    /// Numbers of the messages to damage, from the beginning of the recording.
    to_damage: Vec<usize>,
}

/// How often the threads look whether they are to end.
const LOOK: Duration = Duration::from_millis(100);
/// While more bytes than this wait for the host, the board's time stands still.
const BACKLOG_BYTES: usize = 16_384;
/// The same, while more bytes wait in the UART's socket. It holds few, since QEMU writes them one by one and each takes the room of
/// a packet; when it is full, so is the UART.
const SOCKET_BYTES: u64 = 128;
/// Between two looks at that socket, so that not every byte costs this machine a change of threads.
const GATHERING: Duration = Duration::from_micros(300);
/// A host that reads nothing for so long has gone.
const READER_LIMIT: Duration = Duration::from_secs(10);

impl Bridge {
    /// Makes the pseudo-terminal.
    pub fn start(uart: UnixStream) -> Self {
        uart.set_read_timeout(Some(LOOK)).expect("a socket takes a time limit");
        let (mut board_end, host_end) = TTYPort::pair().expect("the system has pseudo-terminals");
        board_end.set_timeout(LOOK).expect("a terminal takes a time limit");
        let port = host_end.name().expect("a pseudo-terminal has a name");
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        // Once more by itself: what serialport has open, it keeps from others.
        let host_end = rustix::fs::open(&port, flags, Mode::empty()).expect("a pseudo-terminal can be opened");
        let shared = Arc::new(Shared::default());
        let (frames, frames_taken) = channel();
        let from_board = FromBoard {
            uart: uart.try_clone().expect("a socket can be shared"),
            frames,
            shared: Arc::clone(&shared),
            reader: FrameReader::new(),
            frame: Vec::new(),
        };
        let terminal = board_end.try_clone_native().expect("a terminal can be shared");
        let to_host = ToHostEnd { frames: frames_taken, terminal, shared: Arc::clone(&shared) };
        let to_board_uart = uart.try_clone().expect("a socket can be shared");
        let to_board =
            ToBoard { uart: to_board_uart, terminal: board_end, host_end, shared: Arc::clone(&shared), freed: Instant::now() };
        let threads = vec![
            std::thread::spawn(move || from_board.carry()),
            std::thread::spawn(move || to_host.carry()),
            std::thread::spawn(move || to_board.carry()),
        ];
        Self { port, uart, shared, threads }
    }

    /// Name of the port that the host opens.
    pub fn port(&self) -> &str {
        &self.port
    }

    /// A view of the line.
    pub fn watcher(&self) -> LineWatcher {
        LineWatcher { shared: Arc::clone(&self.shared), uart: self.uart.try_clone().expect("a socket can be shared") }
    }

    /// Keeps the messages that are streamed from now on, and flips one bit in each of those whose numbers, from 0, are given.
    pub fn record(&self, to_damage: &[usize]) {
        *self.recording() = Recording { is_on: true, messages: Vec::new(), to_damage: to_damage.to_vec() };
    }

    /// Ends the recording; returns what was streamed.
    pub fn recorded(&self) -> Vec<Streamed> {
        std::mem::take(&mut *self.recording()).messages
    }

    fn recording(&self) -> MutexGuard<'_, Recording> {
        self.shared.recording.lock().expect("the line's threads run")
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        self.shared.is_stopped.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let ended = thread.join();
            assert!(ended.is_ok() || std::thread::panicking(), "a thread of the line has failed");
        }
    }
}

impl LineWatcher {
    /// Messages that the board has streamed so far.
    pub fn streamed(&self) -> u64 {
        self.shared.streamed.load(Ordering::Relaxed)
    }

    /// Waits while the host is slow; not for ever, because it may have gone.
    pub fn wait_for_reader(&self, is_stopped: &AtomicBool) {
        let is_too_long = |backlog: &mut usize| {
            let waits = *backlog > BACKLOG_BYTES || ioctl_fionread(&self.uart).is_ok_and(|unread| unread > SOCKET_BYTES);
            waits && !is_stopped.load(Ordering::Relaxed)
        };
        let waited = self.shared.taken.wait_timeout_while(self.shared.backlog(), READER_LIMIT, is_too_long);
        drop(waited.expect("the line's threads run"));
    }
}

impl Shared {
    fn is_stopped(&self) -> bool {
        self.is_stopped.load(Ordering::Relaxed)
    }

    fn backlog(&self) -> MutexGuard<'_, usize> {
        self.backlog.lock().expect("no test failed here")
    }
}

/// Takes the board's bytes frame by frame.
struct FromBoard {
    uart: UnixStream,
    frames: Sender<Vec<u8>>,
    shared: Arc<Shared>,
    reader: FrameReader,
    /// The frame that is coming in.
    frame: Vec<u8>,
}

impl FromBoard {
    fn carry(mut self) {
        let mut bytes = [0; 4_096];
        while !self.shared.is_stopped() {
            match self.uart.read(&mut bytes) {
                Ok(0) => return,
                Ok(count) => {
                    // Behind the lock: who waits has either seen the bytes gone, or is told.
                    drop(self.shared.backlog());
                    self.shared.taken.notify_all();
                    bytes[..count].iter().for_each(|&byte| self.take(byte));
                    std::thread::sleep(GATHERING);
                }
                Err(error) if is_time_over(&error) => {}
                Err(error) => panic!("the board's UART: {error}"),
            }
        }
    }

    fn take(&mut self, byte: u8) {
        self.frame.push(byte);
        let message = self.reader.push(byte).and_then(Result::ok).and_then(decode::<ToHost>);
        if byte != 0 {
            return;
        }
        let mut frame = std::mem::take(&mut self.frame);
        if let Some(ToHost::Stream(message)) = message {
            self.shared.streamed.fetch_add(1, Ordering::Relaxed);
            let mut recording = self.shared.recording.lock().expect("no test failed here");
            if recording.is_on {
                let is_damaged = recording.to_damage.contains(&recording.messages.len());
                recording.messages.push(Streamed { message, is_damaged });
                if is_damaged {
                    damage(&mut frame);
                }
            }
        }
        *self.shared.backlog() += frame.len();
        // Without the other thread there is no host either.
        let _ = self.frames.send(frame);
    }
}

/// Gives the host frame after frame.
struct ToHostEnd {
    frames: Receiver<Vec<u8>>,
    terminal: TTYPort,
    shared: Arc<Shared>,
}

impl ToHostEnd {
    fn carry(mut self) {
        while !self.shared.is_stopped() {
            match self.frames.recv_timeout(LOOK) {
                Ok(frame) => self.send(&frame),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    fn send(&mut self, frame: &[u8]) {
        let mut bytes = frame;
        while !bytes.is_empty() && !self.shared.is_stopped() {
            match self.terminal.write(bytes) {
                Ok(count) => bytes = &bytes[count..],
                Err(error) if is_time_over(&error) => {}
                Err(error) => panic!("the pseudo-terminal: {error}"),
            }
        }
        *self.shared.backlog() -= frame.len();
        self.shared.taken.notify_all();
    }
}

/// Flips one bit in the middle of a frame, so that it stays one frame: no byte becomes the zero that ends it.
fn damage(frame: &mut [u8]) {
    let byte = &mut frame[frame.len() / 2];
    *byte ^= if *byte == 1 { 2 } else { 1 };
}

/// From the host to the board.
struct ToBoard {
    uart: UnixStream,
    terminal: TTYPort,
    /// Held open: without any opener of this end, the other would fail while no host is there.
    host_end: OwnedFd,
    shared: Arc<Shared>,
    freed: Instant,
}

impl ToBoard {
    fn carry(mut self) {
        let mut bytes = [0; 4_096];
        while !self.shared.is_stopped() {
            match self.terminal.read(&mut bytes) {
                Ok(count) => {
                    // A board that was switched off needs no bytes.
                    let _ = self.uart.write_all(&bytes[..count]);
                }
                Err(error) if is_time_over(&error) => {}
                Err(error) => panic!("the pseudo-terminal: {error}"),
            }
            self.free_port();
        }
    }

    /// A host opens its port for itself alone. A real port is free again when its opener has gone; this one is still held open
    /// here, and would stay closed to all others.
    fn free_port(&mut self) {
        if self.freed.elapsed() >= LOOK {
            self.freed = Instant::now();
            ioctl_tiocnxcl(&self.host_end).expect("a terminal can be shared");
        }
    }
}

fn is_time_over(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}
