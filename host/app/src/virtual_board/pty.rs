//! A pseudo-terminal as a serial port: the board holds the one end, the host opens the other by name.

use std::fs;
use std::io;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::io::{ioctl_fionbio, ioctl_fionread};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, ioctl_tiocnxcl, tcgetattr, tcsetattr};

/// Both ends of a pseudo-terminal in raw mode. Dropping it removes the name that it was given.
pub(super) struct Pty {
    board_end: OwnedFd,
    /// Held open: without any opener of this end, the board's reads and writes would fail while no host is there.
    host_end: OwnedFd,
    path: PathBuf,
    name: Option<PathBuf>,
    shared_at: Instant,
}

/// How often the port is made free for another opener.
const SHARE_EVERY: Duration = Duration::from_millis(100);

impl Pty {
    /// Opens a pseudo-terminal. `name` becomes a symbolic link to the host's end, instead of a link that stood there.
    pub(super) fn open(name: Option<&Path>) -> io::Result<Self> {
        let board_end = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        grantpt(&board_end)?;
        unlockpt(&board_end)?;
        let path = PathBuf::from(ptsname(&board_end, Vec::new())?.to_string_lossy().into_owned());
        let host_end = rustix::fs::open(&path, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty())?;
        let mut settings = tcgetattr(&host_end)?;
        settings.make_raw();
        tcsetattr(&host_end, OptionalActions::Now, &settings)?;
        ioctl_fionbio(&board_end, true)?;
        if let Some(name) = name {
            link(&path, name)?;
        }
        Ok(Self { board_end, host_end, path, name: name.map(Path::to_owned), shared_at: Instant::now() })
    }

    /// What the host opens.
    pub(super) fn port(&self) -> String {
        self.name.as_ref().unwrap_or(&self.path).display().to_string()
    }

    /// Reads what the host has written; returns how many bytes, 0 for none.
    pub(super) fn read(&self, bytes: &mut [u8]) -> usize {
        rustix::io::read(&self.board_end, bytes).unwrap_or(0)
    }

    /// Writes as much as the line takes now; returns how many bytes.
    pub(super) fn write(&self, bytes: &[u8]) -> usize {
        rustix::io::write(&self.board_end, bytes).unwrap_or(0)
    }

    /// Waits until the host has written, the line takes bytes again (where that is of interest), or the time is over.
    pub(super) fn wait(&self, also_for_room: bool, timeout: Duration) {
        let interest = if also_for_room { PollFlags::IN | PollFlags::OUT } else { PollFlags::IN };
        let timeout = Timespec { tv_sec: 0, tv_nsec: timeout.subsec_nanos().into() };
        // A wait that a signal ends early does no harm: the caller looks again.
        let _ = poll(&mut [PollFd::new(&self.board_end, interest)], Some(&timeout));
    }

    /// Whether bytes wait for the host to read them.
    pub(super) fn has_unread(&self) -> bool {
        ioctl_fionread(&self.host_end).is_ok_and(|unread| unread > 0)
    }

    /// A host opens its port for itself alone. A real port is free again when its opener has gone; this one is still held open
    /// here, and would stay closed to all others.
    pub(super) fn share(&mut self) {
        if self.shared_at.elapsed() >= SHARE_EVERY {
            self.shared_at = Instant::now();
            let _ = ioctl_tiocnxcl(&self.host_end);
        }
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        if let Some(name) = &self.name
            && fs::read_link(name).is_ok_and(|target| target == self.path)
        {
            let _ = fs::remove_file(name);
        }
    }
}

/// Makes the link; an older one is replaced, anything else that stands there is left alone.
fn link(target: &Path, name: &Path) -> io::Result<()> {
    if fs::symlink_metadata(name).is_ok_and(|found| found.is_symlink()) {
        fs::remove_file(name)?;
    }
    std::os::unix::fs::symlink(target, name)
}
