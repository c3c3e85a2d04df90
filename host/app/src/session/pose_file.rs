//! `poses.csv` of a session, growing pose by pose.

use std::path::Path;

use ballbar::{Approach, JointKind, JointVector};

use super::own_file::{ForeignChange, OwnFile};
use super::pose_file_error::PoseFileError;
use super::pose_lines::{self, APPROACH, COLUMNS, plan_row};
use crate::files::{approach_text, pose_header, pose_record};
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
    /// From which sides the joints came there, where it is known.
    pub approach: Approach,
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

/// A file of poses that is written whole, by rename, after every change: whatever happens, it is one that can be read. What else
/// stands in it, comments among them, stays as it is.
#[derive(Debug)]
pub struct PoseFile {
    file: OwnFile,
    kinds: Vec<JointKind>,
    header: String,
    /// A file that was begun before directions were kept goes on without them.
    has_approach: bool,
    added: usize,
}

/// What was taken out again.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Erased {
    /// Times of the poses by the board's clock, microseconds.
    pub times_us: Vec<u64>,
    /// The line of plan.csv that they were measured for.
    pub plan_row: Option<usize>,
}

impl Erased {
    /// How many poses.
    pub fn poses(&self) -> usize {
        self.times_us.len()
    }
}

impl PoseFile {
    /// Opens a file to add to, or begins one; nothing is written yet.
    ///
    /// # Errors
    /// [`PoseFileError`] when the file is there and is not one of this robot's, whole in every line.
    pub fn open(path: &Path, kinds: &[JointKind]) -> Result<Self, PoseFileError> {
        let file = OwnFile::read(path).map_err(|error| PoseFileError::Unreadable { path: path.to_owned(), error })?;
        let older = pose_header(kinds, &COLUMNS.into_iter().filter(|column| *column != APPROACH).collect::<Vec<_>>());
        let is_older = file.text().is_some_and(|text| pose_lines::header(text) == older);
        let header = if is_older { older } else { pose_header(kinds, &COLUMNS) };
        if let Some(text) = file.text() {
            pose_lines::check(path, text, &header)?;
        }
        Ok(Self { file, kinds: kinds.to_vec(), header, has_approach: !is_older, added: 0 })
    }

    /// Kinds of the robot's joints.
    pub fn kinds(&self) -> &[JointKind] {
        &self.kinds
    }

