//! The information matrix of a set of lengths.

use ballbar::{FreeParameters, MAX_PARAMETERS, NormalEquations};
use nalgebra::DMatrix;

/// `JᵀJ` of rows of `columns` entries, gathered by the normal equations that a fit solves.
pub(super) fn information<'a>(rows: impl IntoIterator<Item = &'a [f64]>, columns: usize) -> DMatrix<f64> {
    let mut normal = Box::new(NormalEquations::new(FreeParameters::all(columns)));
    let mut whole = [0.0; MAX_PARAMETERS];
    for row in rows {
        whole[..columns].copy_from_slice(&row[..columns]);
        normal.add(&whole, 0.0, 1.0);
    }
    DMatrix::from_fn(columns, columns, |i, j| normal.entry(i, j).unwrap_or_default())
}
