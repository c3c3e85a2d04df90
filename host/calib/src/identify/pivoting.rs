//! Columns in the order of what each adds to those before it.

use nalgebra::{DMatrix, DVector};

/// The greedy order of a matrix's columns: each next one is the column with the largest part outside the span of the chosen.
///
/// This is the order of a QR factorisation with column pivoting, by modified Gram-Schmidt with a second pass. (nalgebra's own
/// pivots on the largest entry, so that its pivots need not descend; here each pivot is the norm of what the column adds.)
#[derive(Clone, Debug)]
pub(super) struct PivotedColumns {
    /// Indices of the columns, in order.
    pub(super) order: Vec<usize>,
    /// What each adds: the norm of its part outside the span of those before it. Descending.
    pub(super) pivots: Vec<f64>,
    /// An orthonormal basis of the chosen columns.
    pub(super) basis: DMatrix<f64>,
}

impl PivotedColumns {
    /// Orders columns for as long as the next one adds more than `threshold`.
    pub(super) fn new(mut rest: DMatrix<f64>, threshold: f64) -> Self {
        let mut remaining: Vec<usize> = (0..rest.ncols()).collect();
        let (mut order, mut pivots, mut basis) = (Vec::new(), Vec::new(), Vec::<DVector<f64>>::new());
        let size = |rest: &DMatrix<f64>, column: usize| rest.column(column).norm();
        while let Some(&column) = remaining.iter().max_by(|&&a, &&b| size(&rest, a).total_cmp(&size(&rest, b))) {
            let pivot = size(&rest, column);
            if pivot <= threshold || basis.len() == rest.nrows() {
                break;
            }
            let mut direction = rest.column(column) / pivot;
            for other in &basis {
                direction -= other * other.dot(&direction);
            }
            direction.normalize_mut();

            remaining.retain(|&other| other != column);
            for &other in &remaining {
                let share = direction.dot(&rest.column(other));
                rest.column_mut(other).axpy(-share, &direction, 1.0);
            }
            order.push(column);
            pivots.push(pivot);
            basis.push(direction);
        }
        let basis = if basis.is_empty() { DMatrix::zeros(rest.nrows(), 0) } else { DMatrix::from_columns(&basis) };
        Self { order, pivots, basis }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pivot_is_what_the_column_adds() {
        // Columns: (3, 0, 0), (3, 4, 0), their sum, (0, 0, 1).
        let columns = PivotedColumns::new(
            DMatrix::from_row_slice(3, 4, &[3.0, 3.0, 6.0, 0.0, 0.0, 4.0, 4.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
            1e-12,
        );
        assert_eq!(columns.order.len(), 3, "the fourth is dependent");
        assert_eq!(columns.order[0], 2);
        assert!((columns.pivots[0] - 52.0_f64.sqrt()).abs() < 1e-14);
        assert!(columns.pivots.is_sorted_by(|a, b| a >= b));
        let gram = columns.basis.transpose() * &columns.basis;
        assert!((gram - DMatrix::identity(3, 3)).norm() < 1e-14);
    }

    #[test]
    fn no_columns_give_no_order() {
        assert!(PivotedColumns::new(DMatrix::zeros(3, 0), 0.0).order.is_empty());
        assert!(PivotedColumns::new(DMatrix::zeros(3, 2), 0.0).order.is_empty());
    }
}
