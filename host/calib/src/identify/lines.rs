//! Rows one by one, scaled to weight one.

use nalgebra::{DMatrix, DVector};

use crate::model::PoseRow;
use crate::unknowns::Unknowns;

/// `√w J` over the wanted unknowns and `√w f` at some values, a line a row.
pub(super) fn lines(unknowns: &Unknowns, values: &[f64], rows: &[&PoseRow], wanted: &[usize]) -> (DMatrix<f64>, DVector<f64>) {
    let mut jacobian = DMatrix::zeros(rows.len(), wanted.len());
    let mut residual_m = DVector::zeros(rows.len());
    let mut first = 0;
    unknowns.for_each_block(values, rows, wanted, |block| {
        for lane in 0..block.count {
            let root_weight = block.weight[lane].sqrt();
            let line = first + lane;
            residual_m[line] = root_weight * block.residual_m[lane];
            (0..wanted.len()).for_each(|k| jacobian[(line, k)] = root_weight * block.columns[k][lane]);
        }
        first += block.count;
    });
    (jacobian, residual_m)
}
