//! What some lengths already tell, and what one more would add.

use nalgebra::{DMatrix, DVector};

/// Covariance of all parameters in units of their plausible deviation, given lengths so far; the identity before the first, since
/// a design is worth what it plausibly is.
#[derive(Clone, Debug)]
pub(super) struct Experience {
    covariance: DMatrix<f64>,
}

/// Usual noise of a length, metres: of the paper's order (0.084 mm). Only its ratio to plausible deviations matters.
pub(super) const NOISE_M: f64 = 1e-4;

impl Experience {
    pub(super) fn new(parameters: usize) -> Self {
        Self { covariance: DMatrix::identity(parameters, parameters) }
    }

    /// Variance of a length not yet measured, in units of the noise's: by `ln(1 + this)` its measurement raises the logarithm of the
    /// information's determinant. `row` is its gradient times plausible deviations, metres.
    pub(super) fn novelty(&self, row: &[f64]) -> f64 {
        let row = DVector::from_column_slice(&row[..self.covariance.ncols()]) / NOISE_M;
        row.dot(&(&self.covariance * &row))
    }

    /// Takes a length into account (Sherman and Morrison).
    pub(super) fn add(&mut self, row: &[f64]) {
        let row = DVector::from_column_slice(&row[..self.covariance.ncols()]) / NOISE_M;
        let gain = &self.covariance * &row;
        let variance = 1.0 + row.dot(&gain);
        self.covariance.ger(-1.0 / variance, &gain, &gain, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_is_no_news() {
        let mut experience = Experience::new(2);
        let (a, b) = ([1e-3, 0.0], [0.0, 1e-3]);
        assert!((experience.novelty(&a) - 100.0).abs() < 1e-9);
        experience.add(&a);
        assert!((experience.novelty(&a) - 100.0 / 101.0).abs() < 1e-9);
        assert!((experience.novelty(&b) - 100.0).abs() < 1e-9);
    }
}
