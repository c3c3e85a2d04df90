//! Poses kept apart from a fit, to judge it by.

use thiserror::Error;

use super::dataset::{Dataset, PoseRow};
use super::rig::{PairingId, Rig};

/// What a row is held out by.
#[derive(Clone, Debug, PartialEq)]
pub enum Condition {
    /// It was measured with a bar of this length at mid travel, metres.
    Bar(f64),
    /// The bar joined these ends.
    Pairing(PairingId),
    /// It belongs to the part of this name.
    Set(String),
}

/// Rows kept apart, and the others, neither of them empty; each weighed by itself.
#[derive(Clone, Debug)]
pub struct HeldOut {
    /// Rows that meet a condition.
    pub apart: Dataset,
    /// The others.
    pub others: Dataset,
}

/// Why rows cannot be kept apart, and what there is to choose from.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum HoldOutError {
    /// No row meets a condition.
    #[error("no pose is to be held out")]
    Nothing(Choice),
    /// All rows do.
    #[error("every pose is to be held out, and none is left")]
    Everything(Choice),
}

/// By what rows could be held out. In no order; what several rows have stands there as often.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Choice {
    /// Lengths of the bars at mid travel, metres.
    pub bars_m: Vec<f64>,
    /// Pairings.
    pub pairings: Vec<PairingId>,
    /// Names of parts.
    pub sets: Vec<String>,
}

impl Condition {
    fn is_met(&self, row: &PoseRow, rig: &Rig) -> bool {
        /// Lengths of bars are whole millimetres.
        const SAME_M: f64 = 1e-6;
        match self {
            Self::Bar(wanted_m) => row.bar_with(rig).is_some_and(|bar_m| (bar_m - wanted_m).abs() < SAME_M),
            Self::Pairing(pairing) => row.pairing == *pairing,
            Self::Set(set) => row.set.as_ref() == Some(set),
        }
    }
}

impl Dataset {
    /// Keeps the rows apart that meet one of the conditions.
    ///
    /// # Errors
    /// [`HoldOutError`] when that leaves one side empty.
    pub fn hold_out(self, rig: &Rig, conditions: &[Condition]) -> Result<HeldOut, HoldOutError> {
        let choice = Choice {
            bars_m: self.rows.iter().filter_map(|row| row.bar_with(rig)).collect(),
            pairings: self.pairings(),
            sets: self.rows.iter().filter_map(|row| row.set.clone()).collect(),
        };
        let (apart, others) = self.split(|row| conditions.iter().any(|condition| condition.is_met(row, rig)));
        match (apart.rows.is_empty(), others.rows.is_empty()) {
            (true, _) => Err(HoldOutError::Nothing(choice)),
            (false, true) => Err(HoldOutError::Everything(choice)),
            (false, false) => Ok(HeldOut { apart, others }),
        }
    }
}

impl PoseRow {
    /// Length at mid travel of the bar that the row was measured with, metres: as it says itself, or the one of the rig within whose travel
    /// its length lies.
    fn bar_with(&self, rig: &Rig) -> Option<f64> {
        let by_length = || {
            let bar = rig.bar.as_ref()?;
            let off = |mid_m: f64| (self.measurement.length_m - mid_m).abs();
            let nearest = bar.lengths_m.iter().copied().min_by(|&a, &b| off(a).total_cmp(&off(b)))?;
            (off(nearest) <= bar.travel_m / 2.0).then_some(nearest)
        };
        self.bar_m.or_else(by_length)
    }
}
