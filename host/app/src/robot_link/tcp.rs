//! A TCP connection that is read in short waits. Answers have a deadline for all of their bytes, and lines a bound.

use std::io::Read;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use super::LinkError;
use crate::deadline::{Deadline, StopFlag, WaitOver, is_short_wait, write_before};

/// How long one read or write waits before it says that nothing came or went.
const READ_WAIT: Duration = Duration::from_millis(2);
const WRITE_STEP: Duration = Duration::from_millis(50);
/// How long a write may take before the connection counts as lost.
const WRITE_WAIT: Duration = Duration::from_secs(1);
/// From one look at a connection being made to the next.
const LOOK: Duration = Duration::from_millis(20);
/// So long is read away what nobody needs, however fast it comes.
const DISCARD_WAIT: Duration = Duration::from_millis(10);

/// An open connection.
pub(super) struct Tcp {
    address: String,
    stream: TcpStream,
    stop: StopFlag,
}

impl Tcp {
    /// Connects within `wait` to the first address of the host that answers.
    ///
    /// # Errors
    /// [`LinkError::Unreachable`], [`LinkError::Stopped`].
    pub(super) fn connect(host: &str, port: u16, wait: Duration, stop: &StopFlag) -> Result<Self, LinkError> {
        Self::connect_to(&format!("{host}:{port}"), wait, stop)
    }

    /// As [`Tcp::connect`], to an address with its port.
    ///
    /// # Errors
    /// As [`Tcp::connect`].
    pub(super) fn connect_to(address: &str, wait: Duration, stop: &StopFlag) -> Result<Self, LinkError> {
        let unreachable = |reason: String| LinkError::Unreachable { address: address.to_owned(), reason };
        let (sender, connected) = channel();
        let name = address.to_owned();
        // On a thread, because neither looking a name up nor connecting can be given up. One that comes too late ends by itself.
        let connecting = thread::Builder::new().name("connect".into()).spawn(move || sender.send(first_stream(&name, wait)));
        connecting.map_err(|error| unreachable(error.to_string()))?;
        let deadline = Deadline::after(wait, stop);
        let stream = loop {
            match connected.recv_timeout(LOOK) {
                Ok(stream) => break stream.map_err(unreachable)?,
                Err(RecvTimeoutError::Timeout) => match deadline.check() {
                    Ok(()) => {}
                    Err(WaitOver::Late) => return Err(unreachable(format!("no connection within {} s", wait.as_secs_f64()))),
                    Err(WaitOver::Stopped) => return Err(LinkError::Stopped),
                },
                Err(RecvTimeoutError::Disconnected) => return Err(unreachable("no connection could be made".into())),
            }
        };
        let prepared = stream
            .set_nodelay(true)
            .and_then(|()| stream.set_read_timeout(Some(READ_WAIT)))
            .and_then(|()| stream.set_write_timeout(Some(WRITE_STEP)));
        prepared.map_err(|error| unreachable(error.to_string()))?;
        Ok(Self { address: address.to_owned(), stream, stop: stop.clone() })
    }

    /// From here on no answer is waited for any longer once the flag is set.
    pub(super) fn heed(&mut self, stop: &StopFlag) {
        self.stop = stop.clone();
    }

    /// Where it leads.
    pub(super) fn address(&self) -> &str {
        &self.address
    }

    /// The deadline of an answer that is asked for now.
    pub(super) fn deadline(&self, wait: Duration) -> Deadline {
        Deadline::after(wait, &self.stop)
    }

    /// Reads what is there, waiting a moment; zero bytes when nothing is.
    ///
    /// # Errors
    /// [`LinkError::Lost`], also when the other end has closed.
    pub(super) fn read(&mut self, bytes: &mut [u8]) -> Result<usize, LinkError> {
        match self.stream.read(bytes) {
            Ok(0) => Err(self.lost("it was closed at the other end")),
            Ok(count) => Ok(count),
            Err(error) if is_short_wait(&error) => Ok(0),
            Err(error) => Err(self.lost(&error.to_string())),
        }
    }

    /// Writes all bytes, also when the user wants to end: the last ones stop the robot.
    ///
    /// # Errors
    /// [`LinkError::Lost`], also when the other end does not take them within a second.
    pub(super) fn write_all(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let deadline = Deadline::regardless(WRITE_WAIT);
        write_before(&deadline, &mut self.stream, bytes).map_err(|error| self.lost(&error.to_string()))
    }

    /// Reads away what nobody needs, so that the other end is not held up. At most `limit` bytes, and no longer than a moment.
    ///
    /// # Errors
    /// [`LinkError::Lost`].
    pub(super) fn discard(&mut self, limit: usize) -> Result<(), LinkError> {
        let deadline = Deadline::regardless(DISCARD_WAIT);
        let mut bytes = [0; 4096];
        let mut discarded = 0;
        while discarded < limit && deadline.check().is_ok() {
            match self.read(&mut bytes)? {
                0 => break,
                count => discarded += count,
            }
        }
        Ok(())
    }

    fn lost(&self, reason: &str) -> LinkError {
        LinkError::Lost { address: self.address.clone(), reason: reason.to_owned() }
    }

    /// The other end does not speak as it should.
    pub(super) fn unexpected(&self, found: String, expected: &'static str) -> LinkError {
        LinkError::Unexpected { address: self.address.clone(), found, expected }
    }
}

/// A connection over which lines of text come.
pub(super) struct TcpLines {
    pub(super) tcp: Tcp,
    heard: Vec<u8>,
    longest: usize,
}

impl TcpLines {
    /// Lines of so many bytes at most.
    pub(super) fn new(tcp: Tcp, longest: usize) -> Self {
        Self { tcp, heard: Vec::new(), longest }
    }

    /// The next line, without its end.
    ///
    /// # Errors
    /// [`LinkError`], also when it does not come whole before the deadline, or is too long.
    pub(super) fn line(&mut self, deadline: &Deadline, expected: &'static str) -> Result<String, LinkError> {
        loop {
            let end = self.heard.iter().position(|byte| *byte == b'\n');
            if let Some(end) = end.filter(|&end| end <= self.longest) {
                let line: Vec<u8> = self.heard.drain(..=end).collect();
                return Ok(String::from_utf8_lossy(&line).trim().to_owned());
            }
            let is_too_long = end.is_some() || self.heard.len() > self.longest;
            match deadline.check() {
                Err(WaitOver::Stopped) => return Err(LinkError::Stopped),
                Ok(()) if !is_too_long => {}
                _ => return Err(self.tcp.unexpected(beginning(&self.heard), expected)),
            }
            let mut bytes = [0; 512];
            let count = self.tcp.read(&mut bytes)?;
            self.heard.extend_from_slice(&bytes[..count]);
        }
    }
}

/// The beginning of what was heard, for an error.
fn beginning(heard: &[u8]) -> String {
    if heard.is_empty() {
        return "nothing".into();
    }
    String::from_utf8_lossy(heard).chars().take(60).collect()
}

fn first_stream(address: &str, wait: Duration) -> Result<TcpStream, String> {
    let mut reason = "the name has no address".to_owned();
    for socket in address.to_socket_addrs().map_err(|error| error.to_string())? {
        match TcpStream::connect_timeout(&socket, wait) {
            Ok(stream) => return Ok(stream),
            Err(error) => reason = error.to_string(),
        }
    }
    Err(reason)
}
