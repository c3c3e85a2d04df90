//! Which of many poses are drawn: a page has to open, however many were measured.

use std::collections::BTreeSet;

use crate::report::facts::Facts;

/// Poses of which all are drawn; of more, about as many.
const MOST: usize = 3000;
/// Of those that stand out, the worst so many are always drawn.
const MOST_OUTLIERS: usize = 300;

/// Indices of the rows that are drawn, in the order of measurement.
///
/// Every n-th would meet the same pairing again and again where pairings take turns; multiples of the golden ratio keep out of
/// step with any such period, and lie as evenly.
pub(in crate::report) fn drawn(facts: &Facts) -> Vec<usize> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let share = MOST as f64 / facts.rows.len() as f64;
    let even = (0..facts.rows.len()).filter(|&row| (row as f64 * GOLDEN).fract() < share);
    let outliers = facts.outliers.iter().take(MOST_OUTLIERS).map(|outlier| outlier.row);
    even.chain(outliers).collect::<BTreeSet<usize>>().into_iter().collect()
}

/// What a figure's sentence ends with where not all are drawn.
pub(super) fn drawn_words(facts: &Facts) -> String {
    let (drawn, all) = (drawn(facts).len(), facts.rows.len());
    if drawn == all {
        return String::new();
    }
    let outliers = if facts.outliers.is_empty() { "" } else { " and those that stand out most" };
    format!(" {drawn} of the {all} lengths are drawn, chosen evenly{outliers}; --csv writes all.")
}
