//! Several files at once: all of them, or none.

use std::io::Error;
use std::path::{Path, PathBuf};

use miette::Diagnostic;
use thiserror::Error;

use super::kind::FileKind;
use super::write::{Output, PendingFile, WriteError, commit_all};

/// A file's name, what it is, and its contents.
pub type NamedFile = (PathBuf, FileKind, String);

/// Why files could not be written.
#[derive(Debug, Error, Diagnostic)]
pub enum FilesError {
    /// The folder of one.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Folder(#[from] FolderError),
    /// One of them; the others were not written either, unless its help says so.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Write(#[from] WriteError),
}

/// A folder that is not there cannot be made.
#[derive(Debug, Error, Diagnostic)]
#[error("{}: cannot be made: {error}", folder.display())]
#[diagnostic(help("Give a folder that is there, or that can be made."))]
pub struct FolderError {
    folder: PathBuf,
    error: Error,
}

/// Writes files that were asked for: all of them, or none when one may not be written. Folders are made where they are missing.
///
/// # Errors
/// [`FilesError`].
pub fn write_files(files: &[NamedFile], force: bool) -> Result<(), FilesError> {
    for folder in files.iter().filter_map(|(path, ..)| path.parent()).filter(|folder| !folder.as_os_str().is_empty()) {
        make_folder(folder)?;
    }
    let outputs = files.iter().map(|(path, kind, _)| Output { path, kind: *kind, force });
    let mut pending = PendingFile::begin_all(outputs)?;
    pending.iter_mut().zip(files).try_for_each(|(file, (.., contents))| file.fill(contents))?;
    Ok(commit_all(pending)?)
}

/// Makes a folder, and those above it, where they are missing.
///
/// # Errors
/// [`FolderError`] with the operating system's reason.
pub fn make_folder(folder: &Path) -> Result<(), FolderError> {
    std::fs::create_dir_all(folder).map_err(|error| FolderError { folder: folder.to_owned(), error })
}
