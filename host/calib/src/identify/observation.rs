//! The Jacobian and residuals of a set of measurements at one set of values.

use ballbar::{Chain, Kinematics, LANES, Lanes, LengthRows, Measurement, Rows};
use nalgebra::{DMatrix, DVector, RowDVector};

use super::beliefs::Beliefs;
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
    /// Measurements.
    pub count: usize,
    /// `Σ w f²` of the measurements alone, square metres.
    pub square_m2: f64,
    /// The rows of `√w J` that are beliefs, as they are before they are reduced: one column for each of the P unknowns.
    pub beliefs: DMatrix<f64>,
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

    /// Evaluates rows over all unknowns, at these values, and beside lengths that deviate by `sigma_m` (metres, of weight one) what is believed
    /// of some of them.
    pub(super) fn of(unknowns: &Unknowns, values: &[f64], rows: &[&PoseRow], believed: Option<(&Beliefs, f64)>) -> Self {
        let all: Vec<usize> = (0..unknowns.list().len()).collect();
        let mut reduction = Reduction::new(all.len());
        unknowns.for_each_block(values, rows, &all, |rows| reduction.add(rows));
        if let Some((beliefs, sigma_m)) = believed {
            let change = beliefs.change(values, &unknowns.start());
            for row in (beliefs.rows() * sigma_m).row_iter() {
                let residual_m = -row.iter().zip(&change).map(|(entry, by)| entry * by).sum::<f64>();
                reduction.add_belief(beliefs.free(), row.iter().copied(), residual_m);
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
    square_m2: f64,
    beliefs: Vec<RowDVector<f64>>,
}

impl Reduction {
    /// Rows that are kept before they are reduced: bounds the memory whatever their number.
    const KEPT: usize = 1024;

    fn new(unknowns: usize) -> Self {
        Self {
            triangle: DMatrix::zeros(Self::KEPT + unknowns + 1, unknowns + 1),
            filled: 0,
            count: 0,
            square_m2: 0.0,
            beliefs: Vec::new(),
        }
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
        let squares = rows.residual_m.iter().zip(rows.weight).map(|(f, weight)| weight * f * f);
        self.square_m2 += squares.take(rows.count).sum::<f64>();
    }

    fn add_belief(&mut self, unknowns: &[usize], entries: impl Iterator<Item = f64>, residual_m: f64) {
        self.make_room(1);
        let residual = self.triangle.ncols() - 1;
        let mut row = RowDVector::zeros(residual);
        unknowns.iter().zip(entries).for_each(|(&index, entry)| row[index] = entry);
        self.triangle.view_mut((self.filled, 0), (1, residual)).copy_from(&row);
        self.triangle[(self.filled, residual)] = residual_m;
        self.filled += 1;
        self.beliefs.push(row);
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
        let beliefs = if self.beliefs.is_empty() { DMatrix::zeros(0, last) } else { DMatrix::from_rows(&self.beliefs) };
        let Self { count, square_m2, .. } = self;
        Observation { jacobian: triangle.remove_column(last), residual_m, count, square_m2, beliefs }
    }
}
