//! A text file that a recording keeps, and rewrites again and again.

use std::path::{Path, PathBuf};

use miette::Diagnostic;
use thiserror::Error;

use crate::files::{PendingFile, WriteError, commit_all};

/// A text file that is written whole, by rename. Nobody else is to write it meanwhile; who has done so all the same loses nothing:
/// what is on the disk is compared with what was read or written last before it is replaced.
#[derive(Debug)]
pub(super) struct OwnFile {
    path: PathBuf,
    /// What was read or written last; nothing where there was no file.
    text: Option<String>,
}

/// Another program has changed a file.
#[derive(Debug, Error, Diagnostic)]
#[error("{}: another program has {what} it while this one recorded", path.display())]
#[diagnostic(help(
    "It was left as it is now. What was measured is in the log: run the same command again, and the poses that poses.csv lacks are written."
))]
pub struct ForeignChange {
    /// The file.
    pub path: PathBuf,
    /// `changed` or `removed`.
    what: &'static str,
    /// What it holds now, where that is text.
    pub(super) now: Option<String>,
}

/// Why a file was not replaced. It is then as it was.
#[derive(Debug, Error, Diagnostic)]
pub enum ReplaceError {
    /// It is not what it was.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Changed(#[from] ForeignChange),
    /// It cannot be written.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Write(#[from] WriteError),
}

impl OwnFile {
    /// Reads a file, where there is one.
    pub(super) fn read(path: &Path) -> std::io::Result<Self> {
        let text = match std::fs::read(path) {
            Ok(bytes) => Some(String::from_utf8(bytes).map_err(|error| not_text(&error))?),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => None,
            Err(error) => return Err(error),
        };
        Ok(Self { path: path.to_owned(), text })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// What was read or written last.
    pub(super) fn text(&self) -> Option<&str> {
        self.text.as_deref()
    }

    /// Whether the file holds what was read or written last.
    pub(super) fn check(&self) -> Result<(), ForeignChange> {
        let now = std::fs::read(&self.path).ok();
        if now.as_deref() == self.text.as_ref().map(String::as_bytes) {
            return Ok(());
        }
        let what = if now.is_some() { "changed" } else { "removed" };
        Err(ForeignChange { path: self.path.clone(), what, now: now.and_then(|bytes| String::from_utf8(bytes).ok()) })
    }

    /// Writes another text in the place of the last one.
    pub(super) fn replace(&mut self, text: String) -> Result<(), ReplaceError> {
        let failed = |error| WriteError::new(&self.path, error);
        let mut pending = PendingFile::begin_own(&self.path)?;
        std::io::Write::write_all(pending.file_mut(), text.as_bytes()).map_err(failed)?;
        // What takes time comes before the look at the file, so that next to nothing can happen between that and the rename.
        pending.file_mut().sync_all().map_err(failed)?;
        self.check()?;
        commit_all([pending])?;
        self.text = Some(text);
        Ok(())
    }
}

fn not_text(error: &std::string::FromUtf8Error) -> std::io::Error {
    let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
    let line = 1 + good.iter().filter(|&&byte| byte == b'\n').count();
    std::io::Error::new(std::io::ErrorKind::InvalidData, format!("line {line} is no UTF-8 text"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_somebody_else_did_to_a_file_stands() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("poses.csv");
        let edits: [(&str, Option<&str>); 5] = [
            ("a row deleted", Some("header\n1\n")),
            ("as long as before, a figure changed", Some("header\n1\n3\n")),
            ("emptied", Some("")),
            ("removed", None),
            ("a row added", Some("header\n1\n2\n2.5\n")),
        ];
        for (what, edit) in edits {
            let _ = std::fs::remove_file(&path);
            let mut file = OwnFile::read(&path).unwrap();
            file.replace("header\n1\n".into()).unwrap();
            file.replace("header\n1\n2\n".into()).unwrap();
            file.check().unwrap();
            match edit {
                Some(text) => std::fs::write(&path, text).unwrap(),
                None => std::fs::remove_file(&path).unwrap(),
            }
            assert!(file.check().is_err(), "{what}");
            assert!(matches!(file.replace("header\n1\n2\n3\n".into()), Err(ReplaceError::Changed(_))), "{what}");
            assert_eq!(std::fs::read_to_string(&path).ok().as_deref(), edit, "{what}");
            assert!(std::fs::read_dir(folder.path()).unwrap().count() <= 1, "{what}: no temporary file is left");
        }
    }
}
