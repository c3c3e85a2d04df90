//! Writing a file so that no reader ever sees half of it.

use std::fs::{File, Permissions};
use std::io::{Error, ErrorKind, Result as IoResult, Write};
use std::path::{Path, PathBuf};

use miette::Diagnostic;
use tempfile::NamedTempFile;
use thiserror::Error;

use super::temporary;
use crate::platform;

/// A file could not be written; what stood there before still stands there.
#[derive(Debug, Error, Diagnostic)]
#[error("{}: cannot be written: {error}", path.display())]
pub struct WriteError {
    path: PathBuf,
    error: Error,
    #[help]
    help: String,
}

/// Writes `contents` beside `path` under a temporary name, flushes it to the disk and renames it onto `path`. A link is
/// followed, and an older file's permissions are kept. A device, pipe or folder is refused, since renaming would replace it, and so are
/// a read-only file and a link to nothing.
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
pub fn write_atomically_with(path: &Path, write: impl FnOnce(&mut File) -> IoResult<()>) -> Result<(), WriteError> {
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
    /// What keeps a file from being written, or an error of whoever makes its contents. Nothing was changed.
    pub(crate) fn new(path: &Path, error: Error) -> Self {
        Self::after(&[], path, error)
    }

    /// As [`WriteError::new`], when these files have been replaced already.
    fn after(replaced: &[PathBuf], path: &Path, error: Error) -> Self {
        // Without the temporary name that the error may carry, which means nothing to the user.
        let is_bare = error.raw_os_error().is_none() && error.kind() != ErrorKind::Other;
        let error = if is_bare { error.kind().into() } else { error };
        let names: Vec<String> = replaced.iter().map(|path| path.display().to_string()).collect();
        let help = if names.is_empty() {
            "Nothing was changed. Is the folder there, and may you write in it?".to_owned()
        } else {
            format!("Written before, and whole: {}.", names.join(", "))
        };
        Self { path: path.to_owned(), error, help }
    }
}

/// A file that is being written under a temporary name. Dropped without [`commit_all`], it leaves no trace.
pub(crate) struct PendingFile {
    file: NamedTempFile,
    path: PathBuf,
    target: Target,
}

impl PendingFile {
    /// Begins a file.
    ///
    /// # Errors
    /// As [`write_atomically`].
    pub(crate) fn begin(path: &Path) -> Result<Self, WriteError> {
        let begin = || {
            let target = Target::of(path)?;
            Ok((target.temporary()?, target))
        };
        let (file, target) = begin().map_err(|error| WriteError::new(path, error))?;
        Ok(Self { file, path: path.to_owned(), target })
    }

    /// Where to write.
    pub(crate) fn file_mut(&mut self) -> &mut File {
        self.file.as_file_mut()
    }
}

/// What a file is to be renamed to.
struct Target {
    /// Links followed.
    path: PathBuf,
    /// Of the older file, where there is one.
    permissions: Option<Permissions>,
}

impl Target {
    fn of(path: &Path) -> IoResult<Self> {
        match path.canonicalize() {
            Ok(path) => Self::there(path),
            Err(error) if error.kind() == ErrorKind::NotFound => Self::new(path),
            Err(error) => Err(error),
        }
    }

    /// An older file.
    fn there(path: PathBuf) -> IoResult<Self> {
        let metadata = path.metadata()?;
        if !metadata.is_file() {
            return Err(Error::other("it is there, but is no regular file"));
        }
        let permissions = metadata.permissions();
        if permissions.readonly() {
            return Err(Error::other("it is there, and read-only"));
        }
        Ok(Self { path, permissions: Some(permissions) })
    }

    fn new(path: &Path) -> IoResult<Self> {
        let is_name = |name: &std::ffi::OsStr| path.as_os_str().as_encoded_bytes().ends_with(name.as_encoded_bytes());
        if !path.file_name().is_some_and(is_name) {
            return Err(Error::other("this is a folder's name, not a file's"));
        }
        if path.is_symlink() {
            return Err(Error::other("it is a link to what is not there"));
        }
        Ok(Self { path: path.to_owned(), permissions: None })
    }

    /// The file to write before: in the same folder, so that it can be renamed.
    fn temporary(&self) -> IoResult<NamedTempFile> {
        let folder = self.path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let Some(permissions) = &self.permissions else {
            return temporary::create_in(folder, platform::with_usual_permissions);
        };
        let file = temporary::create_in(folder, |_| ())?;
        file.as_file().set_permissions(permissions.clone())?;
        Ok(file)
    }
}

/// Flushes files to the disk, and renames them when that has worked for all.
///
/// # Errors
/// As [`write_atomically`]. Where one of several cannot be renamed, [`WriteError`] names those before it, which have been.
pub(crate) fn commit_all(files: impl IntoIterator<Item = PendingFile>) -> Result<(), WriteError> {
    let files: Vec<PendingFile> = files.into_iter().collect();
    for PendingFile { file, path, .. } in &files {
        file.as_file().sync_all().map_err(|error| WriteError::new(path, error))?;
    }
    let mut replaced = Vec::new();
    for PendingFile { file, path, target } in files {
        file.persist(&target.path).map_err(|error| WriteError::after(&replaced, &path, error.error))?;
        replaced.push(path);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_replaced_before_a_rename_failed_is_named() {
        let folder = tempfile::TempDir::new().unwrap();
        let [first, second] = ["first", "second"].map(|name| folder.path().join(name));
        std::fs::write(&first, "older").unwrap();
        let mut files = [&first, &second].map(|path| PendingFile::begin(path).unwrap());
        files.iter_mut().for_each(|file| file.file_mut().write_all(b"newer").unwrap());
        std::fs::create_dir(&second).unwrap();
        let error = commit_all(files).unwrap_err();
        assert_eq!(error.help().unwrap().to_string(), format!("Written before, and whole: {}.", first.display()));
        assert_eq!(std::fs::read_to_string(&first).unwrap(), "newer");
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2, "no temporary file is left");
    }
}
