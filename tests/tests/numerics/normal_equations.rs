//! The incremental normal equations and their damped step against dense matrices, over random rows and random free parameters.

use ballbar::{
    DampedSolver, Damping, FreeParameters, FreeParametersError, LANES, Lanes, MAX_PARAMETERS, MemoryTooShort, NormalEquations,
    Precision, SizeMismatch,
};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

const DAMPINGS: [Damping; 2] = [Damping::Identity, Damping::Diagonal];

/// The most unknowns that are drawn: more than a chain has parameters.
const MOST: usize = 90;

/// A row of J, a residual and a weight.
type DrawnRow = (Vec<f64>, f64, f64);

/// Rows over so many unknowns.
#[derive(Clone, Debug)]
struct Rows {
    rows: Vec<DrawnRow>,
    unknowns: usize,
}

impl Rows {
    fn equations_of(&self, rows: std::ops::Range<usize>) -> NormalEquations<'static, f64> {
        let mut equations = empty(self.unknowns);
        self.add_to(rows, &mut equations);
        equations
    }

    fn add_to(&self, rows: std::ops::Range<usize>, equations: &mut NormalEquations<'_, f64>) {
        for block in self.rows[rows].chunks(LANES) {
            let lanes = |value: &dyn Fn(&DrawnRow) -> f64| -> Lanes<f64> {
                std::array::from_fn(|lane| block.get(lane).map_or(0.0, value))
            };
            let columns: Vec<Lanes<f64>> = (0..self.unknowns).map(|k| lanes(&|(row, ..)| row[k])).collect();
            let (residual_m, weight) = (lanes(&|row| row.1), lanes(&|row| row.2));
            equations.add(&ballbar::Rows { columns: &columns, residual_m: &residual_m, weight: &weight, count: block.len() });
        }
    }

    fn equations(&self) -> NormalEquations<'static, f64> {
        self.equations_of(0..self.rows.len())
    }

    /// √w J and √w f.
    fn dense(&self) -> (DMatrix<f64>, DVector<f64>) {
        let entry = |i: usize, k: usize| self.rows[i].2.sqrt() * self.rows[i].0[k];
        let residual = |i: usize, _| self.rows[i].2.sqrt() * self.rows[i].1;
        let count = self.rows.len();
        (DMatrix::from_fn(count, self.unknowns, entry), DVector::from_fn(count, residual))
    }

    fn set_column(&mut self, index: usize, value: impl Fn(&[f64]) -> f64) {
        self.rows.iter_mut().for_each(|(row, ..)| row[index] = value(row));
    }

    fn without(&self, index: usize) -> Self {
        let mut fewer = self.clone();
        fewer.unknowns -= 1;
        for (row, ..) in &mut fewer.rows {
            row.remove(index);
        }
        fewer
    }
}

/// Memory of tests is not given back.
fn empty(unknowns: usize) -> NormalEquations<'static, f64> {
    NormalEquations::new(unknowns, vec![f64::NAN; NormalEquations::<f64>::memory(unknowns)].leak())
        .expect("as long as was asked for")
}

fn solver(unknowns: usize) -> DampedSolver<'static, f64> {
    DampedSolver::new(unknowns, vec![f64::NAN; DampedSolver::<f64>::memory(unknowns)].leak()).expect("as long as was asked for")
}

/// One to 30 rows over at least `fewest` unknowns; columns differ in size as metres, radians and millimetres do.
fn rows(fewest: usize) -> impl Strategy<Value = Rows> {
    (fewest..=MOST).prop_flat_map(|unknowns| {
        let row = (prop::collection::vec(-1.0..1.0, unknowns), -1.0..1.0, 0.1..10.0);
        let sizes = prop::collection::vec(-2.0..2.0_f64, unknowns);
        (prop::collection::vec(row, 1..30), sizes).prop_map(move |(rows, sizes)| {
            let sized = |row: Vec<f64>| row.iter().zip(&sizes).map(|(entry, size)| entry * 10.0_f64.powf(*size)).collect();
            Rows { rows: rows.into_iter().map(|(row, residual_m, weight)| (sized(row), residual_m, weight)).collect(), unknowns }
        })
    })
}

/// `JᵀWJ` whole, beside its own diagonal's square roots, which are the sizes that rounding is judged by.
fn matrix(equations: &NormalEquations<'_, f64>) -> (DMatrix<f64>, Vec<f64>) {
    let n = equations.unknowns();
    let matrix = DMatrix::from_fn(n, n, |i, j| equations.entry(i, j).unwrap());
    let sizes = matrix.diagonal().iter().map(|square| square.sqrt()).collect();
    (matrix, sizes)
}

