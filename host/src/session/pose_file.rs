//! `poses.csv` of a session, growing pose by pose.

use std::path::{Path, PathBuf};

use ballbar::{JointKind, JointVector};
use miette::Diagnostic;
use thiserror::Error;

use crate::files::{WriteError, pose_header, pose_record, write_atomically};

/// A settled pose as it goes into the file.
#[derive(Clone, Debug)]
pub struct SettledRow<'a> {
    /// Name of the chuck.
    pub chuck: &'a str,
    /// Name of the sphere.
    pub sphere: &'a str,
    /// Joint values, radians or metres.
    pub q: JointVector<f64>,
    /// Length of the bar, metres.
    pub length_m: f64,
    /// Time of the middle of the pose by the board's clock, seconds.
    pub t_s: f64,
}

/// A file of poses that is written whole, by rename, after every pose: whatever happens, it is one that can be read.
#[derive(Debug)]
pub struct PoseFile {
    path: PathBuf,
    kinds: Vec<JointKind>,
    text: String,
    added: usize,
}

/// Why poses cannot be added.
#[derive(Debug, Error, Diagnostic)]
pub enum PoseFileError {
    /// The file is there and cannot be read.
    #[error("{}: cannot be read: {error}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        error: std::io::Error,
    },
    /// The file has other columns.
    #[error("{}:1: the columns are `{found}`, expected `{expected}`", path.display())]
    #[diagnostic(help("The file is of another robot, or was not written by `host-cal stream`. Record into another directory."))]
    OtherColumns {
        /// The file.
        path: PathBuf,
        /// Its header.
        found: String,
        /// The header of this robot's poses.
        expected: String,
    },
    /// The file cannot be written.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Write(#[from] WriteError),
}

impl PoseFile {
    /// Opens a file to add to, or begins one; nothing is written yet.
    ///
    /// # Errors
    /// [`PoseFileError`] when the file is there and is not one of this robot's.
    pub fn open(path: &Path, kinds: &[JointKind]) -> Result<Self, PoseFileError> {
        let expected = pose_header(kinds, &["t_s"]);
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => expected.clone() + "\n",
            Err(error) => return Err(PoseFileError::Unreadable { path: path.to_owned(), error }),
        };
        let found = text.lines().next().unwrap_or_default();
        if found != expected {
            return Err(PoseFileError::OtherColumns { path: path.to_owned(), found: found.to_owned(), expected });
        }
        Ok(Self { path: path.to_owned(), kinds: kinds.to_vec(), text, added: 0 })
    }

    /// Adds a pose and writes the file.
    ///
    /// # Errors
    /// [`PoseFileError::Write`]; the file is then as it was.
    pub fn add(&mut self, row: &SettledRow<'_>) -> Result<(), PoseFileError> {
        if !self.text.ends_with('\n') {
            self.text.push('\n');
        }
        let t_s = format!("{:.6}", row.t_s);
        self.text += &pose_record(row.chuck, row.sphere, &self.kinds, &row.q, row.length_m, &[t_s]);
        self.text.push('\n');
        write_atomically(&self.path, &self.text)?;
        self.added += 1;
        Ok(())
    }

    /// Poses added since the file was opened.
    pub fn added(&self) -> usize {
        self.added
    }
}
