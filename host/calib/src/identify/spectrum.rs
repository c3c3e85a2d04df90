//! Singular values of a Jacobian with scaled columns, and the rank that its gap shows.

use nalgebra::DMatrix;

/// Singular values below this fraction of the largest count as zero. Of scaled columns in `f64`, the null ones stand at 1e-15
/// and the smallest real ones of sound data at 1e-2, so that anything between 1e-13 and 1e-5 decides alike; the values are shown.
pub const RANK_THRESHOLD: f64 = 1e-10;

/// A column smaller than this fraction of the largest is zero up to rounding. It must not be scaled by its own norm, which
/// would make rounding a direction of its own.
const ZERO_COLUMN: f64 = 1e-12;

/// Singular value decomposition of a Jacobian whose columns were scaled to unit norm.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Spectrum {
    /// Descending; k, as many as there are columns.
    pub singular_values: Vec<f64>,
    /// How many are above [`RANK_THRESHOLD`] times the largest.
    pub rank: usize,
    /// The divisor of each column.
    pub scales: Vec<f64>,
    /// Right singular vectors, k × k, a column each, in the order of the values.
    pub right: DMatrix<f64>,
}

impl Spectrum {
    /// Decomposes a Jacobian (n × k).
    pub fn new(jacobian: &DMatrix<f64>) -> Self {
        let all: Vec<usize> = (0..jacobian.ncols()).collect();
        Self::of_columns(jacobian, &all)
    }

    /// Decomposes some columns of a Jacobian. Which are zero up to rounding is judged beside all of them.
    pub fn of_columns(jacobian: &DMatrix<f64>, indices: &[usize]) -> Self {
        let all_scales = column_scales(jacobian);
        Self::scaled(&jacobian.select_columns(indices), indices.iter().map(|&index| all_scales[index]).collect())
    }

    fn scaled(jacobian: &DMatrix<f64>, scales: Vec<f64>) -> Self {
        let columns = jacobian.ncols();
        if columns == 0 || jacobian.iter().any(|entry| !entry.is_finite()) {
            // Nothing to decompose, or nothing that can be: no direction counts.
            let right = DMatrix::identity(columns, columns);
            return Self { singular_values: vec![0.0; columns], rank: 0, scales: vec![1.0; columns], right };
        }
        let mut scaled = jacobian.clone();
        for (mut column, scale) in scaled.column_iter_mut().zip(&scales) {
            column /= *scale;
        }
        // Rows of zeros change nothing and give the decomposition as many values as there are columns.
        let rows = scaled.nrows().max(columns);
        let triangle = scaled.resize_vertically(rows, 0.0).qr().r();
        let svd = triangle.svd(false, true);

        let mut order: Vec<usize> = (0..columns).collect();
        order.sort_by(|&a, &b| svd.singular_values[b].total_cmp(&svd.singular_values[a]));
        let singular_values: Vec<f64> = order.iter().map(|&i| svd.singular_values[i]).collect();
        let right = match svd.v_t {
            Some(v_t) => DMatrix::from_fn(columns, columns, |row, k| v_t[(order[k], row)]),
            None => DMatrix::identity(columns, columns),
        };
        let largest = singular_values.first().copied().unwrap_or(0.0);
        // Among columns of unit norm the largest value is 1 or more; below it, all columns are rounding.
        let rank = singular_values.iter().filter(|&&value| value > RANK_THRESHOLD * largest.max(1.0)).count();
        Self { singular_values, rank, scales, right }
    }

    /// The last singular value that counts and the first that does not; `None` where one of them is not there.
    pub fn gap(&self) -> Option<(f64, f64)> {
        let last = *self.singular_values.get(self.rank.checked_sub(1)?)?;
        Some((last, *self.singular_values.get(self.rank)?))
    }

    /// Largest over smallest singular value: the condition number of the scaled columns. Infinite when the rank is not full.
    pub fn condition(&self) -> f64 {
        match (self.singular_values.first(), self.singular_values.last()) {
            (Some(largest), Some(smallest)) if self.rank == self.singular_values.len() => largest / smallest,
            _ => f64::INFINITY,
        }
    }
}

/// Euclidean norms of the columns, or the largest norm for a column that is zero up to rounding.
pub(super) fn column_scales(jacobian: &DMatrix<f64>) -> Vec<f64> {
    let norms: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    let largest = norms.iter().copied().fold(0.0, f64::max);
    let unit = if largest > 0.0 { largest } else { 1.0 };
    norms.iter().map(|&norm| if norm > ZERO_COLUMN * largest { norm } else { unit }).collect()
}

/// Whether a column's norm is zero up to rounding beside the largest column's.
pub(super) fn is_zero_column(norm: f64, largest: f64) -> bool {
    norm <= ZERO_COLUMN * largest
}
