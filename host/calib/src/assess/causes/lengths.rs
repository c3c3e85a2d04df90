//! Lengths that are of another unit, rod or pose, or none.

use super::case::Case;
use super::kind::{CauseKind, LengthUnit};
use super::weigh::{Candidate, ONE_KIND, alternatives, candidate, choose};

pub(super) fn candidates(case: &Case<'_>, open: &[usize]) -> Vec<Candidate> {
    let mut kinds: Vec<(CauseKind, f64)> = Vec::new();
    let mut add = |alike: Vec<CauseKind>| {
        let cost = ONE_KIND + alternatives(alike.len());
        kinds.extend(alike.into_iter().map(|kind| (kind, cost)));
    };
    add(LengthUnit::ALL.map(CauseKind::LengthUnit).to_vec());
    let rods_m = rods_m(case);
    add(rods_m.iter().map(|&rod_m| CauseKind::RodMissing { rod_m }).collect());
    let others = rods_m.iter().flat_map(|&a| rods_m.iter().filter(move |&&b| a != b).map(move |&b| a - b));
    add(others.map(|longer_by_m| CauseKind::OtherRod { longer_by_m }).collect());
    add([1, -1].map(|by| CauseKind::LengthShifted { by }).to_vec());
    let mut candidates: Vec<Candidate> = kinds.into_iter().filter_map(|(kind, cost)| candidate(case, open, kind, cost)).collect();
    candidates.extend([CauseKind::NoLength, CauseKind::LengthRepeated].into_iter().filter_map(|kind| seen(case, open, kind)));
    candidates
}

/// Lengths at mid travel that bars of these measurements have.
fn rods_m(case: &Case<'_>) -> Vec<f64> {
    /// Of more, each with each would be too many to try.
    const MOST: usize = 8;
    let mut rods_m: Vec<f64> = case.rig.bar.iter().flat_map(|bar| bar.lengths_m.iter().copied()).collect();
    rods_m.extend(case.dataset.rows.iter().filter_map(|row| row.bar_m));
    rods_m.sort_by(f64::total_cmp);
    rods_m.dedup();
    rods_m.truncate(MOST);
    rods_m
}

/// What is seen from the row itself, and whether chance makes it so does not depend on the residual.
fn seen(case: &Case<'_>, open: &[usize], kind: CauseKind) -> Option<Candidate> {
    /// A hundredth of a millimetre, the coarsest digits, of a travel of some 30 mm: `ln 3000`.
    const SAYS: f64 = 8.0;
    let says = open.iter().filter(|&&row| case.shows(&kind, row)).map(|&row| (row, SAYS));
    let (rows, value) = choose(says.collect(), open.len())?;
    Some(Candidate::new(vec![(kind, rows)], value - ONE_KIND))
}
