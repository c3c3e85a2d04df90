//! Linux and macOS.

mod keys;

use std::collections::VecDeque;
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

use super::Key;
use keys::Decoder;

/// Temporary files are private by default; a new file renamed into place should have the mode that a plain write gives, which is
/// what the process's umask leaves of this.
pub(crate) fn with_usual_permissions(builder: &mut tempfile::Builder<'_, '_>) {
    builder.permissions(Permissions::from_mode(0o666));
}

/// The keys in the bytes of stdin. Not crossterm's events: with those a terminal that is gone, or a sequence broken off, is waited for
/// without end.
#[derive(Default)]
pub(crate) struct Keyboard {
    decoder: Decoder,
}

const WAIT: Timespec = Timespec { tv_sec: 0, tv_nsec: 50_000_000 };

impl Keyboard {
    /// The keys of the next 50 milliseconds; an error when there is no terminal any more.
    pub(crate) fn wait(&mut self) -> std::io::Result<VecDeque<Key>> {
        let stdin = std::io::stdin();
        let mut ready = [PollFd::new(&stdin, PollFlags::IN)];
        match poll(&mut ready, Some(&WAIT)) {
            Ok(0) | Err(Errno::INTR) => {
                self.decoder.rest();
                return Ok(VecDeque::new());
            }
            polled => polled?,
        };
        let mut bytes = [0; 64];
        match rustix::io::read(&stdin, &mut bytes) {
            Ok(0) => Err(std::io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => Ok(self.decoder.decode(&bytes[..count])),
            Err(Errno::INTR | Errno::AGAIN) => Ok(VecDeque::new()),
            Err(error) => Err(error.into()),
        }
    }
}