    /// Lines of plan.csv that poses were measured for, in the order of the file.
    pub fn plan_rows(&self) -> impl Iterator<Item = usize> + '_ {
        pose_lines::rows(self.text()).filter_map(plan_row)
    }

    /// Times of the poses by the board's clock, microseconds, those among them that are commented out.
    pub fn times_us(&self) -> impl Iterator<Item = u64> + '_ {
        pose_lines::times_us(self.text(), &self.header)
    }

    /// Adds poses and writes the file.
    ///
    /// # Errors
    /// [`PoseFileError::Write`], [`PoseFileError::Changed`]; the file is then as it was.
    pub fn add<'a>(&mut self, rows: impl IntoIterator<Item = SettledRow<'a>>) -> Result<(), PoseFileError> {
        self.added += self.append(rows)?;
        Ok(())
    }

    /// As [`PoseFile::add`], poses of earlier runs.
    ///
    /// # Errors
    /// As [`PoseFile::add`].
    pub(super) fn add_earlier<'a>(&mut self, rows: impl IntoIterator<Item = SettledRow<'a>>) -> Result<(), PoseFileError> {
        self.append(rows).map(drop)
    }

    fn append<'a>(&mut self, rows: impl IntoIterator<Item = SettledRow<'a>>) -> Result<usize, PoseFileError> {
        let mut text = self.file.text().map_or_else(|| self.header.clone() + "\n", str::to_owned);
        let mut added = 0;
        for row in rows {
            text += &(self.line(&row) + "\n");
            added += 1;
        }
        self.file.replace(text)?;
        Ok(added)
    }

    fn line(&self, row: &SettledRow<'_>) -> String {
        let plan_row = row.plan_row.map_or_else(String::new, |row| row.to_string());
        let rate = row.rate_m_s.map_or_else(String::new, |rate_m_s| format!("{:.6}", mm_from_m(rate_m_s)));
        let lag = row.rate_m_s.map_or_else(String::new, |_| "0".into());
        let approach = approach_text(row.approach, self.kinds.len());
        let optional = [approach, time_text(row.t_s), tidy(mm_from_m(row.bar_m)).to_string(), plan_row, rate, lag];
        let optional = if self.has_approach { &optional[..] } else { &optional[1..] };
        pose_record(row.chuck, row.sphere, &self.kinds, &row.q, row.length_m, optional)
    }

    /// Takes the latest pose out again, with all others before it of the same line of plan.csv, and writes the file.
    ///
    /// # Errors
    /// [`PoseFileError::Write`], [`PoseFileError::Changed`].
    pub fn erase_last(&mut self) -> Result<Erased, PoseFileError> {
        let rows: Vec<&str> = pose_lines::rows(self.text()).collect();
        let Some(last) = rows.last() else { return Ok(Erased::default()) };
        let of_line = plan_row(last);
        let is_other = |row: &&str| plan_row(row) != of_line;
        let kept = rows.iter().rposition(is_other).map_or(0, |other| other + 1);
        let times_us = rows[kept..].iter().filter_map(|row| pose_lines::time_us(row)).collect();
        let mut row = 0..;
        let is_kept = |line: &&str| !pose_lines::is_row(line) || row.next().is_some_and(|row| row < kept);
        let (head, body) = pose_lines::split_header(self.text());
        let text = head.to_owned() + &body.split_inclusive('\n').filter(is_kept).collect::<String>();
        self.file.replace(text)?;
        let erased = Erased { times_us, plan_row: of_line };
        self.added = self.added.saturating_sub(erased.poses());
        Ok(erased)
    }

    /// Removes a lag of the LVDT from the lengths of moving arms, instead of what was removed before, and writes the file.
    ///
    /// # Errors
    /// [`PoseFileError::Write`], [`PoseFileError::Changed`].
    pub fn remove_lag(&mut self, lag_s: f64) -> Result<(), PoseFileError> {
        let length_column = 2 + self.kinds.len();
        let (head, body) = pose_lines::split_header(self.text());
        let lines = body.split_inclusive('\n').map(|line| {
            let corrected = pose_lines::is_row(line).then(|| without_lag(line.trim_end(), length_column, lag_s)).flatten();
            corrected.map_or_else(|| line.to_owned(), |corrected| corrected + "\n")
        });
        let text = head.to_owned() + &lines.collect::<String>();
        Ok(self.file.replace(text)?)
    }

    /// Poses added since the file was opened, less those erased.
    pub fn added(&self) -> usize {
        self.added
    }

    /// Whether the file is as it was left.
    ///
    /// # Errors
    /// [`PoseFileError::Changed`].
    pub fn check(&self) -> Result<(), PoseFileError> {
        Ok(self.file.check()?)
    }

    /// Times of the poses (microseconds by the board's clock) that somebody else's change has taken out of the file. What is no file of
    /// poses any more tells nothing.
    pub fn taken_out(&self, change: &ForeignChange) -> Vec<u64> {
        let Some(now) = &change.now else { return Vec::new() };
        if pose_lines::check(&change.path, now, &self.header).is_err() {
            return Vec::new();
        }
        let mut left: Vec<u64> = pose_lines::times_us(now, &self.header).collect();
        let is_gone = |t_us: &u64| left.iter().position(|other| other == t_us).map(|at| left.swap_remove(at)).is_none();
        self.times_us().filter(is_gone).collect()
    }

    fn text(&self) -> &str {
        self.file.text().unwrap_or_default()
    }
}

/// A row of a moving arm with another lag removed; `None` for one of an arm that stood.
fn without_lag(row: &str, length_column: usize, lag_s: f64) -> Option<String> {
    // No name has a comma or a quote.
    let mut fields: Vec<String> = row.split(',').map(str::to_owned).collect();
    let number = |field: &String| field.trim().parse::<f64>().ok();
    let [.., rate, removed] = &fields[..] else { return None };
    let (rate_mm_s, removed_ms) = (number(rate)?, number(removed)?);
    let length_mm = fields.get(length_column).and_then(number)?;
    let lag_ms = (lag_s * 1e9).round() / 1e6;
    fields[length_column] = format!("{:.6}", length_mm + (lag_ms - removed_ms) * 1e-3 * rate_mm_s);
    *fields.last_mut()? = lag_ms.to_string();
    Some(fields.join(","))
}

