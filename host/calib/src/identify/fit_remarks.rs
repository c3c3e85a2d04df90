//! What about a fit's residuals weighs on all of its numbers.

use super::fit::Fit;
use super::residuals::ALIKE;
use super::robust::WrongRow;

/// Something to know before a fit's numbers are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FitRemark {
    /// Rows contradict the others, and were left out.
    LeftOut {
        /// How many.
        count: usize,
        /// Index of the worst, from 0.
        worst_row: usize,
        /// What it is off by, metres.
        worst_m: f64,
    },
    /// Rows stand out, and weigh on everything.
    Outliers {
        /// How many.
        count: usize,
        /// Index of the worst, from 0.
        worst_row: usize,
        /// Its residual, metres.
        worst_m: f64,
    },
    /// Residuals follow one another in the order of measurement: something drifts or jumps that the model does not hold, and standard
    /// deviations are too small.
    Drift {
        /// Of each residual with the next one.
        correlation: f64,
    },
}

impl Fit {
    /// What to know before the numbers are read; nothing where residuals look like noise.
    pub fn remarks(&self) -> Vec<FitRemark> {
        let size = |wrong: &&WrongRow| wrong.residual_m.abs();
        let worst = self.wrong_rows.iter().max_by(|a, b| size(a).total_cmp(&size(b)));
        let left_out = worst.map(|worst| FitRemark::LeftOut {
            count: self.wrong_rows.len(),
            worst_row: worst.row,
            worst_m: worst.residual_m,
        });
        let outliers = self.outliers.first().map(|worst| FitRemark::Outliers {
            count: self.outliers.len(),
            worst_row: worst.row,
            worst_m: self.residuals[worst.row].value_m,
        });
        let is_alike = |correlation: &f64| *correlation > ALIKE;
        let drift = self.neighbour_correlation.filter(is_alike).map(|correlation| FitRemark::Drift { correlation });
        left_out.into_iter().chain(outliers).chain(drift).collect()
    }
}
