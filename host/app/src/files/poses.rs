//! `poses.csv`: measured lengths and where the robot stood. `read_poses.rs` reads one file of them.

use std::collections::HashSet;
use std::fmt;

use ballbar::{JointKind, JointVector, Measurement};

use super::rig::{PairingId, Rig};
use super::robot::Robot;
use crate::units::{ScreenUnit, mm_from_m};

/// One row of a file of poses.
#[derive(Clone, Debug)]
pub struct PoseRow {
    /// Which chuck and sphere the bar joined.
    pub pairing: PairingId,
    /// What was measured, SI units; the weight has mean 1 over the dataset.
    pub measurement: Measurement<f64>,
    /// Standard deviation of the length, metres, where the file gives it.
    pub sigma_m: Option<f64>,
    /// The row's `set`, where the file gives it.
    pub set: Option<String>,
    /// Time of the measurement, seconds, where the file gives it.
    pub t_s: Option<f64>,
    /// Length of the bar at mid travel, metres, where the file gives it.
    pub bar_m: Option<f64>,
    /// Of an arm that moved, where the file gives it.
    pub motion: Option<Motion>,
    /// Index into [`Dataset::files`].
    pub file: usize,
    /// Line in that file, from 1.
    pub line: usize,
    /// Number over all files, from 1, whatever is kept apart of them later.
    pub number: usize,
}

/// How the length changed while it was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// How fast it grew, metres per second.
    pub rate_m_s: f64,
    /// By how much the LVDT's signal was late, as far as it was removed from the length already, seconds.
    pub removed_lag_s: f64,
}

/// Measured poses of one robot with one rig, in the order of their files. Rows are numbered from 1.
#[derive(Clone, Debug, Default)]
pub struct Dataset {
    /// The rows.
    pub rows: Vec<PoseRow>,
    /// Names of the files.
    pub files: Vec<String>,
}

/// Something about a row that may be a mistake but is no reason to refuse it.
#[derive(Clone, Debug, PartialEq)]
pub enum RowWarning {
    /// A joint stood beyond its limits.
    BeyondLimits {
        /// Number of the joint, from 1.
        joint: usize,
    },
    /// No extension of the bar has this length within its travel.
    BeyondTravel,
    /// The same row, measured values and all, stands there before.
    Repeated,
}

impl fmt::Display for RowWarning {
    /// What is said of several such rows: `poses that …`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BeyondLimits { joint } => write!(f, "have joint {joint} beyond its limits"),
            Self::BeyondTravel => f.write_str("have a length beyond the bar's travel"),
            Self::Repeated => f.write_str("repeat an earlier row (and weigh twice)"),
        }
    }
}

impl Dataset {
    /// The measurements alone.
    pub fn measurements(&self) -> Vec<Measurement<f64>> {
        self.rows.iter().map(|row| row.measurement).collect()
    }

    /// The same poses with lengths from which a lag of the LVDT was removed, instead of what was removed before.
    #[must_use]
    pub fn with_lag_removed(&self, lag_s: f64) -> Self {
        let mut corrected = self.clone();
        for row in &mut corrected.rows {
            if let Some(motion) = &mut row.motion {
                row.measurement.length_m += (lag_s - motion.removed_lag_s) * motion.rate_m_s;
                motion.removed_lag_s = lag_s;
            }
        }
        corrected
    }

    /// What `sigma_mm` says that `√w f` scatter by, the residuals times the root of their weight, metres: the same for all rows. `None`
    /// where it is not given.
    pub fn stated_sigma_m(&self) -> Option<f64> {
        let row = self.rows.first()?;
        row.sigma_m.map(|sigma_m| sigma_m * row.measurement.weight.sqrt())
    }

    /// The pairings that occur, in the rig's order.
    pub fn pairings(&self) -> Vec<PairingId> {
        let mut pairings: Vec<_> = self.rows.iter().map(|row| row.pairing).collect();
        pairings.sort_unstable();
        pairings.dedup();
        pairings
    }

