//! `stream.bbl`: frames exactly as they came.
//!
//! The file begins with `BBL1`, the protocol's number (two bytes, low first) and the eight bytes of its schema's hash, and a zero.
//! Frames follow, each ended by its zero. Nothing is ever changed or cut off: when a program was killed within a frame, the next one
//! begins with a zero that ends the torn frame, and the reader counts it.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use ballbar::wire::{FrameReader, LogMark, MAX_FRAME, PROTOCOL, ProtocolVersion, ToHost, decode, encode};
use miette::Diagnostic;
use thiserror::Error;

use super::segments::Segments;
use crate::board::{Implausible, MessageFilter, StreamLosses};

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
        let length = file.seek(SeekFrom::End(0)).map_err(io("cannot be read"))?;
        if length == 0 {
            file.write_all(&header()).map_err(io("cannot be written"))?;
        } else {
            file.seek(SeekFrom::Start(0)).map_err(io("cannot be read"))?;
            check_header(&mut file, path)?;
            // Ends the frame that a killed program may have left torn; after a whole one it changes nothing.
            file.write_all(&[0]).map_err(io("cannot be written"))?;
        }
        let mut writer = Self { path: path.to_owned(), file, is_torn: false };
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
        self.is_torn = written.is_err();
        written.map_err(|error| LogError::Io { path: self.path.clone(), doing: "cannot be written", error })
    }

    /// Notes that the port was lost or is back.
    ///
    /// # Errors
    /// [`LogError::Io`].
    pub fn mark(&mut self, mark: LogMark) -> Result<(), LogError> {
        let mut buffer = [0; MAX_FRAME];
        let frame = encode(&ToHost::Mark(mark), &mut buffer).map(<[u8]>::to_vec).unwrap_or_default();
        self.frame(&frame)
    }

    /// Asks the disk to keep what was written, for when the power fails.
    ///
    /// # Errors
    /// [`LogError::Io`].
    pub fn sync(&self) -> Result<(), LogError> {
        self.file.sync_data().map_err(|error| LogError::Io { path: self.path.clone(), doing: "cannot be written", error })
    }
}

/// Milliseconds since 1970, UTC.
pub(crate) fn unix_ms() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_millis() as u64)
}

/// One entry of a log.
#[derive(Clone, Debug)]
pub enum Record {
    /// A whole frame, whose message is believed.
    Message(Box<ToHost>),
    /// A whole frame, whose message is not to be believed.
    Refused(Implausible),
    /// A frame that is torn or damaged.
    Damaged,
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
                    return Ok(Some(self.checked(message.unwrap_or(Record::Damaged))));
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
