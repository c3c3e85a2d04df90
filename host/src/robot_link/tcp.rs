//! A TCP connection that is read in short waits.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use super::LinkError;

/// How long a read waits before it says that there is nothing.
const READ_WAIT: Duration = Duration::from_millis(2);
/// How long a write may take before the connection counts as lost.
const WRITE_WAIT: Duration = Duration::from_secs(2);

/// An open connection.
pub(super) struct Tcp {
    address: String,
    stream: TcpStream,
}

impl Tcp {
    /// Connects within `wait` to the first address of the host that answers.
    ///
    /// # Errors
    /// [`LinkError::Unreachable`].
    pub(super) fn connect(host: &str, port: u16, wait: Duration) -> Result<Self, LinkError> {
        let address = format!("{host}:{port}");
        let unreachable = |reason: String| LinkError::Unreachable { address: address.clone(), reason };
        let mut reason = "the name has no address".to_owned();
        for socket in (host, port).to_socket_addrs().map_err(|error| unreachable(error.to_string()))? {
            match TcpStream::connect_timeout(&socket, wait) {
                Ok(stream) => return Self::prepared(address.clone(), stream).map_err(|error| unreachable(error.to_string())),
                Err(error) => reason = error.to_string(),
            }
        }
        Err(unreachable(reason))
    }

    fn prepared(address: String, stream: TcpStream) -> std::io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(READ_WAIT))?;
        stream.set_write_timeout(Some(WRITE_WAIT))?;
        Ok(Self { address, stream })
    }

    /// Reads what is there, waiting a moment; zero bytes when nothing is.
    ///
    /// # Errors
    /// [`LinkError::Lost`], also when the other end has closed.
    pub(super) fn read(&mut self, bytes: &mut [u8]) -> Result<usize, LinkError> {
        match self.stream.read(bytes) {
            Ok(0) => Err(self.lost("it was closed at the other end")),
            Ok(count) => Ok(count),
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted | ErrorKind::WouldBlock) => Ok(0),
            Err(error) => Err(self.lost(&error.to_string())),
        }
    }

    /// Writes all bytes.
    ///
    /// # Errors
    /// [`LinkError::Lost`].
    pub(super) fn write_all(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.stream.write_all(bytes).map_err(|error| self.lost(&error.to_string()))
    }

    /// Reads away what nobody needs, so that the other end is not held up. At most `limit` bytes.
    ///
    /// # Errors
    /// [`LinkError::Lost`].
    pub(super) fn discard(&mut self, limit: usize) -> Result<(), LinkError> {
        let mut bytes = [0; 4096];
        let mut discarded = 0;
        while discarded < limit {
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
