//! The information matrix of a set of lengths.

use ballbar::{Chain, Kinematics, LANES, Lanes, LengthRows, Measurement, NormalEquations, Rows};
use nalgebra::DMatrix;

/// `JᵀJ` of rows of `columns` entries, gathered by the normal equations that a fit solves.
pub(super) fn information(rows: &[&[f64]], columns: usize) -> DMatrix<f64> {
    let mut memory = vec![0.0; NormalEquations::<f64>::memory(columns)];
    let Ok(mut normal) = NormalEquations::new(columns, &mut memory) else { return DMatrix::zeros(columns, columns) };
    let mut lanes: Vec<Lanes<f64>> = vec![[0.0; LANES]; columns];
    let (residual_m, weight) = ([0.0; LANES], [1.0; LANES]);
    for block in rows.chunks(LANES) {
        for (index, column) in lanes.iter_mut().enumerate() {
            *column = std::array::from_fn(|lane| block.get(lane).map_or(0.0, |row| row[index]));
        }
        normal.add(&Rows { columns: &lanes, residual_m: &residual_m, weight: &weight, count: block.len() });
    }
    DMatrix::from_fn(columns, columns, |i, j| normal.entry(i, j).unwrap_or_default())
}

/// `JᵀWJ` of measurements over a subset of a chain's parameters, each column times its scale.
pub(super) fn information_of(
    chain: &Chain<f64>,
    measurements: &[Measurement<f64>],
    subset: &[usize],
    scales: &[f64],
) -> DMatrix<f64> {
    let count = subset.len();
    let mut memory = vec![0.0; NormalEquations::<f64>::memory(count)];
    let Ok(mut normal) = NormalEquations::new(count, &mut memory) else { return DMatrix::zeros(count, count) };
    let kinematics = Kinematics::new(chain);
    let mut swept = LengthRows::default();
    let mut columns: Vec<Lanes<f64>> = vec![[0.0; LANES]; count];
    for block in measurements.chunks(LANES) {
        swept.compute(&kinematics, block);
        for ((column, &index), scale) in columns.iter_mut().zip(subset).zip(scales) {
            *column = swept.chain(index).map(|entry| entry * scale);
        }
        normal.add(&swept.over(&columns));
    }
    DMatrix::from_fn(count, count, |i, j| normal.entry(i, j).unwrap_or_default())
}
