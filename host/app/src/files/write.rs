//! Writing a file so that no reader ever sees half of it.

use std::collections::HashSet;
use std::fs::{File, Permissions};
use std::io::{Error, ErrorKind, Result as IoResult, Write};
use std::path::{Path, PathBuf};

use miette::Diagnostic;
use tempfile::NamedTempFile;
use thiserror::Error;

use super::kind::FileKind;
use super::protect::{self, Refusal};
use super::temporary;
use crate::platform;

/// A file could not be written; what stood there before still stands there.
#[derive(Debug, Error, Diagnostic)]
pub enum WriteError {
    /// The operating system says no, or whoever makes the contents.
    #[error("{}: cannot be written: {error}", path.display())]
    #[diagnostic(help("{help}"))]
    Failed {
        /// The file.
        path: PathBuf,
        /// The reason.
        error: Error,
        /// What became of it.
        help: String,
    },
    /// What stands there is not to be replaced.
    #[error("{}: {refusal}", path.display())]
    #[diagnostic(help("{}", refusal.help()))]
    Refused {
        /// The file.
        path: PathBuf,
        /// What stands there.
        refusal: Refusal,
    },
}

/// A file that a command was asked to write. It takes the place of no input of this process, no recording and no file of a session, and
/// of another kind of file only with `force`: it is checked when it is begun, and again when it is put in place.
#[derive(Clone, Copy, Debug)]
pub struct Output<'a> {
    /// The name that was given.
    pub path: &'a Path,
    /// What is written.
    pub kind: FileKind,
    /// Whether a file of another kind may be replaced.
    pub force: bool,
}

impl Output<'_> {
    /// Writes the file.
    ///
    /// # Errors
    /// [`WriteError`]; an older file of that name is left as it was.
    pub fn write(&self, contents: &str) -> Result<(), WriteError> {
        let mut file = PendingFile::begin(*self)?;
        file.fill(contents)?;
        commit_all([file])
    }

    /// Whether the file could be written: to be asked before a long computation of what it is to hold, and after all that it needs was
    /// read.
    ///
    /// # Errors
    /// As [`Output::write`].
    pub fn check(&self) -> Result<(), WriteError> {
        PendingFile::begin(*self).map(|_| ())
    }
}

/// Writes a file that this program keeps for itself, such as those of the session that it records: what a command was asked to write is
/// an [`Output`]. `contents` go beside `path` under a temporary name, are flushed to the disk and renamed onto `path`. A link is
/// followed, and an older file's permissions are kept. A device, pipe or folder is refused, since renaming would replace it, and so are
/// a read-only file and a link to nothing.
///
/// # Errors
/// [`WriteError::Failed`] with the operating system's reason; an older file of that name is left as it was.
pub fn write_atomically(path: &Path, contents: &str) -> Result<(), WriteError> {
    write_atomically_with(path, |file| file.write_all(contents.as_bytes()))
}

/// As [`write_atomically`], with contents that `write` writes piece by piece.
///
/// # Errors
/// As [`write_atomically`].
pub fn write_atomically_with(path: &Path, write: impl FnOnce(&mut File) -> IoResult<()>) -> Result<(), WriteError> {
    let mut file = PendingFile::begin_own(path)?;
    write(file.file_mut()).map_err(|error| WriteError::new(path, error))?;
    commit_all([file])
}

impl WriteError {
    /// What keeps a file from being written, or an error of whoever makes its contents. Nothing was changed.
    pub(crate) fn new(path: &Path, error: Error) -> Self {
        Self::after(&[], path, error)
    }

    /// Whether it is not the system that says no, but what stands there.
    pub fn is_refusal(&self) -> bool {
        matches!(self, Self::Refused { .. })
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
        Self::Failed { path: path.to_owned(), error, help }
    }
}

/// A file that is being written under a temporary name. Dropped without [`commit_all`], it leaves no trace.
pub(crate) struct PendingFile {
    file: NamedTempFile,
    path: PathBuf,
    target: Target,
    /// What is checked before it is put in place; nothing for the program's own files.
    rule: Option<Rule>,
}

