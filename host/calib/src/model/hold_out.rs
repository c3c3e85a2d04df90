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
    pub(crate) fn bar_with(&self, rig: &Rig) -> Option<f64> {
        let by_length = || {
            let bar = rig.bar.as_ref()?;
            let off = |mid_m: f64| (self.measurement.length_m - mid_m).abs();
            let nearest = bar.lengths_m.iter().copied().min_by(|&a, &b| off(a).total_cmp(&off(b)))?;
            (off(nearest) <= bar.travel_m / 2.0).then_some(nearest)
        };
        self.bar_m.or_else(by_length)
    }
}

#[cfg(test)]
mod tests {
    use ballbar::{JointVector, Measurement};

    use super::*;
    use crate::model::{Bar, NamedPoint, Solids};

    fn rig() -> Rig {
        let point = |name: &str, x_m| NamedPoint::new(name, [x_m, 0.0, 0.0]);
        Rig {
            chucks: vec![point("A", 0.5), point("B", 0.7)],
            spheres: vec![point("1", 0.1)],
            bar: Some(Bar::new(vec![0.46, 0.61], 0.08)),
            solids: Solids::default(),
        }
    }

    /// Rows by chuck and length; the last one says itself which bar it was measured with, and that it belongs to a part.
    fn dataset(rig: &Rig) -> Dataset {
        let row = |(chuck, length_m)| {
            let pairing = PairingId { chuck, sphere: 0 };
            PoseRow {
                pairing,
                measurement: Measurement::new(rig.pairing(pairing), JointVector::zero(), length_m),
                approach: ballbar::Approach::UNKNOWN,
                sigma_m: None,
                set: None,
                t_s: None,
                bar_m: None,
                motion: None,
                file: 0,
                line: 0,
                number: 0,
            }
        };
        let mut rows: Vec<PoseRow> = [(0, 0.45), (0, 0.62), (1, 0.46), (1, 0.54)].map(row).into();
        rows[3].bar_m = Some(0.61);
        rows[3].set = Some("again".to_owned());
        Dataset::new("numbers", rows).unwrap()
    }

    fn apart(conditions: &[Condition]) -> Vec<usize> {
        let rig = rig();
        let HeldOut { apart, others } = dataset(&rig).hold_out(&rig, conditions).unwrap();
        assert_eq!(apart.rows.len() + others.rows.len(), 4);
        apart.rows.iter().map(|row| row.number).collect()
    }

    #[test]
    fn a_row_that_meets_one_condition_is_kept_apart() {
        assert_eq!(apart(&[Condition::Bar(0.61)]), [2, 4]);
        assert_eq!(apart(&[Condition::Pairing(PairingId { chuck: 0, sphere: 0 })]), [1, 2]);
        assert_eq!(apart(&[Condition::Set("again".to_owned())]), [4]);
        assert_eq!(apart(&[Condition::Bar(0.46), Condition::Set("again".to_owned())]), [1, 3, 4]);
    }

    #[test]
    fn neither_side_may_be_empty_and_what_there_is_to_choose_from_is_said() {
        let rig = rig();
        let of = |conditions: &[Condition]| dataset(&rig).hold_out(&rig, conditions).unwrap_err();
        let HoldOutError::Nothing(choice) = of(&[Condition::Bar(0.3)]) else { panic!("no bar has 0.3 m") };
        assert_eq!((choice.bars_m, choice.sets), (vec![0.46, 0.61, 0.46, 0.61], vec!["again".to_owned()]));
        assert!(matches!(of(&[Condition::Bar(0.46), Condition::Bar(0.61)]), HoldOutError::Everything(_)));
    }

    #[test]
    fn rows_are_shared_that_have_the_same_ends_and_values() {
        let rig = rig();
        let (all, mut moved) = (dataset(&rig), dataset(&rig));
        moved.rows[0].measurement.length_m += 1e-9;
        moved.rows[1].pairing.chuck = 1;
        assert_eq!((all.shared_rows(&all), moved.shared_rows(&all)), (4, 2));
    }
}