    /// Indices of the rows of a pairing, in the order of measurement.
    pub fn rows_of(&self, pairing: PairingId) -> impl Iterator<Item = usize> + '_ {
        (0..self.rows.len()).filter(move |&row| self.rows[row].pairing == pairing)
    }

    /// `poses.csv:12`, for row index `row`.
    pub fn place(&self, row: usize) -> String {
        format!("{}:{}", self.files[self.rows[row].file], self.rows[row].line)
    }

    /// Rows that may be mistakes: beyond joint limits, beyond the bar's travel, or repeated. Row indices from 0.
    pub fn warnings(&self, robot: &Robot, rig: &Rig) -> Vec<(usize, RowWarning)> {
        let mut warnings = Vec::new();
        let mut seen = HashSet::new();
        for (i, row) in self.rows.iter().enumerate() {
            let q = row.measurement.q.as_array();
            for (joint, (limits, &q)) in robot.limits.iter().zip(q).enumerate() {
                if !limits.contain(q) {
                    warnings.push((i, RowWarning::BeyondLimits { joint: joint + 1 }));
                }
            }
            if rig.bar.as_ref().is_some_and(|bar| !bar.reaches(row.measurement.length_m)) {
                warnings.push((i, RowWarning::BeyondTravel));
            }
            let bits: Vec<u64> = q.iter().chain([&row.measurement.length_m]).map(|value| value.to_bits()).collect();
            if !seen.insert((row.pairing, bits)) {
                warnings.push((i, RowWarning::Repeated));
            }
        }
        warnings
    }
}

/// The text of a file of poses; columns as the robot's joints need them.
pub fn write_poses(robot: &Robot, rig: &Rig, rows: &[PoseRow]) -> String {
    let kinds = robot.chain.joint_kinds();
    let has_set = rows.iter().any(|row| row.set.is_some());
    let mut text = pose_header(kinds, if has_set { &["set"] } else { &[] }) + "\n";
    for row in rows {
        let (chuck, sphere) = (&rig.chucks[row.pairing.chuck].name, &rig.spheres[row.pairing.sphere].name);
        let set = has_set.then(|| row.set.clone().unwrap_or_default());
        let Measurement { q, length_m, .. } = &row.measurement;
        text += &(pose_record(chuck, sphere, kinds, q, *length_m, set.as_slice()) + "\n");
    }
    text
}

/// The first line of a file of poses, with optional columns at its end.
pub fn pose_header(kinds: &[JointKind], optional: &[&str]) -> String {
    let joints = kinds.iter().enumerate().map(|(i, &kind)| joint_column(i, kind));
    let columns = ["chuck", "sphere"].map(str::to_owned).into_iter().chain(joints).chain(["length_mm".to_owned()]);
    csv_record(columns.chain(optional.iter().map(|&column| column.to_owned())))
}

/// One line of a file of poses, without its end, with the fields of the optional columns.
pub fn pose_record(
    chuck: &str,
    sphere: &str,
    kinds: &[JointKind],
    q: &JointVector<f64>,
    length_m: f64,
    optional: &[String],
) -> String {
    // Nanometres and nanodegrees: far below any encoder, and short enough to read.
    let joints = kinds.iter().zip(q.as_array()).map(|(&kind, &q)| format!("{:.9}", ScreenUnit::from(kind).from_si(q)));
    let length = format!("{:.6}", mm_from_m(length_m));
    let fields = [chuck, sphere].map(str::to_owned).into_iter().chain(joints).chain([length]);
    csv_record(fields.chain(optional.iter().cloned()))
}

pub(super) fn csv_record(fields: impl Iterator<Item = String>) -> String {
    let mut writer = csv::WriterBuilder::new().terminator(csv::Terminator::Any(b'\n')).from_writer(Vec::new());
    // Writing to memory cannot fail.
    let _ = writer.write_record(fields.collect::<Vec<_>>());
    let text = String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default();
    text.trim_end_matches('\n').to_owned()
}

/// Name of a joint's column: `q1_deg`, `q3_mm`.
pub(super) fn joint_column(index: usize, kind: JointKind) -> String {
    format!("q{}_{}", index + 1, ScreenUnit::from(kind).name())
}
