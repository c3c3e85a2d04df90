//! What becomes longer or shorter while one measures: a bar that warms up, a zero that creeps.

use ballbar::{Lanes, LengthRows, Measurement, ParameterUnit};

use super::chain::plausible_error;
use super::{Block, Unknown, UnknownError};
use crate::model::{Dataset, PoseRow};

/// By how much more the last length is too long than the first: length `d` at `u` is too long by `drift · u`, where `u` goes steadily from
/// −½ at the first length to +½ at the last, so that a drift says nothing of the zero in the middle of the measurement.
///
/// It goes with time where all rows have one and these are in order, and else with the numbers of the rows.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Drift {
    pace: Pace,
    first: f64,
    last: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
enum Pace {
    /// By [`PoseRow::t_s`].
    Time,
    /// By [`PoseRow::number`].
    Order,
}

impl Pace {
    fn of(self, row: &PoseRow) -> Option<f64> {
        match self {
            Self::Time => row.t_s,
            Self::Order => Some(row.number as f64),
        }
    }
}

impl Drift {
    /// Of a dataset.
    ///
    /// # Errors
    /// [`UnknownError::NoOrder`] when neither times nor numbers tell the first row from the last.
    pub fn new(dataset: &Dataset) -> Result<Self, UnknownError> {
        let ends = |pace: Pace| {
            let at: Vec<f64> = dataset.rows.iter().map(|row| pace.of(row)).collect::<Option<_>>()?;
            let (first, last) = (*at.first()?, *at.last()?);
            (at.is_sorted() && first < last).then_some(Self { pace, first, last })
        };
        ends(Pace::Time).or_else(|| ends(Pace::Order)).ok_or(UnknownError::NoOrder)
    }

    /// `u`. Rows of another measurement, before or after, are as the first or the last.
    fn at(&self, row: &PoseRow) -> f64 {
        let share = |at: f64| ((at - self.first) / (self.last - self.first) - 0.5).clamp(-0.5, 0.5);
        self.pace.of(row).map_or(0.0, share)
    }
}

impl Block for Drift {
    fn unknowns(&self) -> Vec<Unknown> {
        let unit = ParameterUnit::Metre;
        vec![Unknown { name: "drift".to_owned(), unit, start: 0.0, tolerance: None, plausible: plausible_error(unit) }]
    }

    fn correct(&self, values: &[f64], row: &PoseRow, measurement: &mut Measurement<f64>) {
        measurement.length_m -= values[0] * self.at(row);
    }

    fn columns(&self, _: &[f64], rows: &[&PoseRow], _: &LengthRows<f64>, columns: &mut [Lanes<f64>]) {
        for (lane, row) in rows.iter().enumerate() {
            columns[0][lane] = self.at(row);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{NamedPoint, PairingId, Rig};
    use ballbar::JointVector;

    fn rows(times_s: &[Option<f64>]) -> Dataset {
        let end = |name| vec![NamedPoint::new(name, [0.0; 3])];
        let rig = Rig::new(end("A"), end("1"), None).unwrap();
        let row = |&t_s: &Option<f64>| {
            let row = PoseRow::new(&rig, PairingId { chuck: 0, sphere: 0 }, JointVector::zero(), 0.46).unwrap();
            PoseRow { t_s, ..row }
        };
        Dataset::new("by hand", times_s.iter().map(row).collect()).unwrap()
    }

    fn course(times_s: &[Option<f64>]) -> Vec<f64> {
        let dataset = rows(times_s);
        let drift = Drift::new(&dataset).unwrap();
        dataset.rows.iter().map(|row| drift.at(row)).collect()
    }

    #[test]
    fn it_goes_with_time_where_times_are_known_and_in_order() {
        assert_eq!(course(&[Some(5.0), Some(6.0), Some(9.0)]), [-0.5, -0.25, 0.5]);
        assert_eq!(course(&[Some(5.0), None, Some(9.0)]), [-0.5, 0.0, 0.5], "a time is missing");
        assert_eq!(course(&[Some(5.0), Some(6.0), Some(1.0)]), [-0.5, 0.0, 0.5], "two clocks");
        assert_eq!(course(&[Some(5.0); 3]), [-0.5, 0.0, 0.5], "no clock");
    }

    #[test]
    fn one_row_has_no_drift() {
        assert_eq!(Drift::new(&rows(&[Some(5.0)])).unwrap_err(), UnknownError::NoOrder);
        assert_eq!(Drift::new(&rows(&[])).unwrap_err(), UnknownError::NoOrder);
        let mut unnumbered = rows(&[None, None]);
        unnumbered.rows.iter_mut().for_each(|row| row.number = 0);
        assert_eq!(Drift::new(&unnumbered).unwrap_err(), UnknownError::NoOrder);
    }
}
