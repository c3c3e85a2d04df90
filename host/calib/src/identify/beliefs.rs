//! Which unknowns a fit may change, and what is believed of them beforehand.

use nalgebra::{DMatrix, DVector};

use super::prior::{ChainPrior, Weighing};
use crate::unknowns::Unknowns;

/// `Λ` over the free unknowns: a change of them costs `changeᵀ Λ change`.
#[derive(Clone, Debug)]
pub(super) struct Beliefs {
    free: Vec<usize>,
    /// Per SI units; `None` where nothing is believed.
    precision: Option<DMatrix<f64>>,
}

impl Beliefs {
    /// Of the unknowns at the indices `free`, ascending, only what other blocks than the chain's say of theirs.
    pub(super) fn without_chain(unknowns: &Unknowns, free: Vec<usize>) -> Self {
        let diagonal: Vec<f64> = free.iter().map(|&index| precision_of(unknowns, index)).collect();
        let precision = diagonal.iter().any(|&entry| entry > 0.0).then(|| DMatrix::from_diagonal(&diagonal.into()));
        Self { free, precision }
    }

    /// The same and what tolerances say of the chain.
    pub(super) fn new(unknowns: &Unknowns, free: Vec<usize>, chain: &ChainPrior, weighing: &Weighing) -> Self {
        let of_chain = free.partition_point(|&index| index < unknowns.of_chain().len());
        let chain = chain.precision(&free[..of_chain], weighing);
        let precision = DMatrix::from_fn(free.len(), free.len(), |row, column| match (row < of_chain, column < of_chain) {
            (true, true) => chain[(row, column)],
            (false, false) if row == column => precision_of(unknowns, free[row]),
            _ => 0.0,
        });
        Self { free, precision: Some(precision) }
    }

    /// Indices of the free unknowns, ascending.
    pub(super) fn free(&self) -> &[usize] {
        &self.free
    }

    /// Of how many of them something is believed.
    pub(super) fn believed(&self) -> usize {
        self.precision.as_ref().map_or(0, |precision| precision.diagonal().iter().filter(|entry| **entry > 0.0).count())
    }

    /// `Λ` with so little said of what nothing is believed of that it decides nothing: for what integrates over all of them.
    pub(super) fn proper_precision(&self, unknowns: &Unknowns) -> DMatrix<f64> {
        const VAGUE: f64 = 100.0;
        let mut precision = self.precision.clone().unwrap_or_else(|| DMatrix::zeros(self.free.len(), self.free.len()));
        for (i, &index) in self.free.iter().enumerate() {
            if precision[(i, i)] == 0.0 {
                precision[(i, i)] = (VAGUE * unknowns.list()[index].plausible).powi(-2);
            }
        }
        precision
    }

    /// How far the free ones have moved.
    pub(super) fn change(&self, values: &[f64], start: &[f64]) -> Vec<f64> {
        self.free.iter().map(|&index| values[index] - start[index]).collect()
    }

    /// `changeᵀ Λ change`.
    pub(super) fn cost(&self, values: &[f64], start: &[f64]) -> f64 {
        let change = DVector::from_vec(self.change(values, start));
        self.precision.as_ref().map_or(0.0, |precision| change.dot(&(precision * &change)))
    }

    /// The packed lower triangle of `σ² Λ`, by rows.
    pub(super) fn packed(&self, sigma_m: f64) -> Option<Vec<f64>> {
        let precision = self.precision.as_ref()?;
        let variance = sigma_m * sigma_m;
        Some((0..precision.nrows()).flat_map(|i| (0..=i).map(move |j| variance * precision[(i, j)])).collect())
    }

    /// `B` with `BᵀB = Λ`: a row a belief, a column a free unknown. None where nothing is believed.
    pub(super) fn rows(&self) -> DMatrix<f64> {
        let Some(precision) = self.precision.as_ref().filter(|precision| !precision.is_empty()) else {
            return DMatrix::zeros(0, self.free.len());
        };
        // Scaled, so that metres and radians do not matter; negative values are rounding.
        let scales = precision.diagonal().map(|entry| if entry > 0.0 { entry.sqrt() } else { 1.0 });
        let scaled = DMatrix::from_fn(precision.nrows(), precision.ncols(), |i, j| precision[(i, j)] / (scales[i] * scales[j]));
        let eigen = scaled.symmetric_eigen();
        DMatrix::from_fn(precision.nrows(), precision.ncols(), |row, column| {
            eigen.eigenvalues[row].max(0.0).sqrt() * eigen.eigenvectors[(column, row)] * scales[column]
        })
    }
}

fn precision_of(unknowns: &Unknowns, index: usize) -> f64 {
    unknowns.list()[index].tolerance.map_or(0.0, |tolerance| tolerance.powi(-2))
}
