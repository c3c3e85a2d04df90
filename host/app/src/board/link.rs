//! Requests to a board and their replies, and the frames that it streams between them.

use std::collections::VecDeque;
use std::time::Duration;

use ballbar::wire::{
    Answer, BoardHello, Command, FrameCounts, FrameReader, HostHello, MAX_FRAME, PROTOCOL, ProtocolVersion, Reply, Request,
    Status, Stream, StreamSelection, ToBoard, ToHost, WhichSet, decode, encode, hello_version,
};

use super::errors::{BoardError, PortError};
use super::filter::MessageFilter;
use super::plausible::Implausible;
use super::port::Port;
use super::tally::StreamLosses;
use crate::deadline::{Deadline, StopFlag, WaitOver};

/// A frame of the stream as it came, whole, and the message in it, or why that is not to be believed.
#[derive(Clone, Debug)]
pub struct Frame {
    /// All bytes, the zero at the end included.
    pub bytes: Vec<u8>,
    /// What they say.
    pub message: Result<Stream, Implausible>,
}

/// A conversation with a board that has been greeted.
pub struct BoardLink {
    port: Port,
    incoming: Incoming,
    hello: BoardHello,
    hello_frame: Vec<u8>,
    next_id: u16,
    /// No wait outlasts it.
    stop: StopFlag,
}

/// Bytes on their way to becoming frames.
#[derive(Default)]
struct Incoming {
    reader: FrameReader,
    /// The bytes of the frame that is coming in.
    bytes: Vec<u8>,
    /// Payloads that are whole, and no message of this version.
    not_understood: u32,
    filter: MessageFilter,
    hello: Option<(BoardHello, Vec<u8>)>,
    /// Why the latest hello is not to be believed.
    false_hello: Option<Implausible>,
    replies: VecDeque<(Reply, Vec<u8>, Result<(), Implausible>)>,
    /// Whether what is streamed was asked for here; an older stream belongs to nobody.
    is_streaming: bool,
    /// Frames of the stream that nobody has taken yet.
    frames: VecDeque<Frame>,
    other_version: Option<ProtocolVersion>,
}

/// How often a request is sent before the board counts as dead, and how long each is waited for.
const ATTEMPTS: u32 = 5;
const REPLY_WAIT: Duration = Duration::from_millis(800);
/// A commit may erase two blocks of flash, each for half a second.
const COMMIT_WAIT: Duration = Duration::from_secs(4);
/// How long the end of a stream may take when the user is waiting for it.
const LAST_WORDS: Duration = Duration::from_millis(700);
/// More frames than a board streams while it does not answer: some hundred a second come.
const MOST_FRAMES: usize = 16_384;

impl BoardLink {
    /// Opens the port and greets the board.
    ///
    /// # Errors
    /// [`BoardError`] when the port cannot be opened, nobody answers, or the board is of another version.
    pub fn connect(port_name: &str, baud: u32) -> Result<Self, BoardError> {
        Self::connect_until(port_name, baud, &StopFlag::default())
    }

    /// As [`BoardLink::connect`]; neither this nor any request afterwards is waited for any longer once the flag is set.
    ///
    /// # Errors
    /// As [`BoardLink::connect`], and [`BoardError::Stopped`].
    pub fn connect_until(port_name: &str, baud: u32, stop: &StopFlag) -> Result<Self, BoardError> {
        let mut port = Port::open(port_name, baud)?;
        let mut incoming = Incoming::default();
        for _ in 0..ATTEMPTS {
            let deadline = Deadline::after(REPLY_WAIT, stop);
            // A zero first: what the board heard before is then no part of the hello.
            port.write_until(&[0], &deadline)?;
            port.write_until(&frame_of(&ToBoard::Hello(HostHello { version: PROTOCOL })), &deadline)?;
            while is_waiting(&deadline)? {
                incoming.receive(&mut port)?;
                if let Some((hello, hello_frame)) = incoming.hello.clone() {
                    return Ok(Self { port, incoming, hello, hello_frame, next_id: 0, stop: stop.clone() });
                }
                if let Some(board) = incoming.other_version {
                    return Err(BoardError::OtherVersion { port: port.name().to_owned(), board, host: PROTOCOL });
                }
            }
        }
        Err(BoardError::Silent { port: port.name().to_owned(), heard: incoming.heard() })
    }

