//! `stream.bbl`: frames exactly as they came.
//!
//! The file begins with `BBL1`, the protocol's number (two bytes, low first) and the eight bytes of its schema's hash, and a zero.
//! Frames follow, each ended by its zero. Nothing is ever changed or cut off: when a program was killed within a frame, the next one
//! begins with a zero that ends the torn frame, and the reader counts it.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use ballbar::wire::{FrameReader, LogMark, MAX_FRAME, PROTOCOL, ProtocolVersion, ToHost, decode, encode};
use miette::Diagnostic;
use same_file::Handle;
use thiserror::Error;

use super::pose_mark::PoseMark;
use super::record::Record;
use super::segments::Segments;
use crate::board::{MessageFilter, StreamLosses};

/// Why a log cannot be read or written.
#[derive(Debug, Error, Diagnostic)]
pub enum LogError {
    /// The operating system says no.
    #[error("{}: {doing}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried.
        doing: &'static str,
        /// Its reason.
        error: std::io::Error,
    },
    /// Another program has done something to the file that is being written.
    #[error("{}: another program has {what} it while this one recorded", path.display())]
    #[diagnostic(help("What was measured until then is in poses.csv. Run the same command again to go on."))]
    Displaced {
        /// The file.
        path: PathBuf,
        /// What.
        what: &'static str,
    },
    /// The file is something else.
    #[error("{}: no log of a session: it does not begin with `BBL1`", path.display())]
    #[diagnostic(help("Give the session's directory, or the stream.bbl in it."))]
    NotALog {
        /// The file.
        path: PathBuf,
    },
    /// The frames are of another version of the protocol.
    #[error("{}: recorded with protocol {}, this program speaks {}", path.display(), name(.found), name(&PROTOCOL))]
    #[diagnostic(help("Read it with the program of the version that recorded it; session.toml names it."))]
    OtherVersion {
        /// The file.
        path: PathBuf,
        /// What it was recorded with.
        found: ProtocolVersion,
    },
}

fn name(version: &ProtocolVersion) -> String {
    let hash: String = version.schema.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("{} ({hash})", version.number)
}

const MAGIC: &[u8; 4] = b"BBL1";
const HEADER_BYTES: usize = 15;

fn header() -> [u8; HEADER_BYTES] {
    let mut header = [0; HEADER_BYTES];
    header[..4].copy_from_slice(MAGIC);
    header[4..6].copy_from_slice(&PROTOCOL.number.to_le_bytes());
    header[6..14].copy_from_slice(&PROTOCOL.schema);
    header
}

/// Appends to a log.
pub struct LogWriter {
    path: PathBuf,
    file: File,
    /// The same, to be known again.
    handle: Handle,
    /// Length of the file by what was written.
    length: u64,
    /// A frame could not be written whole: the next one must not be taken for its rest.
    is_torn: bool,
}

impl LogWriter {
    /// Opens a log to append to, or begins one.
    ///
    /// # Errors
    /// [`LogError`]; an existing file is never changed then.
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let io = |doing| move |error| LogError::Io { path: path.to_owned(), doing, error };
        let mut file =
            OpenOptions::new().read(true).append(true).create(true).open(path).map_err(io("cannot be opened for writing"))?;
        let mut begun = Vec::new();
        Read::by_ref(&mut file).take(HEADER_BYTES as u64).read_to_end(&mut begun).map_err(io("cannot be read"))?;
        if begun.len() < HEADER_BYTES && header().starts_with(&begun) {
            // A new file, or one whose program was killed before it had begun.
            file.write_all(&header()[begun.len()..]).map_err(io("cannot be written"))?;
        } else {
            check_header(&mut begun.as_slice(), path)?;
            // Ends the frame that a killed program may have left torn; after a whole one it changes nothing.
            file.write_all(&[0]).map_err(io("cannot be written"))?;
        }
        let handle = file.try_clone().and_then(Handle::from_file).map_err(io("cannot be read"))?;
        let length = file.metadata().map_err(io("cannot be read"))?.len();
        let mut writer = Self { path: path.to_owned(), file, handle, length, is_torn: false };
        writer.mark(LogMark::Opened { unix_ms: unix_ms() })?;
        Ok(writer)
    }

    /// Appends a frame as it came. It is with the operating system when this returns: a killed program loses nothing of it.
    ///
    /// # Errors
    /// [`LogError::Io`].
    pub fn frame(&mut self, bytes: &[u8]) -> Result<(), LogError> {
        let torn = if self.is_torn { self.file.write_all(&[0]) } else { Ok(()) };
        let written = torn.and_then(|()| self.file.write_all(bytes));
        self.length += u64::from(self.is_torn) + bytes.len() as u64;
        self.is_torn = written.is_err();
        if self.is_torn {
            self.length = self.file.metadata().map_or(0, |metadata| metadata.len());
        }
        written.map_err(|error| LogError::Io { path: self.path.clone(), doing: "cannot be written", error })
    }

    /// Notes that recording begins, or that the port was lost or is back.
    ///
    /// # Errors
    /// [`LogError::Io`].
    pub fn mark(&mut self, mark: LogMark) -> Result<(), LogError> {
        let mut buffer = [0; MAX_FRAME];
        let frame = encode(&ToHost::Mark(mark), &mut buffer).map(<[u8]>::to_vec).unwrap_or_default();
        self.frame(&frame)
    }

    /// Notes something of poses.
    ///
    /// # Errors
    /// [`LogError::Io`].
    pub fn pose_mark(&mut self, mark: &PoseMark) -> Result<(), LogError> {
        self.frame(&mark.frame().unwrap_or_default())
    }

    /// Asks the disk to keep what was written, for when the power fails.
    ///
    /// # Errors
    /// [`LogError::Io`].
    pub fn sync(&self) -> Result<(), LogError> {
        self.file.sync_data().map_err(|error| LogError::Io { path: self.path.clone(), doing: "cannot be written", error })
    }

    /// Whether the file still is where it was opened, with all that was written: on many systems a file that was removed or replaced
    /// can be written as if nothing had happened.
    ///
    /// # Errors
    /// [`LogError::Displaced`].
    pub fn check_place(&self) -> Result<(), LogError> {
        let what = match Handle::from_path(&self.path) {
            Ok(handle) if handle != self.handle => "put another file in the place of",
            Ok(_) if self.file.metadata().is_ok_and(|metadata| metadata.len() < self.length) => "cut short",
            Ok(_) => return Ok(()),
            Err(_) => "removed",
        };
        Err(LogError::Displaced { path: self.path.clone(), what })
    }
}

