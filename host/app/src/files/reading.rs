//! Opening and reading files, to their text. What this process has read is remembered, so that no output takes its place (`write.rs`).
#![expect(clippy::disallowed_methods, reason = "the one place where inputs are opened")]

use std::fs::File;
use std::io::{Read, Result as IoResult};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::encoding;
use super::problem::Problem;
use super::source::{InputError, Source};

/// A hundred times what the longest robot or rig has.
pub(super) const MOST_TOML_BYTES: u64 = 1 << 20;
/// Of poses, plans and targets: a million rows fit in.
const MOST_ROWS_BYTES: u64 = 128 << 20;

/// Absolute paths of the regular files that were opened to be read.
static READ: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Opens a file to read it.
pub(super) fn open(path: &Path) -> IoResult<File> {
    let file = File::open(path)?;
    if file.metadata()?.is_file() {
        let path = std::path::absolute(path)?;
        let mut read = read();
        if !read.contains(&path) {
            read.push(path);
        }
    }
    Ok(file)
}

/// Opens a file to see what it is, which makes it no input.
pub(super) fn look_at(path: &Path) -> IoResult<File> {
    File::open(path)
}

/// Whether a file, by whatever name, is one that was opened to be read.
pub(super) fn was_read(path: &Path) -> bool {
    read().iter().any(|input| same_file::is_same_file(input, path).unwrap_or(false))
}

fn read() -> MutexGuard<'static, Vec<PathBuf>> {
    READ.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Source {
    /// Reads a file of rows: of poses, of targets, or a plan; 128 MiB at most.
    ///
    /// # Errors
    /// As [`Source::read_at_most`].
    pub fn read_rows(path: &Path) -> Result<Self, InputError> {
        Self::read_at_most(path, MOST_ROWS_BYTES)
    }

    /// Reads a file of a robot or of a rig; a mebibyte at most.
    ///
    /// # Errors
    /// As [`Source::read_at_most`].
    pub fn read_toml(path: &Path) -> Result<Self, InputError> {
        Self::read_at_most(path, MOST_TOML_BYTES)
    }

    /// Reads a file of at most so many bytes; a longer one is not read to its end. UTF-8, or UTF-16 with its byte order mark.
    ///
    /// # Errors
    /// [`Problem::Unreadable`] when it cannot be opened, [`Problem::TooLong`], [`Problem::NotText`], [`Problem::ZeroByte`].
    pub fn read_at_most(path: &Path, most_bytes: u64) -> Result<Self, InputError> {
        let name = path.display().to_string();
        encoding::decode(&name, &read_bytes(&name, path, most_bytes)?, None)
    }

    /// As [`Source::read_at_most`], in the encoding that an XML document says it has.
    ///
    /// # Errors
    /// As [`Source::read_at_most`], and [`Problem::Encoding`].
    pub(super) fn read_xml(path: &Path, most_bytes: u64) -> Result<Self, InputError> {
        let name = path.display().to_string();
        let bytes = read_bytes(&name, path, most_bytes)?;
        let declared = encoding::declared(&name, &bytes)?;
        encoding::decode(&name, &bytes, declared)
    }

    /// Takes a built-in of that name, or else reads the file of that name, of a mebibyte at most.
    ///
    /// # Errors
    /// [`Problem::NoSuchFile`] with the built-in names when there is neither, or as [`Source::read_at_most`].
    pub fn named_or_read(argument: &str, builtins: &[(&str, &str)], what: &'static str) -> Result<Self, InputError> {
        if let Some((name, text)) = builtins.iter().find(|(name, _)| *name == argument) {
            return Ok(Self::new(&format!("{name} (built in)"), text));
        }
        let path = Path::new(argument);
        if !path.exists() {
            let names = builtins.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
            return Err(InputError::of_file(argument, Problem::NoSuchFile { what, builtins: names }));
        }
        Self::read_toml(path)
    }
}

/// The bytes of a file, which is not read to its end when it is too long.
fn read_bytes(name: &str, path: &Path, most_bytes: u64) -> Result<Vec<u8>, InputError> {
    let refuse = |problem| InputError::of_file(name, problem);
    let read = || {
        let file = open(path)?;
        let length = file.metadata()?.len();
        let mut bytes = Vec::new();
        if length <= most_bytes {
            // A device has no length, and a file may grow while it is read.
            file.take(most_bytes + 1).read_to_end(&mut bytes)?;
        }
        Ok((length, bytes))
    };
    let (length, bytes) = read().map_err(|error: std::io::Error| refuse(Problem::Unreadable(error.to_string())))?;
    let is_too_long = length > most_bytes || bytes.len() as u64 > most_bytes;
    if is_too_long { Err(refuse(Problem::TooLong { most_bytes })) } else { Ok(bytes) }
}