/// All numbers of two accumulators, within `tolerance` relative to the columns' sizes.
fn assert_same(a: &NormalEquations<'_, f64>, b: &NormalEquations<'_, f64>, tolerance: f64) -> Result<(), TestCaseError> {
    prop_assert_eq!((a.unknowns(), a.rows()), (b.unknowns(), b.rows()));
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
fn lambda_of(equations: &NormalEquations<'_, f64>, damping: Damping, relative: f64) -> f64 {
    match damping {
        Damping::Identity => relative * matrix(equations).0.diagonal().max(),
        Damping::Diagonal => relative,
    }
}

/// The step, and by how much it is expected to lower the cost.
fn step(equations: &NormalEquations<'_, f64>, damping: Damping, relative: f64) -> Option<(Vec<f64>, f64)> {
    let mut solver = solver(equations.unknowns());
    let step = solver.solve(equations, lambda_of(equations, damping, relative), damping).ok()?;
    Some((step.change.to_vec(), step.predicted_reduction))
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
        prop_assert_eq!((equations.rows(), equations.gradient().len()), (rows.rows.len(), rows.unknowns));
        prop_assert_eq!(equations.entry(rows.unknowns, 0), None);
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
        rows.add_to(0..rows.rows.len(), &mut again);
        assert_same(&again, &rows.equations(), 0.0)?;
    }

    #[test]
    fn equations_over_fewer_unknowns_are_not_merged(rows in rows(2), left_out in any::<prop::sample::Index>()) {
        let fewer = rows.without(left_out.index(rows.unknowns));
        for (into, other) in [(&rows, &fewer), (&fewer, &rows)] {
            let mut unchanged = into.equations();
            prop_assert_eq!(unchanged.merge(&other.equations()), Err(SizeMismatch));
            assert_same(&unchanged, &into.equations(), 0.0)?;
        }
    }

    /// A prior is as many rows more, one for each factor of its precision.
    #[test]
    fn a_prior_counts_like_measurements(rows in rows(1), seed in 0..1000_u32) {
        let n = rows.unknowns;
        let number = |i: usize| (f64::from(seed) + i as f64).sin();
        let deviation: Vec<f64> = (0..n).map(number).collect();
        let factors: Vec<f64> = (0..n).map(|i| number(i + n).abs()).collect();
        let full_factor = DMatrix::from_fn(n, n, |i, j| if i < j { 0.0 } else { number(i * n + j) });
        let full = &full_factor * full_factor.transpose();
        let packed: Vec<f64> = (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|at| full[at]).collect();
        let squares: Vec<f64> = factors.iter().map(|factor| factor * factor).collect();
        let diagonal = DMatrix::from_diagonal(&DVector::from_vec(factors));
        for (precision, factor) in [(Precision::Diagonal(&squares), diagonal), (Precision::Full(&packed), full_factor.transpose())] {
            let mut with_prior = rows.equations();
            with_prior.add_prior(&deviation, precision);
            let mut more = rows.clone();
            let residual = -(&factor * DVector::from_column_slice(&deviation));
            more.rows.extend((0..n).map(|i| (factor.row(i).iter().copied().collect(), residual[i], 1.0)));
            let as_rows = more.equations();
            let ((found, sizes), (expected, _)) = (matrix(&with_prior), matrix(&as_rows));
            for (i, size) in sizes.iter().enumerate() {
                let close = (0..n).all(|j| (found[(i, j)] - expected[(i, j)]).abs() <= 1e-12 * size * sizes[j]);
                prop_assert!(close, "line {i}");
                let off = (with_prior.gradient()[i] - as_rows.gradient()[i]).abs();
                prop_assert!(off <= 1e-12 * size * as_rows.cost().sqrt(), "gradient {i}: {off:e}");
            }
            prop_assert!((with_prior.cost() - as_rows.cost()).abs() <= 1e-12 * as_rows.cost());
            prop_assert_eq!((with_prior.rows(), with_prior.rms_m()), (rows.rows.len(), rows.equations().rms_m()));
        }
    }

    #[test]
    fn a_damped_step_solves_the_dense_equations(rows in rows(1), exponent in -6.0..2.0_f64) {
        let (jacobian, residual) = rows.dense();
        let gradient = jacobian.tr_mul(&residual);
        let equations = rows.equations();
        for damping in DAMPINGS {
            let relative = 10.0_f64.powf(exponent);
            let (change, promised) = step(&equations, damping, relative).unwrap();
            let lambda = lambda_of(&equations, damping, relative);
            let mut damped = jacobian.tr_mul(&jacobian);
            for i in 0..rows.unknowns {
                damped[(i, i)] += if damping == Damping::Identity { lambda } else { lambda * damped[(i, i)] };
            }
            let change = DVector::from_vec(change);
            let sizes = damped.diagonal().map(f64::sqrt);
            let off = &damped * &change - &gradient;
            let size = sizes.component_mul(&change).norm() + residual.norm();
            let worst = off.component_div(&sizes).amax() / size;
            prop_assert!(worst <= 1e-13, "{damping:?}, λ {relative:e}: off by {worst:e} of the terms");

            // What the linear model says of the cost there, in full.
            let reduction = residual.norm_squared() - (&residual - &jacobian * &change).norm_squared();
            let difference = (promised - reduction).abs() / residual.norm_squared();
            prop_assert!(difference <= 1e-11, "{damping:?}: {promised} promised, {reduction} by the model");
        }
    }

    /// A column of zeros, or of rounding: 1e-17 of another one. λ as the solver has it at the start and at its smallest.
    #[test]
    fn a_column_that_is_zero_up_to_rounding_moves_nothing(rows in rows(2), at in any::<prop::sample::Index>()) {
        let index = at.index(rows.unknowns);
        let without = rows.without(index);
        let largest = matrix(&without.equations()).1.into_iter().fold(0.0, f64::max);
        let residual = rows.dense().1.norm();
        for (fraction, relative) in [(0.0, 1e-6), (1e-17, 1e-6), (0.0, 1e-12), (1e-17, 1e-12)] {
            let mut vanishing = rows.clone();
            let sign = |row: &[f64]| row[index].signum();
            vanishing.set_column(index, |row| fraction * largest / (rows.rows.len() as f64) * sign(row));
            for damping in DAMPINGS {
                let (mut found, _) = step(&vanishing.equations(), damping, relative).unwrap();
                // In the damped equations the column's own entry is λ (λI) or the largest square (λ·diag).
                let own = if damping == Damping::Identity { relative } else { 1.0 };
                let bound = 10.0 * fraction / own * residual / largest;
                prop_assert!(found[index].abs() <= bound, "{damping:?}: moved by {:e}", found[index]);
                if fraction == 0.0 {
                    found.remove(index);
                    prop_assert_eq!(found, step(&without.equations(), damping, relative).unwrap().0, "it disturbs others");
                }
            }
        }
    }

    #[test]
    fn a_column_twice_is_refused_or_damped_but_never_infinite(rows in rows(2), at in any::<prop::sample::Index>()) {
        let first = at.index(rows.unknowns - 1);
        let second = first + 1;
        let mut doubled = rows.clone();
        doubled.set_column(second, |row| row[first]);
        let equations = doubled.equations();
        for damping in DAMPINGS {
            for relative in [0.0, 1e-300, 1e-18, 1e-14] {
                match solver(rows.unknowns).solve(&equations, lambda_of(&equations, damping, relative), damping) {
                    Ok(step) => prop_assert!(step.change.iter().all(|change| change.is_finite())),
                    Err(error) => prop_assert!(error.unknown < rows.unknowns),
                }
            }
            // Enough damping shares the change between the two.
            let (change, _) = step(&equations, damping, 1e-4).unwrap();
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
fn a_refused_factorisation_names_the_unknown_that_repeats() {
    // Of many sizes, some leave a pivot of rounding that is above zero.
    for size in 1..100 {
        let row = |i: i32| {
            let x = f64::from(i * size).sqrt();
            (vec![1.0, x, x, x * x], 0.1, 1.0)
        };
        let equations = Rows { rows: (0..10).map(row).collect(), unknowns: 4 }.equations();
        for damping in DAMPINGS {
            let refused = solver(4).solve(&equations, 0.0, damping).unwrap_err();
            assert_eq!(refused.unknown, 2, "{refused}");
        }
    }
}

#[test]
fn memory_that_is_too_short_is_refused() {
    let (mut equations, mut solver) = ([0.0_f32; 701], [0.0_f32; 773]);
    let refused = |needed, lent| Some(MemoryTooShort { needed, lent });
    assert_eq!(NormalEquations::new(36, &mut equations).err(), refused(702, 701));
    assert_eq!(DampedSolver::new(36, &mut solver).err(), refused(774, 773));
}
