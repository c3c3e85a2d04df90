//! The incremental normal equations and their damped step against dense matrices, over random rows and random free parameters.

use ballbar::{
    DampedSolver, Damping, FreeParameters, FreeParametersError, FreeSetMismatch, MAX_PARAMETERS, NormalEquations, Row, Step,
};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

const DAMPINGS: [Damping; 2] = [Damping::Identity, Damping::Diagonal];

/// Rows of J over all parameters, residuals and weights, and which parameters are free.
#[derive(Clone, Debug)]
struct Rows {
    rows: Vec<(Row<f64>, f64, f64)>,
    free: Vec<usize>,
}

impl Rows {
    fn equations_of(&self, rows: std::ops::Range<usize>) -> NormalEquations<f64> {
        let mut equations = NormalEquations::new(FreeParameters::from_indices(self.free.iter().copied()).unwrap());
        self.rows[rows].iter().for_each(|(row, residual_m, weight)| equations.add(row, *residual_m, *weight));
        equations
    }

    fn equations(&self) -> NormalEquations<f64> {
        self.equations_of(0..self.rows.len())
    }

    /// √w J over the free columns, and √w f.
    fn dense(&self) -> (DMatrix<f64>, DVector<f64>) {
        let entry = |i: usize, k: usize| self.rows[i].2.sqrt() * self.rows[i].0[self.free[k]];
        let residual = |i: usize, _| self.rows[i].2.sqrt() * self.rows[i].1;
        let count = self.rows.len();
        (DMatrix::from_fn(count, self.free.len(), entry), DVector::from_fn(count, residual))
    }

    fn set_column(&mut self, index: usize, value: impl Fn(&Row<f64>) -> f64) {
        self.rows.iter_mut().for_each(|(row, ..)| row[index] = value(row));
    }
}

/// One to 30 rows over at least `fewest` free parameters; columns differ in size as metres, radians and millimetres do.
fn rows(fewest: usize) -> impl Strategy<Value = Rows> {
    let free = prop::sample::subsequence((0..MAX_PARAMETERS).collect::<Vec<_>>(), fewest..=MAX_PARAMETERS);
    let row = (prop::collection::vec(-1.0..1.0, MAX_PARAMETERS), -1.0..1.0, 0.1..10.0);
    let sizes = prop::collection::vec(-2.0..2.0_f64, MAX_PARAMETERS);
    (prop::collection::vec(row, 1..30), free, sizes).prop_map(|(rows, free, sizes)| {
        let sized = |row: Vec<f64>| std::array::from_fn(|i| row[i] * 10.0_f64.powf(sizes[i]));
        Rows { rows: rows.into_iter().map(|(row, residual_m, weight)| (sized(row), residual_m, weight)).collect(), free }
    })
}

/// `JᵀWJ` whole, beside its own diagonal's square roots, which are the sizes that rounding is judged by.
fn matrix(equations: &NormalEquations<f64>) -> (DMatrix<f64>, Vec<f64>) {
    let n = equations.free().len();
    let matrix = DMatrix::from_fn(n, n, |i, j| equations.entry(i, j).unwrap());
    let sizes = matrix.diagonal().iter().map(|square| square.sqrt()).collect();
    (matrix, sizes)
}

/// All numbers of two accumulators, within `tolerance` relative to the columns' sizes.
fn assert_same(a: &NormalEquations<f64>, b: &NormalEquations<f64>, tolerance: f64) -> Result<(), TestCaseError> {
    prop_assert_eq!((a.free(), a.rows()), (b.free(), b.rows()));
    let ((found, sizes), (expected, _)) = (matrix(a), matrix(b));
    for (i, size) in sizes.iter().enumerate() {
        let close = (0..sizes.len()).all(|j| (found[(i, j)] - expected[(i, j)]).abs() <= tolerance * size * sizes[j]);
        prop_assert!(close, "line {}: {} beside {}", i, found.row(i), expected.row(i));
        prop_assert!((a.gradient()[i] - b.gradient()[i]).abs() <= tolerance * size * a.cost().sqrt(), "gradient {}", i);
    }
    prop_assert!(
        (a.cost() - b.cost()).abs() <= tolerance * a.cost() && (a.weight() - b.weight()).abs() <= tolerance * a.weight()
    );
    Ok(())
}

/// λ in the solver's unit for a λ relative to the largest diagonal entry or, Marquardt's, to each.
fn lambda_of(equations: &NormalEquations<f64>, damping: Damping, relative: f64) -> f64 {
    match damping {
        Damping::Identity => relative * matrix(equations).0.diagonal().max(),
        Damping::Diagonal => relative,
    }
}

