//! The Jacobian and residuals of a set of measurements at one set of parameters.

use ballbar::{Chain, Kinematics, MAX_PARAMETERS, Measurement};
use nalgebra::{DMatrix, DVector};

/// `√w J` (n × P, metres per SI unit) and `√w f` (n, metres).
#[derive(Clone, Debug)]
pub struct Observation {
    /// One row a measurement, one column a parameter of the chain, both weighted.
    pub jacobian: DMatrix<f64>,
    /// Weighted residuals, measured less computed.
    pub residual_m: DVector<f64>,
}

impl Observation {
    /// Evaluates all rows.
    pub fn new(chain: &Chain<f64>, measurements: &[Measurement<f64>]) -> Self {
        let kinematics = Kinematics::new(chain);
        let count = chain.parameter_count();
        let mut jacobian = DMatrix::zeros(measurements.len(), count);
        let mut residual_m = DVector::zeros(measurements.len());
        let mut row = [0.0; MAX_PARAMETERS];
        for (i, measurement) in measurements.iter().enumerate() {
            let root_weight = measurement.weight.sqrt();
            residual_m[i] = root_weight * kinematics.residual_row(measurement, &mut row);
            for (entry, &column) in jacobian.row_mut(i).iter_mut().zip(&row) {
                *entry = root_weight * column;
            }
        }
        Self { jacobian, residual_m }
    }

    /// The same observation in at most P + 1 rows: the triangle R of `[J f] = Q R`. All norms and angles between columns stay.
    pub fn compressed(self) -> Self {
        let columns = self.jacobian.ncols();
        let mut augmented = self.jacobian.insert_column(columns, 0.0);
        augmented.set_column(columns, &self.residual_m);
        if augmented.nrows() > augmented.ncols() {
            augmented = augmented.qr().r();
        }
        let residual_m = augmented.column(columns).into_owned();
        Self { jacobian: augmented.remove_column(columns), residual_m }
    }

    /// Only the given columns.
    pub fn columns(&self, indices: &[usize]) -> DMatrix<f64> {
        self.jacobian.select_columns(indices)
    }
}
