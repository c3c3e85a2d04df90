//! What lengths of one set have in common: a bar that was zeroed anew, another temperature.

use ballbar::{Lanes, LengthRows, Measurement, ParameterUnit};

use super::chain::plausible_error;
use super::{Block, Unknown, UnknownError};
use crate::model::{Dataset, PoseRow};

/// By how much lengths are too long, one unknown for each set that rows name.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SetOffsets {
    names: Vec<String>,
}

impl SetOffsets {
    /// Of the sets of a dataset.
    ///
    /// # Errors
    /// [`UnknownError::NoSets`] when no row names one.
    pub fn new(dataset: &Dataset) -> Result<Self, UnknownError> {
        let mut names: Vec<String> = dataset.rows.iter().filter_map(|row| row.set.clone()).collect();
        names.sort_unstable();
        names.dedup();
        if names.is_empty() { Err(UnknownError::NoSets) } else { Ok(Self { names }) }
    }

    fn of(&self, row: &PoseRow) -> Option<usize> {
        self.names.binary_search(row.set.as_ref()?).ok()
    }
}

impl Block for SetOffsets {
    fn unknowns(&self) -> Vec<Unknown> {
        let unit = ParameterUnit::Metre;
        let unknown = |name: &String| Unknown {
            name: format!("set {name}"),
            unit,
            start: 0.0,
            tolerance: None,
            plausible: plausible_error(unit),
        };
        self.names.iter().map(unknown).collect()
    }

    fn correct(&self, values: &[f64], row: &PoseRow, measurement: &mut Measurement<f64>) {
        if let Some(set) = self.of(row) {
            measurement.length_m -= values[set];
        }
    }

    fn columns(&self, _: &[f64], rows: &[&PoseRow], _: &LengthRows<f64>, columns: &mut [Lanes<f64>]) {
        for (lane, set) in rows.iter().enumerate().filter_map(|(lane, row)| Some((lane, self.of(row)?))) {
            columns[set][lane] = 1.0;
        }
    }
}