/// What is written, and whether a file of another kind may be replaced.
#[derive(Clone, Copy)]
struct Rule {
    kind: FileKind,
    force: bool,
}

impl PendingFile {
    /// Begins a file that a command was asked to write.
    ///
    /// # Errors
    /// As [`Output::write`].
    pub(crate) fn begin(output: Output<'_>) -> Result<Self, WriteError> {
        Self::begin_by(output.path, Some(Rule { kind: output.kind, force: output.force }))
    }

    /// Begins the files of a command that writes several.
    ///
    /// # Errors
    /// As [`Output::write`]; also when two of them are one file.
    pub(crate) fn begin_all<'a>(outputs: impl IntoIterator<Item = Output<'a>>) -> Result<Vec<Self>, WriteError> {
        let mut places = HashSet::new();
        let begun = |output: Output<'a>| {
            let file = Self::begin(output)?;
            let refused = || WriteError::Refused { path: output.path.to_owned(), refusal: Refusal::Twice };
            if places.insert(file.target.place()) { Ok(file) } else { Err(refused()) }
        };
        outputs.into_iter().map(begun).collect()
    }

    pub(crate) fn begin_own(path: &Path) -> Result<Self, WriteError> {
        Self::begin_by(path, None)
    }

    fn begin_by(path: &Path, rule: Option<Rule>) -> Result<Self, WriteError> {
        let target = Target::of(path).map_err(|error| WriteError::new(path, error))?;
        target.check(path, rule)?;
        let file = target.temporary().map_err(|error| WriteError::new(path, error))?;
        Ok(Self { file, path: path.to_owned(), target, rule })
    }

    /// Where to write.
    pub(crate) fn file_mut(&mut self) -> &mut File {
        self.file.as_file_mut()
    }

    /// Writes all that it is to hold.
    ///
    /// # Errors
    /// [`WriteError::Failed`].
    pub(crate) fn fill(&mut self, contents: &str) -> Result<(), WriteError> {
        self.file.write_all(contents.as_bytes()).map_err(|error| WriteError::new(&self.path, error))
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

    fn check(&self, path: &Path, rule: Option<Rule>) -> Result<(), WriteError> {
        let Some(Rule { kind, force }) = rule else { return Ok(()) };
        protect::check(path, &self.path, kind, force).map_err(|refusal| WriteError::Refused { path: path.to_owned(), refusal })
    }

    /// The folder, links followed, and the name: the same for two names of one file, there already or not.
    fn place(&self) -> PathBuf {
        let folder = self.folder().canonicalize().unwrap_or_else(|_| self.folder().to_owned());
        self.path.file_name().map_or_else(|| folder.clone(), |name| folder.join(name))
    }

    fn folder(&self) -> &Path {
        self.path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
    }

    /// The file to write before: in the same folder, so that it can be renamed.
    fn temporary(&self) -> IoResult<NamedTempFile> {
        let folder = self.folder();
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
/// As [`Output::write`]. Where one of several cannot be renamed, [`WriteError`] names those before it, which have been.
#[expect(clippy::disallowed_methods, reason = "the one place where files are put in place")]
pub(crate) fn commit_all(files: impl IntoIterator<Item = PendingFile>) -> Result<(), WriteError> {
    let files: Vec<PendingFile> = files.into_iter().collect();
    for PendingFile { file, path, target, rule } in &files {
        // Again, for what was read, or came there, since it was begun.
        target.check(path, *rule)?;
        file.as_file().sync_all().map_err(|error| WriteError::new(path, error))?;
    }
    let mut replaced = Vec::new();
    for PendingFile { file, path, target, rule } in files {
        // And again: on some disks two names of other letter case are one file.
        target.check(&path, rule)?;
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
        let mut files = [&first, &second].map(|path| PendingFile::begin_own(path).unwrap());
        files.iter_mut().for_each(|file| file.file_mut().write_all(b"newer").unwrap());
        std::fs::create_dir(&second).unwrap();
        let error = commit_all(files).unwrap_err();
        assert_eq!(error.help().unwrap().to_string(), format!("Written before, and whole: {}.", first.display()));
        assert_eq!(std::fs::read_to_string(&first).unwrap(), "newer");
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2, "no temporary file is left");
    }
}
