//! `poses.csv` of a session, growing pose by pose.

use std::path::{Path, PathBuf};

use ballbar::{JointKind, JointVector};
use miette::Diagnostic;
use thiserror::Error;

use crate::files::{WriteError, pose_header, pose_record, write_atomically};
use crate::units::{mm_from_m, tidy};

/// A settled pose as it goes into the file.
#[derive(Clone, Debug)]
pub struct SettledRow<'a> {
    /// Name of the chuck.
    pub chuck: &'a str,
    /// Name of the sphere.
    pub sphere: &'a str,
    /// Joint values, radians or metres.
    pub q: JointVector<f64>,
    /// Length of the bar as measured, metres.
    pub length_m: f64,
    /// Time of the middle of the pose by the board's clock, seconds.
    pub t_s: f64,
    /// Length of the bar at mid travel, metres.
    pub bar_m: f64,
    /// How fast the length grew, metres per second, where the arm moved.
    pub rate_m_s: Option<f64>,
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

/// What was taken out again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Erased {
    /// How many poses.
    pub poses: usize,
    /// The line of plan.csv that they were measured for.
    pub plan_row: Option<usize>,
}

/// The optional columns that a session's poses have.
const COLUMNS: [&str; 5] = ["t_s", "bar_mm", "plan_row", "rate_mm_s", "lag_ms"];
/// Where some of them stand, counted from the end of a line.
const PLAN_ROW_FROM_END: usize = 2;

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
        self.lines.iter().filter_map(|line| plan_row(line))
    }

    /// Adds poses and writes the file.
    ///
    /// # Errors
    /// [`PoseFileError::Write`]; the file is then as it was.
    pub fn add<'a>(&mut self, rows: impl IntoIterator<Item = SettledRow<'a>>) -> Result<(), PoseFileError> {
        let before = self.lines.len();
        for row in rows {
            let plan_row = row.plan_row.map_or_else(String::new, |row| row.to_string());
            let rate = row.rate_m_s.map_or_else(String::new, |rate_m_s| format!("{:.6}", mm_from_m(rate_m_s)));
            let lag = row.rate_m_s.map_or_else(String::new, |_| "0".into());
            let optional = [format!("{:.6}", row.t_s), tidy(mm_from_m(row.bar_m)).to_string(), plan_row, rate, lag];
            self.lines.push(pose_record(row.chuck, row.sphere, &self.kinds, &row.q, row.length_m, &optional));
        }
        if let Err(error) = self.write() {
            self.lines.truncate(before);
            return Err(error.into());
        }
        self.added += self.lines.len() - before;
        Ok(())
    }

    /// Takes the latest pose out again, with all others before it of the same line of plan.csv, and writes the file.
    ///
    /// # Errors
    /// [`PoseFileError::Write`].
    pub fn erase_last(&mut self) -> Result<Erased, PoseFileError> {
        let is_pose = |line: &String| !line.trim().is_empty() && !line.starts_with('#');
        let Some(last) = self.lines.iter().rposition(is_pose) else { return Ok(Erased::default()) };
        let of_line = plan_row(&self.lines[last]);
        let is_other = |line: &String| is_pose(line) && plan_row(line) != of_line;
        let first = self.lines[..last].iter().rposition(is_other).map_or(0, |other| other + 1);
        let before = self.lines.len();
        let mut index = 0..;
        self.lines.retain(|line| index.next().is_some_and(|i| i < first) || !is_pose(line));
        self.write()?;
        let poses = before - self.lines.len();
        self.added = self.added.saturating_sub(poses);
        Ok(Erased { poses, plan_row: of_line })
    }

    /// Removes a lag of the LVDT from the lengths of moving arms, instead of what was removed before, and writes the file.
    ///
    /// # Errors
    /// [`PoseFileError::Write`].
    pub fn remove_lag(&mut self, lag_s: f64) -> Result<(), PoseFileError> {
        let length_column = 2 + self.kinds.len();
        for line in &mut self.lines {
            // No name has a comma or a quote.
            let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
            let number = |field: &String| field.trim().parse::<f64>().ok();
            if let [.., rate, removed] = &fields[..]
                && let (Some(rate_mm_s), Some(removed_ms), Some(length_mm)) =
                    (number(rate), number(removed), fields.get(length_column).and_then(number))
            {
                let lag_ms = (lag_s * 1e9).round() / 1e6;
                fields[length_column] = format!("{:.6}", length_mm + (lag_ms - removed_ms) * 1e-3 * rate_mm_s);
                if let Some(removed) = fields.last_mut() {
                    *removed = lag_ms.to_string();
                }
                *line = fields.join(",");
            }
        }
        Ok(self.write()?)
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

fn plan_row(line: &str) -> Option<usize> {
    line.rsplit(',').nth(PLAN_ROW_FROM_END)?.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(plan_row: Option<usize>) -> SettledRow<'static> {
        let q = JointVector::zero();
        SettledRow { chuck: "A", sphere: "1", q, length_m: 0.46, t_s: 1.0, bar_m: 0.46, rate_m_s: Some(0.002), plan_row }
    }

    #[test]
    fn the_poses_of_the_latest_move_are_erased_together_and_others_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("poses.csv");
        let kinds = [JointKind::Revolute];
        let mut file = PoseFile::open(&path, &kinds).unwrap();
        file.add([Some(2), Some(5), Some(5), None].map(row)).unwrap();
        assert_eq!(file.erase_last().unwrap(), Erased { poses: 1, plan_row: None });
        assert_eq!(file.erase_last().unwrap(), Erased { poses: 2, plan_row: Some(5) });
        assert_eq!(file.added(), 1);
        let read_again = PoseFile::open(&path, &kinds).unwrap();
        assert_eq!(read_again.plan_rows().collect::<Vec<_>>(), [2]);
        assert_eq!(file.erase_last().unwrap(), Erased { poses: 1, plan_row: Some(2) });
        assert_eq!(file.erase_last().unwrap(), Erased::default());
    }
}
