//! Measured lengths, and where the robot stood.

use std::collections::HashSet;
use std::fmt;

use ballbar::{Approach, JointVector, Measurement};
use thiserror::Error;

use super::rig::{PairingId, Rig};
use super::robot::Robot;

/// One measured length, and where the robot stood. [`PoseRow::new`] makes one from numbers.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PoseRow {
    /// Which chuck and sphere the bar joined.
    pub pairing: PairingId,
    /// What was measured, SI units; the weight has mean 1 over the dataset.
    pub measurement: Measurement<f64>,
    /// From which sides the joints came there, where it is known. Backlash depends on it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub approach: Approach,
    /// Standard deviation of the length, metres, where it is known.
    pub sigma_m: Option<f64>,
    /// The part of the measurements that the row belongs to, where they have parts.
    pub set: Option<String>,
    /// Time of the measurement, seconds, where it is known.
    pub t_s: Option<f64>,
    /// Length of the bar at mid travel, metres, where it is known.
    pub bar_m: Option<f64>,
    /// Of an arm that moved, where it is known.
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
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Motion {
    /// How fast it grew, metres per second.
    pub rate_m_s: f64,
    /// By how much the LVDT's signal was late, as far as it was removed from the length already, seconds.
    pub removed_lag_s: f64,
}

/// Why numbers are no measured length.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PoseError {
    /// The rig has no such chuck or sphere.
    #[error("chuck {} and sphere {} (from 0), which the rig does not have", .0.chuck, .0.sphere)]
    NoSuchPairing(PairingId),
    /// A joint value is infinite or not a number.
    #[error("joint {joint} is not at a finite number")]
    NotFinite {
        /// Number of the joint, from 1.
        joint: usize,
    },
    /// The length is not a finite number above zero.
    #[error("a length of {length_m} m, expected a finite number above zero")]
    Length {
        /// What was given, metres.
        length_m: f64,
    },
}

impl PoseRow {
    /// A length `length_m` (metres) that the bar had between a chuck and a sphere of `rig`, with the joints at `q`
    /// ([`ballbar::Chain::joint_vector`]; radians or metres). Nothing else is known of it; what is, is set in its field, such as
    /// [`PoseRow::sigma_m`]. [`Dataset::new`] numbers and weighs it.
    ///
    /// # Errors
    /// [`PoseError`] when the rig has no such pairing, or a number is not finite or out of range.
    pub fn new(rig: &Rig, pairing: PairingId, q: JointVector<f64>, length_m: f64) -> Result<Self, PoseError> {
        if !rig.has(pairing) {
            return Err(PoseError::NoSuchPairing(pairing));
        }
        if let Some(i) = q.as_array().iter().position(|q| !q.is_finite()) {
            return Err(PoseError::NotFinite { joint: i + 1 });
        }
        if !(length_m.is_finite() && length_m > 0.0) {
            return Err(PoseError::Length { length_m });
        }
        let measurement = Measurement::new(rig.pairing(pairing), q, length_m);
        Ok(Self::of(pairing, measurement))
    }

    /// A measurement with nothing else known of it.
    pub(crate) fn of(pairing: PairingId, measurement: Measurement<f64>) -> Self {
        Self {
            pairing,
            measurement,
            approach: Approach::UNKNOWN,
            sigma_m: None,
            set: None,
            t_s: None,
            bar_m: None,
            motion: None,
            file: 0,
            line: 0,
            number: 0,
        }
    }
}

/// Measured poses of one robot with one rig, in the order in which they were measured. [`Dataset::new`] makes one from rows, which it numbers
/// from 1.
///
/// "Files" are wherever rows come from: a name for messages, no more.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "super::stored::DatasetParts"))]
pub struct Dataset {
    /// The rows.
    pub rows: Vec<PoseRow>,
    /// Names of the files, or of whatever else the rows come from.
    pub files: Vec<String>,
}

impl PoseRow {
    /// Equal for rows with the same ends and measured values.
    fn key(&self) -> (PairingId, Vec<u64>) {
        let values = self.measurement.q.as_array().iter().chain([&self.measurement.length_m]);
        (self.pairing, values.map(|value| value.to_bits()).collect())
    }
}

/// Something about a row that may be a mistake but is no reason to refuse it.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
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

/// Some rows have a deviation of their own and others have none, so that they cannot be weighed against one another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("some lengths have a standard deviation, and others have none")]
pub struct MixedSigma;

impl Dataset {
    /// Of rows from one place, `name`: numbered in their order, and weighed by their deviations, where they state these.
    ///
    /// # Errors
    /// [`MixedSigma`] when only some rows have a deviation.
    pub fn new(name: &str, rows: Vec<PoseRow>) -> Result<Self, MixedSigma> {
        let mut dataset = Self::default();
        dataset.append(name, rows)?;
        Ok(dataset)
    }

