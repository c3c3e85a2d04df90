//! An order of poses that makes the way short.

use nalgebra::DMatrix;

/// An order in which to visit all points once, from any to any: nearest neighbours first, then pieces of it turned round and
/// moved for as long as that shortens it (2-opt and Or-opt). `seconds` is symmetric.
pub(super) fn short_order(seconds: &DMatrix<f64>) -> Vec<usize> {
    const BEGINNINGS: usize = 4;
    let points = seconds.nrows();
    let beginnings = (0..points).step_by(points.div_ceil(BEGINNINGS).max(1));
    let improved = beginnings.map(|first| {
        let mut order = nearest_neighbours(seconds, first);
        improve(seconds, &mut order);
        order
    });
    improved.min_by(|a, b| length(seconds, a).total_cmp(&length(seconds, b))).unwrap_or_default()
}

/// Shortens an order for as long as turning or moving a piece does.
pub(super) fn improve(seconds: &DMatrix<f64>, order: &mut Vec<usize>) {
    while turn_pieces(seconds, order) | move_pieces(seconds, order) {}
}

/// Seconds along an order.
pub(super) fn length(seconds: &DMatrix<f64>, order: &[usize]) -> f64 {
    order.windows(2).map(|pair| seconds[(pair[0], pair[1])]).sum()
}

/// Less is rounding, and would go round for ever.
const GAIN_S: f64 = 1e-9;

fn nearest_neighbours(seconds: &DMatrix<f64>, first: usize) -> Vec<usize> {
    let mut rest: Vec<usize> = (0..seconds.nrows()).filter(|&i| i != first).collect();
    let mut order = vec![first];
    let mut last = first;
    while let Some((at, _)) = rest.iter().enumerate().min_by(|a, b| seconds[(last, *a.1)].total_cmp(&seconds[(last, *b.1)])) {
        last = rest.swap_remove(at);
        order.push(last);
    }
    order
}

/// The leg between two places of an order; nothing beyond its ends.
fn leg(seconds: &DMatrix<f64>, a: Option<&usize>, b: Option<&usize>) -> f64 {
    a.zip(b).map_or(0.0, |(&a, &b)| seconds[(a, b)])
}

fn turn_pieces(seconds: &DMatrix<f64>, order: &mut [usize]) -> bool {
    let mut shortened = false;
    for start in 0..order.len() {
        for end in start + 1..order.len() {
            let (before, after) = (start.checked_sub(1).map(|i| &order[i]), order.get(end + 1));
            let old = leg(seconds, before, Some(&order[start])) + leg(seconds, Some(&order[end]), after);
            let new = leg(seconds, before, Some(&order[end])) + leg(seconds, Some(&order[start]), after);
            if new < old - GAIN_S {
                order[start..=end].reverse();
                shortened = true;
            }
        }
    }
    shortened
}

fn move_pieces(seconds: &DMatrix<f64>, order: &mut Vec<usize>) -> bool {
    const LONGEST_PIECE: usize = 3;
    let mut shortened = false;
    for count in 1..=LONGEST_PIECE.min(order.len().saturating_sub(1)) {
        for start in 0..=order.len() - count {
            let piece: Vec<usize> = order[start..start + count].to_vec();
            let mut rest = order.clone();
            rest.drain(start..start + count);
            let (first, last) = (&piece[0], &piece[count - 1]);
            let around = |at: usize| (at.checked_sub(1).map(|i| &rest[i]), rest.get(at));
            let cost = |at: usize, first: &usize, last: &usize| {
                let (before, after) = around(at);
                leg(seconds, before, Some(first)) + leg(seconds, Some(last), after) - leg(seconds, before, after)
            };
            let here = cost(start, first, last);
            let places = (0..=rest.len()).flat_map(|at| [(at, false, cost(at, first, last)), (at, true, cost(at, last, first))]);
            let Some((at, is_turned, best)) = places.min_by(|a, b| a.2.total_cmp(&b.2)) else { continue };
            if best < here - GAIN_S {
                let mut piece = piece;
                if is_turned {
                    piece.reverse();
                }
                rest.splice(at..at, piece);
                *order = rest;
                shortened = true;
            }
        }
    }
    shortened
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn between(points: &[(f64, f64)]) -> DMatrix<f64> {
        DMatrix::from_fn(points.len(), points.len(), |a, b| (points[a].0 - points[b].0).hypot(points[a].1 - points[b].1))
    }

    #[test]
    fn points_in_a_line_are_visited_along_it() {
        let points: Vec<(f64, f64)> = [4, 0, 7, 2, 9, 1, 3, 8, 5, 6].map(|x| (f64::from(x), 0.0)).to_vec();
        let seconds = between(&points);
        assert_eq!(length(&seconds, &short_order(&seconds)), 9.0);
    }

    #[test]
    fn every_point_is_visited_once_and_the_way_is_short() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let points: Vec<(f64, f64)> = (0..100).map(|_| (rng.random_range(0.0..1.0), rng.random_range(0.0..1.0))).collect();
        let seconds = between(&points);
        let mut order = short_order(&seconds);
        // Random points in a unit square: the best tour is about 0.7124 √(n A) (Beardwood, Halton and Hammersley 1959).
        assert!(length(&seconds, &order) < 0.7124 * 10.0 * 1.15, "{}", length(&seconds, &order));
        order.sort_unstable();
        assert_eq!(order, (0..100).collect::<Vec<_>>());
        assert!(short_order(&DMatrix::zeros(0, 0)).is_empty());
        assert_eq!(short_order(&DMatrix::zeros(1, 1)), [0]);
    }
}
