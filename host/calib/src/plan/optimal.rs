//! The poses that identify best: a D-optimal subset by exchange (V. V. Fedorov, "Theory of Optimal Experiments", 1972; one pose at a
//! time as R. D. Cook and C. J. Nachtsheim have it, Technometrics 22(3), 1980).

use nalgebra::{DMatrix, DVector};

use super::information::information;

/// Passes over the chosen poses at most; the last ones change little.
const PASSES: usize = 20;

/// Indices, ascending, of `count` rows whose `JᵀJ` has a determinant that no exchange of one row raises. `rows` are over independent
/// columns, scaled alike. Fewer when there are fewer rows. By exchange, after V. V. Fedorov (1972), one row at a time as R. D. Cook and
/// C. J. Nachtsheim have it (Technometrics 22(3), 1980): a local optimum.
pub fn d_optimal(rows: &[Vec<f64>], count: usize) -> Vec<usize> {
    let columns = rows.first().map_or(0, Vec::len);
    let all = DMatrix::from_fn(columns, rows.len(), |column, row| rows[row][column]);
    let mut chosen = greedy(&all, count.min(rows.len()));
    for _ in 0..PASSES {
        if !exchange_pass(rows, &all, &mut chosen) {
            break;
        }
    }
    chosen.sort_unstable();
    chosen
}

/// Row by row the one that raises the determinant most. A little of the identity makes the first steps defined.
fn greedy(all: &DMatrix<f64>, count: usize) -> Vec<usize> {
    const RIDGE: f64 = 1e-6;
    let columns = all.nrows();
    let mean_square = all.norm_squared() / (columns * all.ncols()).max(1) as f64;
    let ridge = if mean_square > 0.0 { RIDGE * mean_square } else { 1.0 };
    let mut inverse = DMatrix::identity(columns, columns) / ridge;
    let mut leverages: Vec<f64> = all.column_iter().map(|row| row.norm_squared() / ridge).collect();
    let mut chosen: Vec<usize> = Vec::with_capacity(count);
    let mut is_chosen = vec![false; all.ncols()];
    while chosen.len() < count {
        let rest = (0..all.ncols()).filter(|&i| !is_chosen[i]);
        let Some(best) = rest.max_by(|&a, &b| leverages[a].total_cmp(&leverages[b])) else { break };
        let row: DVector<f64> = all.column(best).into();
        let gain = &inverse * &row;
        let grown = 1.0 + row.dot(&gain);
        for (leverage, share) in leverages.iter_mut().zip(all.tr_mul(&gain).iter()) {
            *leverage -= share * share / grown;
        }
        inverse.ger(-1.0 / grown, &gain, &gain, 1.0);
        chosen.push(best);
        is_chosen[best] = true;
    }
    chosen
}

/// Tries to exchange each chosen row, the least telling first, for the best of the others; whether any was.
fn exchange_pass(rows: &[Vec<f64>], all: &DMatrix<f64>, chosen: &mut [usize]) -> bool {
    const LEAST_GAIN: f64 = 1e-6;
    let of_chosen: Vec<&[f64]> = chosen.iter().map(|&i| rows[i].as_slice()).collect();
    let told = information(&of_chosen, all.nrows());
    let Some(mut inverse) = told.cholesky().map(|factor| factor.inverse()) else { return false };
    let mut is_chosen = vec![false; all.ncols()];
    chosen.iter().for_each(|&i| is_chosen[i] = true);
    let leverage = |inverse: &DMatrix<f64>, i: usize| all.column(i).dot(&(inverse * all.column(i)));
    let mut leverages: Vec<f64> = (0..all.ncols()).map(|i| leverage(&inverse, i)).collect();
    let mut places: Vec<usize> = (0..chosen.len()).collect();
    places.sort_by(|&a, &b| leverages[chosen[a]].total_cmp(&leverages[chosen[b]]));
    let mut exchanged = false;
    for place in places {
        let out = chosen[place];
        let gain_out = &inverse * all.column(out);
        let shares = all.tr_mul(&gain_out);
        // det after over det before: (1 + d_in)(1 − d_out) + d_in,out².
        let factor = |i: usize| (1.0 + leverages[i]) * (1.0 - leverages[out]) + shares[i] * shares[i];
        let rest = (0..all.ncols()).filter(|&i| !is_chosen[i]);
        let Some(best) = rest.max_by(|&a, &b| factor(a).total_cmp(&factor(b))) else { break };
        if factor(best) < 1.0 + LEAST_GAIN {
            continue;
        }
        update(&mut inverse, &mut leverages, all, best, 1.0);
        update(&mut inverse, &mut leverages, all, out, -1.0);
        (is_chosen[out], is_chosen[best]) = (false, true);
        chosen[place] = best;
        exchanged = true;
    }
    exchanged
}

/// Adds (`sign` 1) or takes away (−1) a row.
fn update(inverse: &mut DMatrix<f64>, leverages: &mut [f64], all: &DMatrix<f64>, row: usize, sign: f64) {
    let gain = &*inverse * all.column(row);
    let grown = 1.0 + sign * all.column(row).dot(&gain);
    for (leverage, share) in leverages.iter_mut().zip(all.tr_mul(&gain).iter()) {
        *leverage -= sign * share * share / grown;
    }
    inverse.ger(-sign / grown, &gain, &gain, 1.0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn determinant(rows: &[Vec<f64>], chosen: &[usize]) -> f64 {
        let matrix = DMatrix::from_fn(chosen.len(), rows[0].len(), |i, j| rows[chosen[i]][j]);
        matrix.tr_mul(&matrix).determinant()
    }

    #[test]
    fn the_ends_of_a_range_tell_a_line_best() {
        // A straight line through measurements at x = 0 … 10: half at either end.
        let rows: Vec<Vec<f64>> = (0..11).flat_map(|x| [vec![1.0, f64::from(x)], vec![1.0, f64::from(x)]]).collect();
        assert_eq!(d_optimal(&rows, 4), [0, 1, 20, 21]);
    }

    #[test]
    fn no_subset_of_a_small_pool_is_much_better() {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let rows: Vec<Vec<f64>> = (0..14).map(|_| (0..3).map(|_| rng.random_range(-1.0..1.0)).collect()).collect();
        let best = (0..1u32 << 14)
            .filter(|bits| bits.count_ones() == 5)
            .map(|bits| determinant(&rows, &(0..14).filter(|i| bits >> i & 1 == 1).collect::<Vec<_>>()))
            .fold(0.0, f64::max);
        let found = determinant(&rows, &d_optimal(&rows, 5));
        assert!(found > 0.9 * best, "{found} of {best}");
    }

    #[test]
    fn a_pool_that_is_too_small_is_taken_whole() {
        assert_eq!(d_optimal(&[vec![1.0], vec![2.0]], 5), [0, 1]);
        assert!(d_optimal(&[], 5).is_empty());
    }
}
