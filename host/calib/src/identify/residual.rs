//! Residuals as numbers.

use ballbar::Kinematics;

use crate::model::PoseRow;
use crate::unknowns::Unknowns;

/// A residual `f = d_measured − d_computed` and its weight, 1 on average.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Residual {
    /// Metres.
    pub value_m: f64,
    /// Weight of its square.
    pub weight: f64,
}

impl Residual {
    /// Of some rows, at these values of all unknowns.
    pub(super) fn of_rows<'a>(unknowns: &Unknowns, values: &[f64], rows: impl Iterator<Item = &'a PoseRow>) -> Vec<Self> {
        let kinematics = Kinematics::new(&unknowns.chain(values));
        let of = |row: &PoseRow| {
            let measurement = unknowns.corrected(values, row);
            Self { value_m: kinematics.residual(&measurement), weight: measurement.weight }
        };
        rows.map(of).collect()
    }

    /// `√w f`: all of these scatter alike, metres.
    pub fn whitened_m(self) -> f64 {
        self.weight.sqrt() * self.value_m
    }
}

/// Size of a set of residuals, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ResidualSummary {
    /// How many.
    pub count: usize,
    /// Root of the mean square.
    pub rms_m: f64,
    /// Mean.
    pub mean_m: f64,
    /// Largest size.
    pub max_abs_m: f64,
}

impl ResidualSummary {
    /// Summarises those residuals that have a weight; RMS and mean are weighted (all weights alike: the plain ones), and not a number where
    /// there are none.
    pub fn new(residuals: &[Residual]) -> Self {
        let weight: f64 = residuals.iter().map(|f| f.weight).sum();
        Self {
            count: residuals.iter().filter(|f| f.weight > 0.0).count(),
            rms_m: (residuals.iter().map(|f| f.weight * f.value_m * f.value_m).sum::<f64>() / weight).sqrt(),
            mean_m: residuals.iter().map(|f| f.weight * f.value_m).sum::<f64>() / weight,
            max_abs_m: residuals.iter().filter(|f| f.weight > 0.0).fold(0.0, |largest, f| largest.max(f.value_m.abs())),
        }
    }
}

/// Median; 0 of none.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => 0.0,
        n if n % 2 == 1 => values[n / 2],
        n => (values[n / 2 - 1] + values[n / 2]) / 2.0,
    }
}