    /// From here on no request is waited for any longer once the flag is set.
    pub fn heed(&mut self, stop: &StopFlag) {
        self.stop = stop.clone();
    }

    /// Whether the user wants to end.
    ///
    /// # Errors
    /// [`BoardError::Stopped`].
    pub fn check_stop(&self) -> Result<(), BoardError> {
        if self.stop.is_set() { Err(BoardError::Stopped) } else { Ok(()) }
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

    /// What was lost of the streams begun here, and what was not believed.
    pub fn losses(&self) -> StreamLosses {
        self.incoming.filter.losses()
    }

    /// Sends a command and waits for what comes of it; repeats it, under the same number, when the line has lost one or the other.
    ///
    /// # Errors
    /// [`BoardError`] when the board refuses, does not answer, answers what cannot be, or is gone.
    pub fn request(&mut self, command: Command) -> Result<Answer, BoardError> {
        self.request_frame(command).map(|(answer, _)| answer)
    }

    /// As [`BoardLink::request`]; returns the reply's frame as well, as it came.
    ///
    /// # Errors
    /// As [`BoardLink::request`].
    pub fn request_frame(&mut self, command: Command) -> Result<(Answer, Vec<u8>), BoardError> {
        let wait = if matches!(command, Command::Commit { .. }) { COMMIT_WAIT } else { REPLY_WAIT };
        self.exchange(command, wait, &Deadline::after(wait * ATTEMPTS, &self.stop))
    }

    /// One request, repeated whenever `wait` is over, until the deadline for all of it.
    fn exchange(&mut self, command: Command, wait: Duration, deadline: &Deadline) -> Result<(Answer, Vec<u8>), BoardError> {
        let name = command_name(&command);
        let id = self.next_id;
        self.next_id = self.next_id.wrapping_add(1);
        let bytes = frame_of(&ToBoard::Request(Request { id, command }));
        while is_waiting(deadline)? {
            let attempt = deadline.at_most(wait);
            self.port.write_until(&bytes, &attempt)?;
            while is_waiting(&attempt)? {
                self.incoming.receive(&mut self.port)?;
                while let Some((reply, frame, checked)) = self.incoming.replies.pop_front() {
                    if reply.id != id {
                        continue;
                    }
                    checked.map_err(|reason| BoardError::Implausible { command: name, reason })?;
                    let answer = reply.outcome.map_err(|refusal| BoardError::Refused { command: name, refusal })?;
                    return Ok((answer, frame));
                }
                if self.incoming.frames.len() > MOST_FRAMES {
                    return Err(BoardError::Flood { port: self.port.name().to_owned() });
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
        done(name, self.request(command)?)
    }

    /// Begins a stream. One that an earlier program left running is ended first, and what it sent is forgotten: it belongs to nobody.
    ///
    /// # Errors
    /// As [`BoardLink::request`].
    pub fn start_stream(&mut self, selection: StreamSelection) -> Result<(), BoardError> {
        self.act(Command::StopStream)?;
        self.incoming.frames.clear();
        self.incoming.filter.begin_stream();
        self.incoming.is_streaming = true;
        self.act(Command::StartStream(selection))
    }

    /// Ends the stream, and counts what is missing at its end; what the board had gathered can still be taken. Takes no longer than a
    /// request, and less than a second when the user waits for it.
    ///
    /// # Errors
    /// As [`BoardLink::request`].
    pub fn end_stream(&mut self) -> Result<Status, BoardError> {
        let wait = if self.stop.is_set() { LAST_WORDS } else { REPLY_WAIT * ATTEMPTS };
        let deadline = Deadline::regardless(wait);
        done("stop stream", self.exchange(Command::StopStream, REPLY_WAIT, &deadline)?.0)?;
        let (Answer::Status(status), _) = self.exchange(Command::Status, REPLY_WAIT, &deadline)? else {
            return Err(BoardError::WrongAnswer { command: "status" });
        };
        self.incoming.is_streaming = false;
        self.incoming.filter.end_stream(&status);
        Ok(status)
    }

    /// The next frame of the stream; `None` when nothing came within a few milliseconds.
    ///
    /// # Errors
    /// [`PortError::Lost`].
    pub fn next_frame(&mut self) -> Result<Option<Frame>, PortError> {
        if self.incoming.frames.is_empty() {
            self.incoming.receive(&mut self.port)?;
            // Replies that come late belong to nobody.
            self.incoming.replies.clear();
        }
        Ok(self.incoming.frames.pop_front())
    }

    /// What has come of the stream and was not taken yet.
    pub fn take_frames(&mut self) -> VecDeque<Frame> {
        std::mem::take(&mut self.incoming.frames)
    }
}

impl Incoming {
    /// Takes what the port has.
    fn receive(&mut self, port: &mut Port) -> Result<(), PortError> {
        let mut bytes = [0; 4096];
        let count = port.read(&mut bytes)?;
        for &byte in &bytes[..count] {
            self.bytes.push(byte);
            if let Some(Ok(payload)) = self.reader.push(byte) {
                self.other_version = hello_version(payload).filter(|version| *version != PROTOCOL).or(self.other_version);
                match decode(payload) {
                    Some(message) => self.sort(message),
                    None => self.not_understood = self.not_understood.wrapping_add(1),
                }
            }
            if byte == 0 || self.bytes.len() > MAX_FRAME {
                self.bytes.clear();
            }
        }
        Ok(())
    }

    /// Puts a message where it is waited for.
    fn sort(&mut self, message: ToHost) {
        let bytes = self.bytes.clone();
        match message {
            // Once greeted, a board that says hello again answers one that was repeated.
            ToHost::Hello(hello) if hello.version == PROTOCOL && self.hello.is_none() => match self.filter.take_hello(&hello) {
                Ok(()) => self.hello = Some((hello, bytes)),
                Err(reason) => self.false_hello = Some(reason),
            },
            ToHost::Reply(reply) => {
                let checked = self.filter.take_reply(&reply);
                self.replies.push_back((reply, bytes, checked));
            }
            ToHost::Stream(stream) if self.is_streaming => {
                let checked = self.filter.take_stream(&stream);
                self.frames.push_back(Frame { bytes, message: checked.map(|()| stream) });
            }
            ToHost::Hello(_) | ToHost::Stream(_) | ToHost::Mark(_) => {}
        }
    }

    fn heard(&self) -> String {
        let counts = self.reader.counts();
        match (self.false_hello, counts.good, counts.thrown_away()) {
            (Some(reason), ..) => format!("Its hello is not to be believed: {reason}."),
            (None, 0, 0) => "Nothing at all was heard.".into(),
            (None, 0, damaged) => format!("{damaged} frames were heard, all damaged: is the rate of the port right?"),
            (None, good, damaged) => {
                format!("{good} whole and {damaged} damaged frames were heard, and no hello among them.")
            }
        }
    }
}

/// Whether there is time left; an error when the user wants to end.
fn is_waiting(deadline: &Deadline) -> Result<bool, BoardError> {
    match deadline.check() {
        Ok(()) => Ok(true),
        Err(WaitOver::Late) => Ok(false),
        Err(WaitOver::Stopped) => Err(BoardError::Stopped),
    }
}

fn done(command: &'static str, answer: Answer) -> Result<(), BoardError> {
    match answer {
        Answer::Done => Ok(()),
        _ => Err(BoardError::WrongAnswer { command }),
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
