//! `poses.csv` of a session, growing pose by pose.

use std::path::{Path, PathBuf};

use ballbar::{JointKind, JointVector};
use miette::Diagnostic;
use thiserror::Error;

use crate::files::{WriteError, pose_header, pose_record, write_atomically};
use crate::units::mm_from_m;

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
    /// Length of the bar at mid travel, metres.
    pub bar_m: f64,
    /// Line of plan.csv that it was measured for.
    pub plan_row: Option<usize>,
}

/// A file of poses that is written whole, by rename, after every change: whatever happens, it is one that can be read.
#[derive(Debug)]
pub struct PoseFile {
    path: PathBuf,
    kinds: Vec<JointKind>,
    header: String,
    lines: Vec<String>,
    added: usize,
}

/// The optional columns that a session's poses have.
const COLUMNS: [&str; 3] = ["t_s", "bar_mm", "plan_row"];

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
        let expected = pose_header(kinds, &COLUMNS);
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => expected.clone() + "\n",
            Err(error) => return Err(PoseFileError::Unreadable { path: path.to_owned(), error }),
        };
        let mut lines = text.lines().map(str::to_owned);
        let found = lines.next().unwrap_or_default();
        if found != expected {
            return Err(PoseFileError::OtherColumns { path: path.to_owned(), found, expected });
        }
        Ok(Self { path: path.to_owned(), kinds: kinds.to_vec(), header: expected, lines: lines.collect(), added: 0 })
    }

    /// Lines of plan.csv that poses were measured for, in the order of the file.
    pub fn plan_rows(&self) -> impl Iterator<Item = usize> + '_ {
        self.lines.iter().filter_map(|line| line.rsplit(',').next()?.trim().parse().ok())
    }

    /// Adds a pose and writes the file.
    ///
    /// # Errors
    /// [`PoseFileError::Write`]; the file is then as it was.
    pub fn add(&mut self, row: &SettledRow<'_>) -> Result<(), PoseFileError> {
        let plan_row = row.plan_row.map_or_else(String::new, |row| row.to_string());
        let optional = [format!("{:.6}", row.t_s), mm_from_m(row.bar_m).to_string(), plan_row];
        self.lines.push(pose_record(row.chuck, row.sphere, &self.kinds, &row.q, row.length_m, &optional));
        self.write()?;
        self.added += 1;
        Ok(())
    }

    /// Takes the latest pose out again and writes the file. Gives the line of plan.csv that it was measured for; `None` when there
    /// was no pose, or one of no plan.
    ///
    /// # Errors
    /// [`PoseFileError::Write`].
    pub fn erase_last(&mut self) -> Result<Option<usize>, PoseFileError> {
        let Some(line) = self.lines.pop() else { return Ok(None) };
        self.write()?;
        self.added = self.added.saturating_sub(1);
        Ok(line.rsplit(',').next().and_then(|field| field.trim().parse().ok()))
    }

    /// Poses added since the file was opened, less those erased.
    pub fn added(&self) -> usize {
        self.added
    }

    fn write(&self) -> Result<(), WriteError> {
        let lines = std::iter::once(&self.header).chain(&self.lines);
        write_atomically(&self.path, &lines.flat_map(|line| [line.as_str(), "\n"]).collect::<String>())
    }
}
