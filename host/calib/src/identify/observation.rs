//! The Jacobian and residuals of a set of measurements at one set of values.

use ballbar::{Chain, Kinematics, LANES, Lanes, LengthRows, Measurement, Rows};
use nalgebra::{DMatrix, DVector};

use crate::model::PoseRow;
use crate::unknowns::Unknowns;

/// `√w J` and `√w f` of any number of measurements in at most P + 1 rows: the triangle R of `[J f] = Q R`, which has the norms
/// of all columns and the angles between them. Metres per SI unit, and metres. What is believed beforehand counts as measured.
#[derive(Clone, Debug)]
pub struct Observation {
    /// At most P + 1 rows, one column for each of the P unknowns.
    pub jacobian: DMatrix<f64>,
    /// Residuals, measured less computed, seen from the rows of `jacobian`.
    pub residual_m: DVector<f64>,
    /// Measurements, and beliefs that count as such.
    pub count: usize,
}

impl Observation {
    /// Evaluates lengths over all parameters of a chain.
    pub fn new(chain: &Chain<f64>, measurements: &[Measurement<f64>]) -> Self {
        let mut reduction = Reduction::new(chain.parameter_count());
        let kinematics = Kinematics::new(chain);
        let mut swept = LengthRows::default();
        let mut columns: Vec<Lanes<f64>> = vec![[0.0; LANES]; chain.parameter_count()];
        for block in measurements.chunks(LANES) {
            swept.compute(&kinematics, block);
            columns.iter_mut().enumerate().for_each(|(index, column)| *column = *swept.chain(index));
            reduction.add(&swept.over(&columns));
        }
        reduction.end()
    }

    /// Evaluates rows over all unknowns, at these values, with what is believed of them beside lengths that deviate by `sigma_m` (metres, of
    /// weight one).
    pub fn of(unknowns: &Unknowns, values: &[f64], rows: &[&PoseRow], sigma_m: f64) -> Self {
        let all: Vec<usize> = (0..unknowns.list().len()).collect();
        let mut reduction = Reduction::new(all.len());
        unknowns.for_each_block(values, rows, &all, |rows| reduction.add(rows));
        for (index, (unknown, precision)) in unknowns.list().iter().zip(unknowns.precision(sigma_m)).enumerate() {
            if precision > 0.0 {
                reduction.add_belief(index, precision.sqrt(), values[index] - unknown.start);
            }
        }
        reduction.end()
    }

    /// Only the given columns.
    pub fn columns(&self, indices: &[usize]) -> DMatrix<f64> {
        self.jacobian.select_columns(indices)
    }
}

/// `[J f]`, gathered row by row and reduced to its triangle whenever it has grown long.
struct Reduction {
    triangle: DMatrix<f64>,
    filled: usize,
    count: usize,
}

impl Reduction {
    /// Rows that are kept before they are reduced: bounds the memory whatever their number.
    const KEPT: usize = 1024;

    fn new(unknowns: usize) -> Self {
        Self { triangle: DMatrix::zeros(Self::KEPT + unknowns + 1, unknowns + 1), filled: 0, count: 0 }
    }

    fn add(&mut self, rows: &Rows<'_, f64>) {
        self.make_room(rows.count);
        let root_weight = rows.weight.map(f64::sqrt);
        for (mut column, entries) in self.triangle.column_iter_mut().zip(rows.columns.iter().chain([rows.residual_m])) {
            let mut lanes = column.rows_mut(self.filled, rows.count);
            lanes.iter_mut().zip(entries).zip(&root_weight).for_each(|((entry, value), weight)| *entry = weight * value);
        }
        self.filled += rows.count;
        self.count += rows.count;
    }

    fn add_belief(&mut self, unknown: usize, root_precision: f64, deviation: f64) {
        self.make_room(1);
        self.triangle.row_mut(self.filled).fill(0.0);
        self.triangle[(self.filled, unknown)] = root_precision;
        let residual = self.triangle.ncols() - 1;
        self.triangle[(self.filled, residual)] = -root_precision * deviation;
        self.filled += 1;
        self.count += 1;
    }

    fn make_room(&mut self, rows: usize) {
        if self.filled + rows > self.triangle.nrows() {
            let reduced = self.reduced();
            self.filled = reduced.nrows();
            self.triangle.rows_mut(0, self.filled).copy_from(&reduced);
        }
    }

    fn reduced(&self) -> DMatrix<f64> {
        let rows = self.triangle.rows(0, self.filled).into_owned();
        if rows.nrows() > rows.ncols() { rows.qr().r() } else { rows }
    }

    fn end(self) -> Observation {
        let triangle = self.reduced();
        let last = triangle.ncols() - 1;
        let residual_m = triangle.column(last).into_owned();
        Observation { jacobian: triangle.remove_column(last), residual_m, count: self.count }
    }
}
