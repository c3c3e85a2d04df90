//! What the bar says of a length: its zero, its gain, and how late it says it. Zeros and gain count as known within the tolerances that the
//! rig states of them.

use ballbar::{Lanes, LengthRows, Measurement, ParameterUnit};

use super::chain::plausible_error;
use super::{Block, Kind, Unknown, UnknownError};
use crate::model::{Bar, Dataset, PoseRow, Rig};
use crate::units::mm_from_m;

/// The tolerance of what is known exactly: that is no unknown.
const EXACT: Option<f64> = Some(0.0);

/// Of a bar, believed to be zero.
fn unknown(name: String, unit: ParameterUnit, tolerance: Option<f64>) -> Unknown {
    Unknown { name, unit, start: 0.0, tolerance, plausible: tolerance.unwrap_or(plausible_error(unit)) }
}

/// By how much all lengths are too long, whichever rod is on the bar: the zero of its LVDT.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BarZero {
    tolerance_m: Option<f64>,
}

impl BarZero {
    /// Of the bar that a dataset was measured with: known as well as the length with that of its rods that is known worst.
    ///
    /// # Errors
    /// [`UnknownError::KnownExactly`] when the rig says that it is known exactly.
    pub fn new(rig: &Rig, dataset: &Dataset) -> Result<Self, UnknownError> {
        let of_rods = Rods::new(rig, dataset).zero_tolerances_m(rig);
        let tolerance_m = of_rods.into_iter().flatten().reduce(f64::max);
        if tolerance_m == EXACT { Err(UnknownError::KnownExactly(Kind::BarZero)) } else { Ok(Self { tolerance_m }) }
    }
}

impl Block for BarZero {
    fn unknowns(&self) -> Vec<Unknown> {
        vec![unknown("bar-zero".to_owned(), ParameterUnit::Metre, self.tolerance_m)]
    }

    fn correct(&self, values: &[f64], _: &PoseRow, measurement: &mut Measurement<f64>) {
        measurement.length_m -= values[0];
    }

    fn columns(&self, _: &[f64], rows: &[&PoseRow], _: &LengthRows<f64>, columns: &mut [Lanes<f64>]) {
        columns[0][..rows.len()].fill(1.0);
    }
}

/// By how much lengths are too long, one unknown for each rod.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RodZeros {
    rods: Rods,
    /// One for each rod.
    tolerances_m: Vec<Option<f64>>,
}

impl RodZeros {
    /// Of the rods that a dataset was measured with and that are not known exactly.
    ///
    /// # Errors
    /// [`UnknownError::KnownExactly`] when there is none.
    pub fn new(rig: &Rig, dataset: &Dataset) -> Result<Self, UnknownError> {
        let rods = Rods::new(rig, dataset);
        let tolerances_m = rods.zero_tolerances_m(rig);
        if tolerances_m.iter().all(|tolerance_m| *tolerance_m == EXACT) {
            return Err(UnknownError::KnownExactly(Kind::RodZeros));
        }
        Ok(Self { rods, tolerances_m })
    }

    /// The unknown of a row's rod; none where that rod is known exactly.
    fn of(&self, row: &PoseRow) -> Option<usize> {
        let rod = self.rods.of(row);
        let unknown = self.tolerances_m[..rod].iter().filter(|&&tolerance_m| tolerance_m != EXACT).count();
        (self.tolerances_m[rod] != EXACT).then_some(unknown)
    }
}

impl Block for RodZeros {
    fn unknowns(&self) -> Vec<Unknown> {
        let rods = self.rods.names("rod-zero").into_iter().zip(&self.tolerances_m);
        let uncertain = rods.filter(|&(_, &tolerance_m)| tolerance_m != EXACT);
        uncertain.map(|(name, &tolerance_m)| unknown(name, ParameterUnit::Metre, tolerance_m)).collect()
    }

    fn correct(&self, values: &[f64], row: &PoseRow, measurement: &mut Measurement<f64>) {
        if let Some(index) = self.of(row) {
            measurement.length_m -= values[index];
        }
    }

    fn columns(&self, _: &[f64], rows: &[&PoseRow], _: &LengthRows<f64>, columns: &mut [Lanes<f64>]) {
        for (lane, row) in rows.iter().enumerate() {
            if let Some(index) = self.of(row) {
                columns[index][lane] = 1.0;
            }
        }
    }
}

/// By which part displacements from mid travel are shown too large.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Gain {
    rods: Rods,
    tolerance: Option<f64>,
}

