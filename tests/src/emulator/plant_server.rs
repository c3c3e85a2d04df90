//! The plant's end of the line to the board: answers every tick with the state of a simulated robot at that time.

use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::Duration;

use ballbar_firmware::{ENCODERS, LvdtScan};
use host_cal::virtual_board::{Driven, Plant, Script};

use super::record::RecordWriter;
use crate::bridge::LineWatcher;

/// What the plant gave at one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tick {
    /// Time since the board's start, microseconds.
    pub t_us: u64,
    /// True positions of the encoders: counts from encoder output zero.
    pub counts: [i32; ENCODERS],
    /// The LVDT.
    pub scan: LvdtScan,
}

/// Answers until it is dropped.
pub(super) struct PlantServer {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    desk: Mutex<Desk>,
    is_stopped: AtomicBool,
}

/// What the thread and the test both touch.
struct Desk {
    plant: Plant,
    /// A script that waits for the board to stream, and how many messages it had streamed when it was laid down.
    waiting: Option<(Script, u64)>,
    answers_nonsense: bool,
    /// How often the board has started.
    starts: usize,
    /// Since the board's latest start.
    ticks: Vec<Tick>,
}

/// What the board says after a reset.
const STARTED: u64 = (1 << 14) - 1;
/// What it is answered.
const PREAMBLE: [u8; 9] = [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0];
/// Flags that no record has.
const NONSENSE: [u8; 2] = [0x80, 0x80];
/// How often the thread looks whether it is to end.
const LOOK: Duration = Duration::from_millis(100);

impl PlantServer {
    pub(super) fn start(socket: UnixStream, plant: Plant, driven: Option<Driven>, line: LineWatcher) -> Self {
        socket.set_read_timeout(Some(LOOK)).expect("a socket takes a time limit");
        let desk = Desk { plant, waiting: None, answers_nonsense: false, starts: 0, ticks: Vec::new() };
        let shared = Arc::new(Shared { desk: Mutex::new(desk), is_stopped: AtomicBool::new(false) });
        let (shared_too, writer) = (Arc::clone(&shared), RecordWriter::default());
        let server = Server { socket, shared: shared_too, line, driven, writer, now_us: 0, started_us: 0 };
        Self { shared, thread: Some(std::thread::spawn(move || server.serve())) }
    }

    pub(super) fn play_with_stream(&self, script: Script) {
        self.desk().waiting = Some((script, u64::MAX));
    }

    pub(super) fn ticks(&self) -> Vec<Tick> {
        self.desk().ticks.clone()
    }

    pub(super) fn starts(&self) -> usize {
        self.desk().starts
    }

    pub(super) fn answer_nonsense(&self) {
        self.desk().answers_nonsense = true;
    }

    fn desk(&self) -> MutexGuard<'_, Desk> {
        self.shared.desk.lock().expect("the plant's thread runs")
    }
}

impl Drop for PlantServer {
    fn drop(&mut self) {
        self.shared.is_stopped.store(true, Ordering::Relaxed);
        let ended = self.thread.take().map_or(Ok(()), JoinHandle::join);
        assert!(ended.is_ok() || std::thread::panicking(), "the plant's thread has failed");
    }
}

/// The thread's own.
struct Server {
    socket: UnixStream,
    shared: Arc<Shared>,
    line: LineWatcher,
    /// Who drives the robot besides the scripts.
    driven: Option<Driven>,
    writer: RecordWriter,
    /// The plant's time.
    now_us: u64,
    /// The plant's time at the board's latest start.
    started_us: u64,
}

impl Server {
    /// A message is `1hhhhhhh 0lllllll`.
    fn serve(mut self) {
        let mut high = None;
        let mut bytes = [0; 64];
        while !self.shared.is_stopped.load(Ordering::Relaxed) {
            let count = match self.socket.read(&mut bytes) {
                Ok(0) => return,
                Ok(count) => count,
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => continue,
                Err(error) => panic!("the line to the board: {error}"),
            };
            for &byte in &bytes[..count] {
                let bits = u64::from(byte & 0x7f);
                if byte & 0x80 != 0 {
                    high = Some(bits);
                } else {
                    let high = high.take().expect("the board sends the high half first");
                    let answer = self.answer(high << 7 | bits);
                    // A board that was switched off needs no answer.
                    let _ = self.socket.write_all(&answer);
                }
            }
        }
    }

    fn answer(&mut self, us: u64) -> Vec<u8> {
        let shared = Arc::clone(&self.shared);
        if us == STARTED {
            self.writer = RecordWriter::default();
            self.started_us = self.now_us;
            let mut desk = shared.desk.lock().expect("no test failed here");
            desk.ticks.clear();
            desk.starts += 1;
            return PREAMBLE.to_vec();
        }
        // The board's time stands still with the plant's.
        self.line.wait_for_reader(&shared.is_stopped);
        let mut desk = shared.desk.lock().expect("no test failed here");
        if std::mem::take(&mut desk.answers_nonsense) {
            return NONSENSE.to_vec();
        }
        self.now_us += us;
        desk.begin_script(self.line.streamed());
        if let Some(driven) = &self.driven {
            driven.attend(&mut desk.plant);
        }
        let state = desk.plant.at(self.now_us);
        let tick = Tick { t_us: self.now_us - self.started_us, counts: desk.plant.counts(), scan: state.scan };
        desk.ticks.push(tick);
        self.writer.record(&state)
    }
}

impl Desk {
    /// Begins the script that waits, when the board has streamed since it was laid down.
    fn begin_script(&mut self, streamed: u64) {
        let Some((_, before)) = &mut self.waiting else { return };
        if *before > streamed {
            *before = streamed;
        }
        if *before < streamed
            && let Some((script, _)) = self.waiting.take()
        {
            self.plant.play(script);
        }
    }
}