/// A time as the file has it, seconds to the microsecond.
fn time_text(t_s: f64) -> String {
    format!("{t_s:.6}")
}

/// A time as it can be found again in the file, microseconds.
pub(super) fn time_us(t_s: f64) -> u64 {
    pose_lines::us_of_text(&time_text(t_s)).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const KINDS: [JointKind; 1] = [JointKind::Revolute];

    fn row(plan_row: Option<usize>) -> SettledRow<'static> {
        let (q, approach) = (JointVector::zero(), Approach::UNKNOWN);
        SettledRow {
            chuck: "A",
            sphere: "1",
            q,
            approach,
            length_m: 0.46,
            t_s: 1.0,
            bar_m: 0.46,
            rate_m_s: Some(0.002),
            plan_row,
        }
    }

    #[test]
    fn the_poses_of_the_latest_move_are_erased_together_and_others_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("poses.csv");
        let mut file = PoseFile::open(&path, &KINDS).unwrap();
        file.add([Some(2), Some(5), Some(5), None].map(row)).unwrap();
        let erased = |poses: usize, plan_row| Erased { times_us: vec![1_000_000; poses], plan_row };
        assert_eq!(file.erase_last().unwrap(), erased(1, None));
        assert_eq!(file.erase_last().unwrap(), erased(2, Some(5)));
        assert_eq!(file.added(), 1);
        let read_again = PoseFile::open(&path, &KINDS).unwrap();
        assert_eq!(read_again.plan_rows().collect::<Vec<_>>(), [2]);
        assert_eq!(file.erase_last().unwrap(), erased(1, Some(2)));
        assert_eq!(file.erase_last().unwrap(), Erased::default());
    }

    #[test]
    fn what_somebody_wrote_beside_the_poses_stays_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("poses.csv");
        PoseFile::open(&path, &KINDS).unwrap().add([row(Some(2)), row(Some(3))]).unwrap();
        let text = std::fs::read_to_string(&path).unwrap().replacen("\nA", "\r\n# a remark\n\nA", 1);
        std::fs::write(&path, format!("# by Ann\n{text}# A,1,0,460,,2,460,,,\n")).unwrap();
        let before = std::fs::read_to_string(&path).unwrap();
        let mut file = PoseFile::open(&path, &KINDS).unwrap();
        assert_eq!(file.times_us().collect::<Vec<_>>(), [1_000_000, 1_000_000, 2_000_000], "a pose commented out is there");
        file.add([row(Some(4))]).unwrap();
        let more = std::fs::read_to_string(&path).unwrap();
        assert!(more.starts_with(&before) && more.lines().count() == before.lines().count() + 1, "{more}");
        file.erase_last().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), before);
        file.remove_lag(0.004).unwrap();
        let corrected = std::fs::read_to_string(&path).unwrap();
        assert_eq!(
            corrected,
            before
                .replace("460.000000,,1.000000,460,2,2.000000,0", "460.008000,,1.000000,460,2,2.000000,4")
                .replace("460.000000,,1.000000,460,3,2.000000,0", "460.008000,,1.000000,460,3,2.000000,4")
        );
    }

    #[test]
    fn a_change_tells_which_poses_it_took_out() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("poses.csv");
        let mut file = PoseFile::open(&path, &KINDS).unwrap();
        file.add([1.0, 2.0, 3.0].map(|t_s| SettledRow { t_s, ..row(None) })).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let without_second: String =
            text.split_inclusive('\n').enumerate().filter(|(i, _)| *i != 2).map(|(_, line)| line).collect();
        let second_commented: String = text
            .split_inclusive('\n')
            .enumerate()
            .map(|(i, line)| if i == 2 { format!("# {line}") } else { line.into() })
            .collect();
        for (edit, gone) in [(&*without_second, &[2_000_000][..]), (&second_commented, &[]), ("garbage", &[])] {
            std::fs::write(&path, edit).unwrap();
            let Err(PoseFileError::Changed(change)) = file.add([row(None)]) else { panic!("{edit}") };
            assert_eq!(file.taken_out(&change), gone, "{edit}");
        }
    }
}
