//! How much likelier a cause is than gross errors without one.
//!
//! A row that a cause explains has a normal residual without it, `N(f'; 0, s²)`. A gross error without a cause may be of any size, each factor
//! of e as likely as the next: its density is `1/(2 D |f|)`. The logarithm of their ratio is what a row says for the cause; from the sum goes what was
//! chosen to get there, each choice the logarithm of how many there were: the kind, its alternatives, which of the open rows, and, of a
//! fitted number, its prior range in units of how sharply the rows determine it.

use std::f64::consts::TAU;

use super::case::Case;
use super::kind::CauseKind;

/// A cause, or several of one kind that are weighed together.
pub(super) struct Candidate {
    /// Each with the rows that it explains.
    pub(super) parts: Vec<(CauseKind, Vec<usize>)>,
    /// The logarithm of the odds against gross errors.
    pub(super) log_odds: f64,
    /// The same as far as all causes are weighed alike, to choose between them.
    pub(super) rank: f64,
}

impl Candidate {
    pub(super) fn new(parts: Vec<(CauseKind, Vec<usize>)>, log_odds: f64) -> Self {
        Self { parts, log_odds, rank: log_odds }
    }
}

/// Choosing one of the kinds of causes: some ten, all alike, and the mistakes of names that are made the most often.
pub(super) const ONE_KIND: f64 = 2.5;
pub(super) const USUAL_KIND: f64 = 1.0;

/// Gross errors are from a tenth of a millimetre to a metre: `ln 10⁴`.
const SIZES: f64 = 9.21;

/// Prior range of a fitted length or distance, in one dimension, metres: that of a gross error of its size.
pub(super) fn range_of_size(size: f64) -> f64 {
    2.0 * SIZES * size.abs()
}

/// What a row left out says for a cause that leaves it `without_m`: positive, for it.
pub(super) fn against_gross(case: &Case<'_>, row: usize, without_m: f64) -> f64 {
    let row = &case.rows[row];
    let z = without_m / row.deviation_m;
    -z * z / 2.0 - (row.deviation_m * TAU.sqrt()).ln() + range_of_size(row.residual_m).ln()
}

/// What a row that fits as it is says for a cause that would leave it `without_m`.
pub(super) fn against_good(case: &Case<'_>, row: usize, without_m: f64) -> f64 {
    let row = &case.rows[row];
    ((row.residual_m / row.deviation_m).powi(2) - (without_m / row.deviation_m).powi(2)) / 2.0
}

/// The rows that a cause explains best, of those that say something for it, and what they say less the choice of them.
pub(super) fn choose(mut says: Vec<(usize, f64)>, open: usize) -> Option<(Vec<usize>, f64)> {
    says.retain(|(_, value)| *value > 0.0);
    says.sort_by(|a, b| b.1.total_cmp(&a.1));
    let (mut sum, mut best, mut choices) = (0.0, (0, 0.0), ((open + 1) as f64).ln());
    for (chosen, (_, value)) in says.iter().enumerate() {
        sum += value;
        // ln((N + 1) C(N, n)): how many there are, and which.
        choices += ((open - chosen) as f64 / (chosen + 1) as f64).ln();
        if sum - choices > best.1 {
            best = (chosen + 1, sum - choices);
        }
    }
    let mut rows: Vec<usize> = says[..best.0].iter().map(|(row, _)| *row).collect();
    rows.sort_unstable();
    (best.0 > 0).then_some((rows, best.1))
}

/// A candidate of one cause without fitted numbers, `cost` for the choice of it; `None` where it explains nothing.
pub(super) fn candidate(case: &Case<'_>, open: &[usize], kind: CauseKind, cost: f64) -> Option<Candidate> {
    let says = |&row: &usize| Some((row, against_gross(case, row, case.residual_without(&kind, row)?)));
    let (rows, value) = choose(open.iter().filter_map(says).collect(), open.len())?;
    Some(Candidate::new(vec![(kind, rows)], value - cost))
}

/// The logarithm of how many alternatives there are.
pub(super) fn alternatives(count: usize) -> f64 {
    (count.max(1) as f64).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_of_many_rows_takes_more_to_be_chosen_than_all() {
        let some = |count: usize| (0..count).map(|row| (row, 5.0)).collect::<Vec<_>>();
        assert_eq!(choose(some(1), 1).unwrap(), (vec![0], 5.0 - 2f64.ln()));
        assert_eq!(choose(some(1), 36), None, "37 numbers of rows and 36 rows are ln 1332 = 7.2");
        assert_eq!(choose(some(36), 36).unwrap().0.len(), 36);
        assert_eq!(choose(vec![(0, -1.0)], 1), None);
        // Those that speak against it are left to other causes.
        let mut mixed = some(20);
        mixed.extend((20..36).map(|row| (row, -5.0)));
        assert_eq!(choose(mixed, 36).unwrap().0, (0..20).collect::<Vec<_>>());
    }
}
