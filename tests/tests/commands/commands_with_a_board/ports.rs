//! Ports that are absent, taken or silent, and ends of another version.

use std::io::{Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use ballbar::wire::{
    Command, FrameReader, HostHello, MAX_FRAME, PROTOCOL, ProtocolVersion, Refusal, Request, ToBoard, ToHost, decode, encode,
};
use host_cal::board::{BAUD, BoardLink, Port};
use serialport::SerialPort;
use tempfile::TempDir;

use super::{bare_board, refused};

#[test]
fn ports_that_are_absent_busy_or_silent_are_said_so() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    for command in ["stream", "status", "pose"] {
        refused(folder, &[command, "/dev/no-such-port"], &["/dev/no-such-port: there is no such port"]);
    }
    let _board = bare_board(folder);
    let taken = BoardLink::connect(&folder.join("port").to_string_lossy(), BAUD).unwrap();
    refused(folder, &["status", "port"], &["port: the port cannot be opened", "another program"]);
    drop(taken);
    std::fs::write(folder.join("file"), "no port").unwrap();
    refused(folder, &["status", "file"], &["file: the port cannot be opened"]);
    let peer = Peer::start(|_| Vec::new());
    refused(folder, &["status", &peer.name], &["no board answers", "Nothing at all was heard"]);
}

#[test]
fn a_board_of_another_protocol_version_is_refused_with_both_versions() {
    let folder = TempDir::new().unwrap();
    let other = ProtocolVersion { number: PROTOCOL.number + 1, schema: [0xab; 8] };
    // A hello whose later fields this program knows nothing of.
    let peer = Peer::start(move |message| match message {
        ToBoard::Hello(_) => frame(&(0_u8, other, "fields of another version", 7_u64)),
        ToBoard::Request(_) => Vec::new(),
    });
    let theirs = format!("protocol {} (messages abababababababab)", other.number);
    let ours = format!("this program {}", PROTOCOL.number);
    for command in ["stream", "status", "pose"] {
        refused(folder.path(), &[command, &peer.name], &[&theirs, &ours, "Flash the firmware"]);
    }
}

#[test]
fn a_board_that_is_greeted_by_a_host_of_another_version_takes_no_requests() {
    let folder = TempDir::new().unwrap();
    let board = bare_board(folder.path());
    let mut link = BoardLink::connect(board.port(), BAUD).unwrap();
    link.act(Command::SetRate { rate_hz: 500 }).unwrap();
    drop(link);
    let mut port = Port::open(board.port(), BAUD).unwrap();
    let hello = HostHello { version: ProtocolVersion { number: 99, ..PROTOCOL } };
    port.write_all(&frame(&ToBoard::Hello(hello))).unwrap();
    let request = Request { id: 5, command: Command::SetRate { rate_hz: 200 } };
    port.write_all(&frame(&ToBoard::Request(request))).unwrap();
    let (mut reader, mut replies) = (FrameReader::new(), Vec::new());
    let began = Instant::now();
    while replies.len() < 2 && began.elapsed() < Duration::from_secs(20) {
        let mut bytes = [0; 256];
        let count = port.read(&mut bytes).unwrap();
        for &byte in &bytes[..count] {
            if let Some(Ok(payload)) = reader.push(byte) {
                replies.extend(decode::<ToHost>(payload));
            }
        }
    }
    assert!(matches!(&replies[0], ToHost::Hello(hello) if hello.version == PROTOCOL), "{replies:?}");
    let refusal = Err(Refusal::HelloFirst);
    assert!(matches!(&replies[1], ToHost::Reply(reply) if reply.id == 5 && reply.outcome == refusal), "{replies:?}");
}

fn frame<T: serde::Serialize>(message: &T) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    encode(message, &mut buffer).expect("fits").to_vec()
}

/// Something behind a serial port that is no board of ours.
struct Peer {
    name: String,
    is_stopped: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Peer {
    /// Answers every message with the bytes that `answer` makes of it.
    fn start(answer: impl Fn(&ToBoard) -> Vec<u8> + Send + 'static) -> Self {
        let (mut master, slave) = serialport::TTYPort::pair().expect("a pseudo-terminal");
        let name = slave.name().expect("it has a name");
        // Held open here, it would be locked for others.
        drop(slave);
        let is_stopped = Arc::new(AtomicBool::new(false));
        let stop = Arc::clone(&is_stopped);
        let thread = std::thread::spawn(move || {
            master.set_timeout(Duration::from_millis(10)).expect("a timeout");
            let mut reader = FrameReader::new();
            while !stop.load(Ordering::Relaxed) {
                let mut bytes = [0; 256];
                // Nothing, or nobody has opened the port.
                let count = master.read(&mut bytes).unwrap_or_else(|_| {
                    std::thread::sleep(Duration::from_millis(5));
                    0
                });
                for &byte in &bytes[..count] {
                    if let Some(Ok(payload)) = reader.push(byte)
                        && let Some(message) = decode(payload)
                    {
                        master.write_all(&answer(&message)).expect("written");
                    }
                }
            }
        });
        Self { name, is_stopped, thread: Some(thread) }
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        self.is_stopped.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