fn step(equations: &NormalEquations<f64>, damping: Damping, relative: f64) -> Option<Step<f64>> {
    DampedSolver::default().solve(equations, lambda_of(equations, damping, relative), damping).ok()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn gathered_rows_are_the_dense_weighted_products(rows in rows(0)) {
        let equations = rows.equations();
        let (jacobian, residual) = rows.dense();
        let (found, sizes) = matrix(&equations);
        let expected = jacobian.tr_mul(&jacobian);
        let gradient = jacobian.tr_mul(&residual);
        for (i, size) in sizes.iter().enumerate() {
            for (j, other) in sizes.iter().enumerate() {
                prop_assert!((found[(i, j)] - expected[(i, j)]).abs() <= 1e-13 * size * other, "entry {}, {}", i, j);
            }
            prop_assert!((equations.gradient()[i] - gradient[i]).abs() <= 1e-13 * size * residual.norm(), "gradient {}", i);
        }
        prop_assert!((equations.cost() - residual.norm_squared()).abs() <= 1e-13 * residual.norm_squared());
        let weight: f64 = rows.rows.iter().map(|(.., weight)| weight).sum();
        prop_assert!((equations.weight() - weight).abs() <= 1e-13 * weight);
        prop_assert_eq!((equations.rows(), equations.gradient().len()), (rows.rows.len(), rows.free.len()));
        prop_assert_eq!(equations.entry(rows.free.len(), 0), None);
    }

    #[test]
    fn two_halves_merge_into_the_whole(rows in rows(0), cut in 0.0..1.0) {
        let cut = (cut * rows.rows.len() as f64) as usize;
        let mut merged = rows.equations_of(0..cut);
        prop_assert_eq!(merged.merge(&rows.equations_of(cut..rows.rows.len())), Ok(()));
        assert_same(&merged, &rows.equations(), 1e-13)?;
    }

    #[test]
    fn cleared_equations_are_as_new(rows in rows(0)) {
        let mut again = rows.equations();
        again.clear();
        assert_same(&again, &rows.equations_of(0..0), 0.0)?;
        rows.rows.iter().for_each(|(row, residual_m, weight)| again.add(row, *residual_m, *weight));
        assert_same(&again, &rows.equations(), 0.0)?;
    }

    #[test]
    fn equations_over_other_parameters_are_not_merged(rows in rows(2), left_out in any::<prop::sample::Index>()) {
        let mut fewer = rows.clone();
        fewer.free.remove(left_out.index(rows.free.len()));
        for (into, other) in [(&rows, &fewer), (&fewer, &rows)] {
            let mut unchanged = into.equations();
            prop_assert_eq!(unchanged.merge(&other.equations()), Err(FreeSetMismatch));
            assert_same(&unchanged, &into.equations(), 0.0)?;
        }
    }

    #[test]
    fn a_damped_step_solves_the_dense_equations(rows in rows(1), exponent in -6.0..2.0_f64) {
        let (jacobian, residual) = rows.dense();
        let gradient = jacobian.tr_mul(&residual);
        let equations = rows.equations();
        for damping in DAMPINGS {
            let relative = 10.0_f64.powf(exponent);
            let step = step(&equations, damping, relative).unwrap();
            let held = (0..MAX_PARAMETERS).filter(|index| !rows.free.contains(index));
            prop_assert!(held.map(|index| step.change[index]).all(|change| change == 0.0), "a held parameter moved");

            let lambda = lambda_of(&equations, damping, relative);
            let mut damped = jacobian.tr_mul(&jacobian);
            for i in 0..rows.free.len() {
                damped[(i, i)] += if damping == Damping::Identity { lambda } else { lambda * damped[(i, i)] };
            }
            let change = DVector::from_iterator(rows.free.len(), rows.free.iter().map(|&index| step.change[index]));
            let sizes = damped.diagonal().map(f64::sqrt);
            let off = &damped * &change - &gradient;
            let size = sizes.component_mul(&change).norm() + residual.norm();
            let worst = off.component_div(&sizes).amax() / size;
            prop_assert!(worst <= 1e-13, "{damping:?}, λ {relative:e}: off by {worst:e} of the terms");

            // What the linear model says of the cost there, in full.
            let reduction = residual.norm_squared() - (&residual - &jacobian * &change).norm_squared();
            let difference = (step.predicted_reduction - reduction).abs() / residual.norm_squared();
            prop_assert!(difference <= 1e-11, "{damping:?}: {} promised, {reduction} by the model", step.predicted_reduction);
        }
    }

    /// A column of zeros, or of rounding: 1e-17 of another one. λ as the solver has it at the start and at its smallest.
    #[test]
    fn a_column_that_is_zero_up_to_rounding_moves_nothing(rows in rows(2), at in any::<prop::sample::Index>()) {
        let index = rows.free[at.index(rows.free.len())];
        let mut without = rows.clone();
        without.free.retain(|&free| free != index);
        let largest = matrix(&without.equations()).1.into_iter().fold(0.0, f64::max);
        let residual = rows.dense().1.norm();
        for (fraction, relative) in [(0.0, 1e-6), (1e-17, 1e-6), (0.0, 1e-12), (1e-17, 1e-12)] {
            let mut vanishing = rows.clone();
            let sign = |row: &Row<f64>| row[index].signum();
            vanishing.set_column(index, |row| fraction * largest / (rows.rows.len() as f64) * sign(row));
            for damping in DAMPINGS {
                let found = step(&vanishing.equations(), damping, relative).unwrap().change;
                // In the damped equations the column's own entry is λ (λI) or the largest square (λ·diag).
                let own = if damping == Damping::Identity { relative } else { 1.0 };
                let bound = 10.0 * fraction / own * residual / largest;
                prop_assert!(found[index].abs() <= bound, "{damping:?}: moved by {:e}", found[index]);
                if fraction == 0.0 {
                    prop_assert_eq!(found, step(&without.equations(), damping, relative).unwrap().change, "it disturbs others");
                }
            }
        }
    }

    #[test]
    fn a_column_twice_is_refused_or_damped_but_never_infinite(rows in rows(2), at in any::<prop::sample::Index>()) {
        let pair = at.index(rows.free.len() - 1);
        let (first, second) = (rows.free[pair], rows.free[pair + 1]);
        let mut doubled = rows.clone();
        doubled.set_column(second, |row| row[first]);
        let equations = doubled.equations();
        for damping in DAMPINGS {
            for relative in [0.0, 1e-300, 1e-18, 1e-14] {
                match DampedSolver::default().solve(&equations, lambda_of(&equations, damping, relative), damping) {
                    Ok(step) => prop_assert!(step.change.iter().all(|change| change.is_finite())),
                    Err(error) => prop_assert!(rows.free.contains(&error.parameter_index)),
                }
            }
            // Enough damping shares the change between the two.
            let change = step(&equations, damping, 1e-4).unwrap().change;
            let (a, b) = (change[first], change[second]);
            prop_assert!((a - b).abs() <= 1e-9 * (1.0 + a.abs()), "{damping:?}: {a} and {b}");
        }
    }
}

