//! One writer a session: whoever records or mends holds the lock of its directory.
//!
//! The lock is the operating system's own, on `session.lock`, so that it ends with the process however that ends. The file stays: to
//! remove it while somebody waits at it would let two in. What stands in it is for people alone.

use std::fmt;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use miette::Diagnostic;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{LOCK_NAME, now};

/// The right to write into a session. Ends when the last copy is dropped, or with the process.
#[derive(Clone, Debug)]
pub struct SessionLock {
    session: PathBuf,
    /// Open for as long as the lock is held.
    _file: Arc<File>,
}

/// Why a session cannot be written into.
#[derive(Debug, Error, Diagnostic)]
pub enum LockError {
    /// Somebody else writes.
    #[error("{}: another program records into this session: {holder}", session.display())]
    #[diagnostic(help(
        "Wait until it has ended, or end it; or record into another directory. `fit`, `report`, `validate` and `log` read the session meanwhile."
    ))]
    InUse {
        /// The session.
        session: PathBuf,
        /// Who it is.
        holder: Holder,
    },
    /// The directory or the lock's file cannot be made or opened.
    #[error("{}: {doing}: {error}", path.display())]
    Io {
        /// The directory or the file.
        path: PathBuf,
        /// What was tried.
        doing: &'static str,
        /// The operating system's reason.
        error: std::io::Error,
    },
    /// The file system has no locks.
    #[error("{}: cannot be locked: {error}", path.display())]
    #[diagnostic(help("Two programs could write here at once. Record into a directory on a disk of this machine."))]
    NoLocks {
        /// The lock's file.
        path: PathBuf,
        /// The operating system's reason.
        error: std::io::Error,
    },
}

/// Who holds a lock, by their own words; nothing where those cannot be read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Holder {
    pid: Option<u32>,
    since: Option<String>,
    command: Option<String>,
}

impl SessionLock {
    /// Takes the lock of a session's directory, which is made when it is not there. Does not wait.
    ///
    /// # Errors
    /// [`LockError`].
    pub fn acquire(session: &Path) -> Result<Self, LockError> {
        let io = |path: &Path, doing| {
            let path = path.to_owned();
            move |error| LockError::Io { path, doing, error }
        };
        std::fs::create_dir_all(session).map_err(io(session, "cannot be made"))?;
        let path = session.join(LOCK_NAME);
        let open = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
        let mut file = open.map_err(io(&path, "cannot be opened for writing"))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(LockError::InUse { session: session.to_owned(), holder: Holder::read(&mut file) });
            }
            Err(TryLockError::Error(error)) => return Err(LockError::NoLocks { path, error }),
        }
        // Words that cannot be written are no reason not to record.
        let _ = Holder::this_process().write(&mut file);
        Ok(Self { session: session.to_owned(), _file: Arc::new(file) })
    }

    /// The session's directory.
    pub fn session(&self) -> &Path {
        &self.session
    }
}

impl Holder {
    fn this_process() -> Self {
        let command = std::env::args_os().enumerate().map(|(i, arg)| match i {
            0 => Path::new(&arg).file_name().unwrap_or(&arg).to_string_lossy().into_owned(),
            _ => arg.to_string_lossy().into_owned(),
        });
        Self { pid: Some(std::process::id()), since: Some(now()), command: Some(command.collect::<Vec<_>>().join(" ")) }
    }

    fn write(&self, file: &mut File) -> std::io::Result<()> {
        file.set_len(0)?;
        file.rewind()?;
        file.write_all(toml::to_string(self).map_err(std::io::Error::other)?.as_bytes())
    }

    /// What the holder wrote; on Windows nobody else can read it.
    fn read(file: &mut File) -> Self {
        const MOST_BYTES: u64 = 1 << 14;
        let mut text = String::new();
        let read = file.rewind().and_then(|()| file.take(MOST_BYTES).read_to_string(&mut text));
        read.ok().and_then(|_| toml::from_str(&text).ok()).unwrap_or_default()
    }
}

impl fmt::Display for Holder {
    /// `host-cal stream /dev/ttyUSB0 --session s (process 4711, since 2026-01-02T03:04:05Z)`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { pid: Some(pid), since: Some(since), command: Some(command) } = self else {
            return f.write_str("which one is not known");
        };
        write!(f, "{} (process {pid}, since {})", printable(command), printable(since))
    }
}

/// At most a line of a text, with spaces for what a terminal would obey.
fn printable(text: &str) -> String {
    const MOST: usize = 200;
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(MOST).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_has_one_writer_who_is_named_and_the_next_comes_when_it_has_ended() {
        let folder = tempfile::tempdir().unwrap();
        let session = folder.path().join("a/s");
        let first = SessionLock::acquire(&session).unwrap();
        let copy = first.clone();
        let error = SessionLock::acquire(&session.join("../s")).unwrap_err().to_string();
        let process = format!("(process {}, since 20", std::process::id());
        assert!(error.contains(&process), "{error}");
        drop(first);
        assert!(SessionLock::acquire(&session).is_err(), "a copy holds it as well");
        drop(copy);
        let second = SessionLock::acquire(&session).unwrap();
        assert_eq!(second.session(), session);
    }

    #[test]
    fn words_that_are_none_are_no_reason_to_let_a_second_writer_in() {
        let folder = tempfile::tempdir().unwrap();
        for words in ["", "pid = -1", "pid = 1\nsince = \"\\u001b[2J\"\ncommand = \"a\\nb\""] {
            let lock = SessionLock::acquire(folder.path()).unwrap();
            std::fs::write(folder.path().join(LOCK_NAME), words).unwrap();
            let error = SessionLock::acquire(folder.path()).unwrap_err().to_string();
            assert!(error.contains("another program records") && !error.contains(char::is_control), "{error:?}");
            drop(lock);
        }
    }
}