impl Gain {
    /// Of the bar that a dataset was measured with.
    ///
    /// # Errors
    /// [`UnknownError::NoRods`] when nothing says what part of a length is the rod's, [`UnknownError::KnownExactly`] when the rig says that the
    /// gain is known exactly.
    pub fn new(rig: &Rig, dataset: &Dataset) -> Result<Self, UnknownError> {
        let rods = Rods::new(rig, dataset);
        let tolerance = rig.bar.as_ref().and_then(|bar| bar.gain_tolerance);
        match (rods.lengths_m.is_empty(), tolerance) {
            (true, _) => Err(UnknownError::NoRods),
            (false, EXACT) => Err(UnknownError::KnownExactly(Kind::BarGain)),
            (false, _) => Ok(Self { rods, tolerance }),
        }
    }

    fn displacement_m(&self, row: &PoseRow) -> f64 {
        row.measurement.length_m - self.rods.lengths_m[self.rods.of(row)]
    }
}

impl Block for Gain {
    fn unknowns(&self) -> Vec<Unknown> {
        vec![unknown("bar-gain".to_owned(), ParameterUnit::One, self.tolerance)]
    }

    fn correct(&self, values: &[f64], row: &PoseRow, measurement: &mut Measurement<f64>) {
        let shown_m = self.displacement_m(row);
        measurement.length_m += shown_m / (1.0 + values[0]) - shown_m;
    }

    fn columns(&self, values: &[f64], rows: &[&PoseRow], _: &LengthRows<f64>, columns: &mut [Lanes<f64>]) {
        for (lane, row) in rows.iter().enumerate() {
            columns[0][lane] = self.displacement_m(row) / (1.0 + values[0]).powi(2);
        }
    }
}

/// By how much the LVDT's signal comes late: what is measured at `t` is the length of `t − τ`, `d − τ·ḋ` to first order. Lengths that grow and
/// lengths that shrink at the same place tell it from all else. Whatever was removed from lengths before is part of it.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Latency;

impl Latency {
    /// Of a dataset.
    ///
    /// # Errors
    /// [`UnknownError::NoMotion`] when no length changed while it was measured.
    pub fn new(dataset: &Dataset) -> Result<Self, UnknownError> {
        let moves = |row: &PoseRow| row.motion.is_some_and(|motion| motion.rate_m_s != 0.0);
        if dataset.rows.iter().any(moves) { Ok(Self) } else { Err(UnknownError::NoMotion) }
    }
}

impl Block for Latency {
    fn unknowns(&self) -> Vec<Unknown> {
        let unit = ParameterUnit::Second;
        vec![Unknown { name: "latency".to_owned(), unit, start: 0.0, tolerance: None, plausible: plausible_error(unit) }]
    }

    fn correct(&self, values: &[f64], row: &PoseRow, measurement: &mut Measurement<f64>) {
        if let Some(motion) = row.motion {
            measurement.length_m += (values[0] - motion.removed_lag_s) * motion.rate_m_s;
        }
    }

    fn columns(&self, _: &[f64], rows: &[&PoseRow], _: &LengthRows<f64>, columns: &mut [Lanes<f64>]) {
        for (lane, row) in rows.iter().enumerate() {
            columns[0][lane] = row.motion.map_or(0.0, |motion| -motion.rate_m_s);
        }
    }
}

/// The rods that some rows were measured with.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Rods {
    /// Lengths of the bar at mid travel, metres, ascending; none where nothing says.
    lengths_m: Vec<f64>,
}

impl Rods {
    fn new(rig: &Rig, dataset: &Dataset) -> Self {
        let mut lengths_m: Vec<f64> = dataset.rows.iter().filter_map(|row| row.bar_with(rig)).collect();
        lengths_m.sort_by(f64::total_cmp);
        lengths_m.dedup_by(|a, b| (*a - *b).abs() < Bar::SAME_M);
        Self { lengths_m }
    }

    /// How well the rig says that each is known; one answer where no rod is known.
    fn zero_tolerances_m(&self, rig: &Rig) -> Vec<Option<f64>> {
        let of = |length_m: Option<f64>| rig.bar.as_ref().and_then(|bar| bar.zero_tolerance_m(length_m));
        if self.lengths_m.is_empty() {
            vec![of(None)]
        } else {
            self.lengths_m.iter().map(|&length_m| of(Some(length_m))).collect()
        }
    }

    /// The rod of a row: as it says itself, or the one nearest to its length. The only one where none is known.
    fn of(&self, row: &PoseRow) -> usize {
        let mid_m = row.bar_m.unwrap_or(row.measurement.length_m);
        let off = |&a: &usize| (self.lengths_m[a] - mid_m).abs();
        (0..self.lengths_m.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
    }

    /// `stem`, or where there are several `stem 460`: with the rod's length in millimetres.
    fn names(&self, stem: &str) -> Vec<String> {
        match self.lengths_m.as_slice() {
            [] | [_] => vec![stem.to_owned()],
            several => several.iter().map(|&length_m| format!("{stem} {}", mm_from_m(length_m).round())).collect(),
        }
    }
}
