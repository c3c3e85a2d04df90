//! The Jacobian and residuals of a set of measurements at one set of parameters.

use ballbar::{Chain, Kinematics, MAX_PARAMETERS, Measurement};
use nalgebra::{DMatrix, DVector};

/// `√w J` and `√w f` of any number of measurements in at most P + 1 rows: the triangle R of `[J f] = Q R`, which has the norms
/// of all columns and the angles between them. Metres per SI unit, and metres.
#[derive(Clone, Debug)]
pub struct Observation {
    /// At most P + 1 rows, one column for each of the P parameters of the chain.
    pub jacobian: DMatrix<f64>,
    /// Residuals, measured less computed, seen from the rows of `jacobian`.
    pub residual_m: DVector<f64>,
}

/// Measurements that are evaluated before they are reduced: bounds the memory whatever their number.
const BLOCK: usize = 1024;

impl Observation {
    /// Evaluates all measurements.
    pub fn new(chain: &Chain<f64>, measurements: &[Measurement<f64>]) -> Self {
        let columns = chain.parameter_count();
        let kinematics = Kinematics::new(chain);
        let mut triangle = DMatrix::zeros(0, columns + 1);
        for block in measurements.chunks(BLOCK) {
            let above = triangle.nrows();
            triangle = triangle.resize_vertically(above + block.len(), 0.0);
            let mut row = [0.0; MAX_PARAMETERS];
            for (i, measurement) in block.iter().enumerate() {
                let root_weight = measurement.weight.sqrt();
                let residual_m = kinematics.residual_row(measurement, &mut row);
                for (entry, value) in triangle.row_mut(above + i).iter_mut().zip(row[..columns].iter().chain([&residual_m])) {
                    *entry = root_weight * value;
                }
            }
            if triangle.nrows() > triangle.ncols() {
                triangle = triangle.qr().r();
            }
        }
        let residual_m = triangle.column(columns).into_owned();
        Self { jacobian: triangle.remove_column(columns), residual_m }
    }

    /// Only the given columns.
    pub fn columns(&self, indices: &[usize]) -> DMatrix<f64> {
        self.jacobian.select_columns(indices)
    }
}
