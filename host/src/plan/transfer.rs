//! The way from the last pose of one shell to the first of the next, with the bar taken off.

use ballbar::JointVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::cell::Cell;
use super::way::{is_clear, is_sound};

/// Via points from `a` to `b` without the bar: none, or one or two that were found at random; `None` when none were found.
pub(super) fn free(cell: &Cell<'_>, a: &JointVector<f64>, b: &JointVector<f64>, seed: u64) -> Option<Vec<JointVector<f64>>> {
    const PLACES: usize = 60;
    if is_clear(cell, None, a, b) {
        return Some(Vec::new());
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut places: Vec<JointVector<f64>> = (0..PLACES * 5)
        .map(|_| cell.inverse.random_start(&mut rng))
        .filter(|q| is_sound(cell, None, q, 0.0))
        .take(PLACES)
        .collect();
    let detour_s = |q: &JointVector<f64>| cell.seconds(a, q) + cell.seconds(q, b);
    places.sort_by(|x, y| detour_s(x).total_cmp(&detour_s(y)));

    let from_a: Vec<bool> = places.iter().map(|q| is_clear(cell, None, a, q)).collect();
    let to_b: Vec<bool> = places.iter().map(|q| is_clear(cell, None, q, b)).collect();
    let single = (0..places.len()).find(|&i| from_a[i] && to_b[i]);
    if let Some(i) = single {
        return Some(vec![places[i]]);
    }
    let starts = (0..places.len()).filter(|&i| from_a[i]);
    let mut pairs = starts.flat_map(|i| (0..places.len()).filter(|&j| to_b[j]).map(move |j| (i, j)));
    let (i, j) = pairs.find(|&(i, j)| is_clear(cell, None, &places[i], &places[j]))?;
    Some(vec![places[i], places[j]])
}
