//! Requests to a board and their replies, and the frames that it streams between them.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use ballbar::wire::{
    Answer, BoardHello, Command, FrameCounts, FrameReader, HostHello, MAX_FRAME, PROTOCOL, Request, StreamSelection, ToBoard,
    ToHost, WhichSet, decode, encode, hello_version,
};

use super::errors::{BoardError, PortError};
use super::port::Port;

/// A frame as it came, checked, and the message in it.
#[derive(Clone, Debug)]
pub struct Frame {
    /// All bytes, the zero at the end included.
    pub bytes: Vec<u8>,
    /// What they say.
    pub message: ToHost,
}

/// A conversation with a board that has been greeted.
pub struct BoardLink {
    port: Port,
    incoming: Incoming,
    hello: BoardHello,
    hello_frame: Vec<u8>,
    next_id: u16,
    /// Frames of the stream that came while a reply was waited for.
    waiting: VecDeque<Frame>,
}

/// Bytes on their way to becoming frames.
struct Incoming {
    reader: FrameReader,
    /// The bytes of the frame that is coming in.
    bytes: Vec<u8>,
    /// Payloads that are whole, and no message of this version.
    not_understood: u32,
    ready: VecDeque<Frame>,
    other_version: Option<ballbar::wire::ProtocolVersion>,
}

/// How often a request is sent before the board counts as dead, and how long each is waited for.
const ATTEMPTS: usize = 5;
const REPLY_WAIT: Duration = Duration::from_millis(800);
/// A commit may erase two blocks of flash, each for half a second.
const COMMIT_WAIT: Duration = Duration::from_secs(4);

impl BoardLink {
    /// Opens the port and greets the board.
    ///
    /// # Errors
    /// [`BoardError`] when the port cannot be opened, nobody answers, or the board is of another version.
    pub fn connect(port_name: &str, baud: u32) -> Result<Self, BoardError> {
        Self::greet(Port::open(port_name, baud)?)
    }

    /// Greets the board behind an open port.
    ///
    /// # Errors
    /// As [`BoardLink::connect`].
    pub fn greet(mut port: Port) -> Result<Self, BoardError> {
        let mut incoming = Incoming::new();
        for _ in 0..ATTEMPTS {
            // A zero first: what the board heard before is then no part of the hello.
            port.write_all(&[0])?;
            port.write_all(&frame_of(&ToBoard::Hello(HostHello { version: PROTOCOL })))?;
            let deadline = Instant::now() + REPLY_WAIT;
            while Instant::now() < deadline {
                incoming.receive(&mut port)?;
                while let Some(frame) = incoming.ready.pop_front() {
                    if let ToHost::Hello(hello) = frame.message
                        && hello.version == PROTOCOL
                    {
                        let hello_frame = frame.bytes;
                        return Ok(Self { port, incoming, hello, hello_frame, next_id: 0, waiting: VecDeque::new() });
                    }
                }
                if let Some(board) = incoming.other_version {
                    return Err(BoardError::OtherVersion { port: port.name().to_owned(), board, host: PROTOCOL });
                }
            }
        }
        Err(BoardError::Silent { port: port.name().to_owned(), heard: incoming.heard() })
    }

    /// What the board said of itself.
    pub fn hello(&self) -> &BoardHello {
        &self.hello
    }

    /// The frame in which it said so, for a log.
    pub fn hello_frame(&self) -> &[u8] {
        &self.hello_frame
    }

    /// The port.
    pub fn port_name(&self) -> &str {
        self.port.name()
    }

    /// Frames by their fate, and whole payloads that were no message.
    pub fn frame_counts(&self) -> (FrameCounts, u32) {
        (self.incoming.reader.counts(), self.incoming.not_understood)
    }

    /// Sends a command and waits for what comes of it; repeats it, under the same number, when the line has lost one or the other.
    ///
    /// # Errors
    /// [`BoardError`] when the board refuses, does not answer, or is gone.
    pub fn request(&mut self, command: Command) -> Result<Answer, BoardError> {
        self.request_frame(command).map(|(answer, _)| answer)
    }

