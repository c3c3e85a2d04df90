//! Writing a file so that no reader ever sees half of it.

use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use miette::Diagnostic;
use tempfile::NamedTempFile;
use thiserror::Error;

use crate::platform;

/// A file could not be written; what stood there before still stands there.
#[derive(Debug, Error, Diagnostic)]
#[error("{}: cannot be written: {error}", path.display())]
#[diagnostic(help("Nothing was changed. Is the folder there, and may you write in it?"))]
pub struct WriteError {
    path: PathBuf,
    error: std::io::Error,
}

/// Writes `contents` beside `path` under a temporary name, flushes it to the disk and renames it onto `path`. A link is
/// followed; a device, pipe or folder is refused, since renaming would replace it.
///
/// # Errors
/// [`WriteError`] with the operating system's reason; an older file of that name is left as it was.
pub fn write_atomically(path: &Path, contents: &str) -> Result<(), WriteError> {
    write_atomically_with(path, |file| file.write_all(contents.as_bytes()))
}

/// As [`write_atomically`], with contents that `write` writes piece by piece.
///
/// # Errors
/// As [`write_atomically`].
pub fn write_atomically_with(path: &Path, write: impl FnOnce(&mut File) -> std::io::Result<()>) -> Result<(), WriteError> {
    let mut file = PendingFile::begin(path)?;
    write(file.file_mut()).map_err(|error| WriteError::new(path, error))?;
    commit_all([file])
}

/// Whether a file could be written: to be asked before a long computation of what it is to hold.
///
/// # Errors
/// As [`write_atomically`].
pub fn check_writable(path: &Path) -> Result<(), WriteError> {
    PendingFile::begin(path).map(|_| ())
}

impl WriteError {
    /// What keeps a file from being written, or an error of whoever makes its contents.
    pub(crate) fn new(path: &Path, error: std::io::Error) -> Self {
        // Without the temporary name that the error may carry, which means nothing to the user.
        let is_bare = error.raw_os_error().is_none() && error.kind() != ErrorKind::Other;
        let error = if is_bare { error.kind().into() } else { error };
        Self { path: path.to_owned(), error }
    }
}

/// A file that is being written under a temporary name. Dropped without [`commit_all`], it leaves no trace.
pub(crate) struct PendingFile {
    file: NamedTempFile,
    path: PathBuf,
    /// What it is to be renamed to: what `path` names, links followed.
    target: PathBuf,
}

impl PendingFile {
    /// Begins a file.
    ///
    /// # Errors
    /// As [`write_atomically`].
    pub(crate) fn begin(path: &Path) -> Result<Self, WriteError> {
        let begin = || {
            let target = match path.canonicalize() {
                Ok(target) if target.is_file() => target,
                Ok(_) => return Err(std::io::Error::other("it is there, but is no regular file")),
                Err(_) => path.to_owned(),
            };
            let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let mut builder = tempfile::Builder::new();
            platform::with_usual_permissions(&mut builder);
            Ok((builder.prefix(".host-cal-").tempfile_in(folder)?, target))
        };
        let (file, target) = begin().map_err(|error| WriteError::new(path, error))?;
        Ok(Self { file, path: path.to_owned(), target })
    }

    /// Where to write.
    pub(crate) fn file_mut(&mut self) -> &mut File {
        self.file.as_file_mut()
    }
}

/// Flushes files to the disk, and renames them when that has worked for all.
///
/// # Errors
/// As [`write_atomically`].
pub(crate) fn commit_all(files: impl IntoIterator<Item = PendingFile>) -> Result<(), WriteError> {
    let files: Vec<PendingFile> = files.into_iter().collect();
    for PendingFile { file, path, .. } in &files {
        file.as_file().sync_all().map_err(|error| WriteError::new(path, error))?;
    }
    for PendingFile { file, path, target } in files {
        file.persist(&target).map_err(|error| WriteError::new(&path, error.error))?;
    }
    Ok(())
}