    /// Appends rows from one place, numbers them, and weighs all rows anew. Rows without a line get their position, from 1.
    ///
    /// # Errors
    /// [`MixedSigma`]; the dataset is then as it was.
    pub fn append(&mut self, name: &str, rows: Vec<PoseRow>) -> Result<(), MixedSigma> {
        let has_sigma = |row: &PoseRow| row.sigma_m.is_some();
        let first = self.rows.first().or(rows.first()).map(has_sigma);
        if rows.iter().any(|row| Some(has_sigma(row)) != first) {
            return Err(MixedSigma);
        }
        let (file, before) = (self.files.len(), self.rows.len());
        self.files.push(name.to_owned());
        self.rows.extend(rows);
        for (i, row) in self.rows[before..].iter_mut().enumerate() {
            (row.file, row.number) = (file, before + i + 1);
            if row.line == 0 {
                row.line = i + 1;
            }
        }
        self.weigh();
        Ok(())
    }

    /// The rows for which `is_apart` holds, and the others; each weighed by itself.
    #[must_use]
    pub fn split(self, is_apart: impl Fn(&PoseRow) -> bool) -> (Self, Self) {
        let (apart, others) = self.rows.into_iter().partition(is_apart);
        let part = |rows| {
            let mut part = Self { rows, files: self.files.clone() };
            part.weigh();
            part
        };
        (part(apart), part(others))
    }

    /// Weights `1/σ²`, scaled to mean 1 so that weighted residuals stay lengths.
    fn weigh(&mut self) {
        let inverse_variance = |row: &PoseRow| row.sigma_m.map_or(1.0, |sigma| 1.0 / (sigma * sigma));
        let mean = self.rows.iter().map(inverse_variance).sum::<f64>() / self.rows.len() as f64;
        for row in &mut self.rows {
            row.measurement.weight = inverse_variance(row) / mean;
        }
    }

    /// The measurements alone.
    pub fn measurements(&self) -> Vec<Measurement<f64>> {
        self.rows.iter().map(|row| row.measurement).collect()
    }

    /// What the rows' deviations say that `√w f` scatter by, the residuals times the root of their weight, metres: the same for all rows. `None`
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

    /// `name:12`, the file's name and the line there, for row index `row`.
    ///
    /// # Panics
    /// When there is no such row, or its file is none of [`Dataset::files`].
    pub fn place(&self, row: usize) -> String {
        format!("{}:{}", self.files[self.rows[row].file], self.rows[row].line)
    }

    /// How many of these rows stand, measured values and all, in another dataset too.
    pub fn shared_rows(&self, other: &Self) -> usize {
        let others: HashSet<_> = other.rows.iter().map(PoseRow::key).collect();
        self.rows.iter().filter(|row| others.contains(&row.key())).count()
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
            if !seen.insert(row.key()) {
                warnings.push((i, RowWarning::Repeated));
            }
        }
        warnings
    }

    /// One sentence for each kind of [`Dataset::warnings`], with the first places that it concerns.
    pub fn warning_sentences(&self, robot: &Robot, rig: &Rig) -> Vec<String> {
        const SHOWN: usize = 5;
        let mut kinds: Vec<(RowWarning, Vec<usize>)> = Vec::new();
        for (row, warning) in self.warnings(robot, rig) {
            match kinds.iter_mut().find(|(kind, _)| *kind == warning) {
                Some((_, rows)) => rows.push(row),
                None => kinds.push((warning, vec![row])),
            }
        }
        let sentence = |(kind, rows): &(RowWarning, Vec<usize>)| {
            let places: Vec<String> = rows.iter().take(SHOWN).map(|&row| self.place(row)).collect();
            let more = if rows.len() > SHOWN { format!(" and {} more", rows.len() - SHOWN) } else { String::new() };
            format!("poses that {kind}: {} of {}, at {}{more}", rows.len(), self.rows.len(), places.join(", "))
        };
        kinds.iter().map(sentence).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::NamedPoint;

    #[test]
    fn a_row_is_a_length_that_the_rig_can_have() {
        let end = |name| vec![NamedPoint::new(name, [0.0; 3])];
        let rig = Rig::new(end("A"), end("1"), None).unwrap();
        let only = PairingId { chuck: 0, sphere: 0 };
        let row = |pairing, q: f64, length_m| {
            let mut at = JointVector::zero();
            at.as_array_mut()[1] = q;
            PoseRow::new(&rig, pairing, at, length_m)
        };
        assert_eq!(row(only, 0.5, 0.46).unwrap().measurement.length_m, 0.46);
        let other = PairingId { chuck: 0, sphere: 1 };
        assert_eq!(row(other, 0.5, 0.46).unwrap_err(), PoseError::NoSuchPairing(other));
        assert_eq!(row(only, f64::NAN, 0.46).unwrap_err(), PoseError::NotFinite { joint: 2 });
        assert_eq!(row(only, 0.5, 0.0).unwrap_err(), PoseError::Length { length_m: 0.0 });
        let rows = vec![row(only, 0.5, 0.46).unwrap(), row(only, 0.6, 0.47).unwrap()];
        assert_eq!(Dataset::new("by hand", rows).unwrap().place(1), "by hand:2");
    }
}