#[test]
fn free_parameters_ascend_and_exist() {
    let refused = |indices: &[usize]| FreeParameters::from_indices(indices.iter().copied()).err().map(|error| error.index);
    assert_eq!(FreeParameters::from_indices([3, 3]), Err(FreeParametersError { index: 3 }));
    assert_eq!(refused(&[0, 5, 4]), Some(4), "descending");
    assert_eq!(refused(&[0, 5, 0]), Some(0), "again, but not next to itself");
    assert_eq!(refused(&[69, 70]), Some(70), "no chain has it");
    assert_eq!(refused(&[256]), Some(256), "zero if it were cut to eight bits");
    let free = FreeParameters::from_indices([0, 7, 69]).unwrap();
    assert_eq!(free.indices().collect::<Vec<_>>(), [0, 7, 69]);
    assert!(free.contains(7) && !free.contains(8) && free.len() == 3 && !free.is_empty());
    assert_eq!(FreeParameters::from_indices(0..MAX_PARAMETERS), Ok(FreeParameters::all(MAX_PARAMETERS + 1)));
    assert!(FreeParameters::from_indices([]).unwrap().is_empty());
}

#[test]
fn a_refused_factorisation_names_the_parameter_that_repeats() {
    // Of many sizes, some leave a pivot of rounding that is above zero.
    for size in 1..100 {
        let mut equations = NormalEquations::new(FreeParameters::from_indices([4, 9, 20, 33]).unwrap());
        for i in 0..10 {
            let x = f64::from(i * size).sqrt();
            let mut row = [0.0; MAX_PARAMETERS];
            (row[4], row[9], row[20], row[33]) = (1.0, x, x, x * x);
            equations.add(&row, 0.1, 1.0);
        }
        for damping in DAMPINGS {
            let refused = DampedSolver::default().solve(&equations, 0.0, damping).unwrap_err();
            assert_eq!(refused.parameter_index, 20, "{refused}");
            assert!(refused.to_string().contains("beta3"), "{refused}");
        }
    }
}
