//! Writing a file so that no reader ever sees half of it.

use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use miette::Diagnostic;
use tempfile::NamedTempFile;
use thiserror::Error;

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
    replace(path, write).map_err(|error| refuse(path, error))
}

/// Whether a file could be written: to be asked before a long computation of what it is to hold.
///
/// # Errors
/// As [`write_atomically`].
pub fn check_writable(path: &Path) -> Result<(), WriteError> {
    begin(path).map(|_| ()).map_err(|error| refuse(path, error))
}

fn refuse(path: &Path, error: std::io::Error) -> WriteError {
    // Without the temporary name that the error may carry, which means nothing to the user.
    let error = if error.raw_os_error().is_none() && error.kind() != ErrorKind::Other { error.kind().into() } else { error };
    WriteError { path: path.to_owned(), error }
}

fn replace(path: &Path, write: impl FnOnce(&mut File) -> std::io::Result<()>) -> std::io::Result<()> {
    let (mut file, target) = begin(path)?;
    write(file.as_file_mut())?;
    file.as_file().sync_all()?;
    file.persist(&target).map_err(|error| error.error)?;
    Ok(())
}

/// A temporary file, and what it is to be renamed to.
fn begin(path: &Path) -> std::io::Result<(NamedTempFile, PathBuf)> {
    let target = match path.canonicalize() {
        Ok(target) if target.is_file() => target,
        Ok(_) => return Err(std::io::Error::other("it is there, but is no regular file")),
        Err(_) => path.to_owned(),
    };
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    with_usual_permissions(&mut builder);
    let file = builder.prefix(".host-cal-").tempfile_in(folder)?;
    Ok((file, target))
}

/// Temporary files are private by default; a file renamed into place should have the mode that a plain write gives, which is
/// what the process's umask leaves of this.
#[cfg(unix)]
fn with_usual_permissions(builder: &mut tempfile::Builder<'_, '_>) {
    use std::os::unix::fs::PermissionsExt;
    builder.permissions(std::fs::Permissions::from_mode(0o666));
}

#[cfg(not(unix))]
fn with_usual_permissions(_: &mut tempfile::Builder<'_, '_>) {}