/// Milliseconds since 1970, UTC.
pub(crate) fn unix_ms() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_millis() as u64)
}

/// Reads a log from its beginning.
pub struct LogReader {
    path: PathBuf,
    file: std::io::BufReader<File>,
    frames: FrameReader,
    filter: MessageFilter,
    segments: Segments,
    /// Bytes behind the last zero: the frame that was being written when the program was killed.
    unfinished: usize,
}

impl LogReader {
    /// Whether there is a log in a session's directory to read; a header that was not written to its end is none yet.
    pub(super) fn is_begun(session: &Path) -> bool {
        std::fs::metadata(session.join(super::LOG_NAME)).is_ok_and(|log| log.len() >= HEADER_BYTES as u64)
    }

    /// Opens a log, or the log in a session's directory.
    ///
    /// # Errors
    /// [`LogError`].
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let path = if path.is_dir() { path.join(super::LOG_NAME) } else { path.to_owned() };
        let file = File::open(&path).map_err(|error| LogError::Io { path: path.clone(), doing: "cannot be read", error })?;
        let mut file = std::io::BufReader::new(file);
        check_header(&mut file, &path)?;
        let (filter, segments) = (MessageFilter::default(), Segments::default());
        Ok(Self { path, file, frames: FrameReader::new(), filter, segments, unfinished: 0 })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The next entry; `None` at the end.
    ///
    /// # Errors
    /// [`LogError::Io`].
    pub fn next_record(&mut self) -> Result<Option<Record>, LogError> {
        let mut byte = [0];
        loop {
            match self.file.read_exact(&mut byte) {
                Ok(()) => {}
                Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Ok(None),
                Err(error) => return Err(LogError::Io { path: self.path.clone(), doing: "cannot be read", error }),
            }
            self.unfinished = if byte[0] == 0 { 0 } else { self.unfinished + 1 };
            match self.frames.push(byte[0]) {
                None => {}
                Some(Ok(payload)) => {
                    let message = decode(payload).map(|message| Record::Message(Box::new(message)));
                    let mark = || PoseMark::of_payload(payload).map(Record::Mark);
                    let record = message.or_else(mark).unwrap_or(Record::Damaged);
                    return Ok(Some(self.checked(record)));
                }
                Some(Err(_)) => return Ok(Some(self.checked(Record::Damaged))),
            }
        }
    }

    /// A record, refused if its message is not to be believed where it stands.
    fn checked(&mut self, record: Record) -> Record {
        if self.segments.begins(&record) {
            self.filter.begin_segment();
        }
        let Record::Message(message) = &record else { return record };
        match self.filter.take(message) {
            Ok(()) => record,
            Err(reason) => Record::Refused(reason),
        }
    }

    /// What is missing before the latest record, or was refused.
    pub fn losses(&self) -> StreamLosses {
        self.filter.losses()
    }

    /// Bytes of a frame that the end of the file cuts off.
    pub fn unfinished_bytes(&self) -> usize {
        self.unfinished
    }
}

fn check_header(file: &mut impl Read, path: &Path) -> Result<(), LogError> {
    let mut found = [0; HEADER_BYTES];
    if file.read_exact(&mut found).is_err() || found[..4] != *MAGIC {
        return Err(LogError::NotALog { path: path.to_owned() });
    }
    if found != header() {
        let mut schema = [0; 8];
        schema.copy_from_slice(&found[6..14]);
        let found = ProtocolVersion { number: u16::from_le_bytes([found[4], found[5]]), schema };
        return Err(LogError::OtherVersion { path: path.to_owned(), found });
    }
    Ok(())
}