    /// As [`BoardLink::request`]; returns the reply's frame as well, as it came.
    ///
    /// # Errors
    /// As [`BoardLink::request`].
    pub fn request_frame(&mut self, command: Command) -> Result<(Answer, Vec<u8>), BoardError> {
        let name = command_name(&command);
        let wait = if matches!(command, Command::Commit { .. }) { COMMIT_WAIT } else { REPLY_WAIT };
        let id = self.next_id;
        self.next_id = self.next_id.wrapping_add(1);
        let bytes = frame_of(&ToBoard::Request(Request { id, command }));
        for _ in 0..ATTEMPTS {
            self.port.write_all(&bytes)?;
            let deadline = Instant::now() + wait;
            while Instant::now() < deadline {
                self.incoming.receive(&mut self.port)?;
                while let Some(frame) = self.incoming.ready.pop_front() {
                    match frame.message {
                        ToHost::Reply(reply) if reply.id == id => {
                            let answer = reply.outcome.map_err(|refusal| BoardError::Refused { command: name, refusal })?;
                            return Ok((answer, frame.bytes));
                        }
                        ToHost::Stream(_) => self.waiting.push_back(frame),
                        _ => {}
                    }
                }
            }
        }
        Err(BoardError::NoReply { port: self.port.name().to_owned(), command: name })
    }

    /// Sends a command that has nothing to answer but that it is done.
    ///
    /// # Errors
    /// As [`BoardLink::request`].
    pub fn act(&mut self, command: Command) -> Result<(), BoardError> {
        let name = command_name(&command);
        match self.request(command)? {
            Answer::Done => Ok(()),
            _ => Err(BoardError::WrongAnswer { command: name }),
        }
    }

    /// Begins a stream. One that an earlier program left running is ended first, and what it sent is forgotten: it belongs to nobody.
    ///
    /// # Errors
    /// As [`BoardLink::request`].
    pub fn start_stream(&mut self, selection: StreamSelection) -> Result<(), BoardError> {
        self.act(Command::StopStream)?;
        self.waiting.clear();
        self.act(Command::StartStream(selection))
    }

    /// The next frame that the board sends by itself; `None` when nothing came within a few milliseconds.
    ///
    /// # Errors
    /// [`PortError::Lost`].
    pub fn next_frame(&mut self) -> Result<Option<Frame>, PortError> {
        if self.waiting.is_empty() && self.incoming.ready.is_empty() {
            self.incoming.receive(&mut self.port)?;
        }
        Ok(self.waiting.pop_front().or_else(|| self.incoming.ready.pop_front()))
    }
}

impl Incoming {
    fn new() -> Self {
        Self { reader: FrameReader::new(), bytes: Vec::new(), not_understood: 0, ready: VecDeque::new(), other_version: None }
    }

    /// Takes what the port has.
    fn receive(&mut self, port: &mut Port) -> Result<(), PortError> {
        let mut bytes = [0; 4096];
        let count = port.read(&mut bytes)?;
        for &byte in &bytes[..count] {
            self.bytes.push(byte);
            let pushed = self.reader.push(byte);
            if let Some(Ok(payload)) = &pushed {
                match decode(payload) {
                    Some(message) => self.ready.push_back(Frame { bytes: self.bytes.clone(), message }),
                    None => self.not_understood = self.not_understood.wrapping_add(1),
                }
                self.other_version = hello_version(payload).filter(|version| *version != PROTOCOL).or(self.other_version);
            }
            if byte == 0 || self.bytes.len() > MAX_FRAME {
                self.bytes.clear();
            }
        }
        Ok(())
    }

    fn heard(&self) -> String {
        let counts = self.reader.counts();
        match (counts.good, counts.thrown_away()) {
            (0, 0) => "Nothing at all was heard.".into(),
            (0, damaged) => format!("{damaged} frames were heard, all damaged: is the rate of the port right?"),
            (good, damaged) => format!("{good} whole and {damaged} damaged frames were heard, and no hello among them."),
        }
    }
}

/// A message to the board as a frame.
fn frame_of(message: &ToBoard) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    // Every message fits, which the tests show for the largest of each.
    encode(message, &mut buffer).map(<[u8]>::to_vec).unwrap_or_default()
}

fn command_name(command: &Command) -> &'static str {
    match command {
        Command::Status => "status",
        Command::SelfTest => "self-test",
        Command::StartStream(_) => "start stream",
        Command::StopStream => "stop stream",
        Command::SetRate { .. } => "set rate",
        Command::SetStillness(_) => "set stillness",
        Command::PresetEncoder { .. } => "preset encoder",
        Command::SetLvdt(_) => "set LVDT",
        Command::WriteParameters(_) => "write parameters",
        Command::ReadParameters(WhichSet::Active) => "read parameters",
        Command::ReadParameters(WhichSet::Staged) => "read staged parameters",
        Command::ReadPrevious => "read previous parameters",
        Command::Commit { .. } => "commit",
        Command::Discard => "discard",
        Command::CurrentPose => "current pose",
        Command::ForwardKinematics { .. } => "forward kinematics",
        Command::Reset => "reset",
    }
}
