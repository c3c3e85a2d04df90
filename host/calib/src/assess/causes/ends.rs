//! Chucks and spheres that were not those that the rows name.

use super::case::Case;
use super::kind::CauseKind;
use super::weigh::{Candidate, USUAL_KIND, against_gross, alternatives, candidate, choose};
use crate::model::{End, PairingId};

pub(super) fn candidates(case: &Case<'_>, open: &[usize]) -> Vec<Candidate> {
    let mut candidates: Vec<Candidate> = Vec::new();
    for (end, count) in [(End::Chuck, case.rig.chucks.len()), (End::Sphere, case.rig.spheres.len())] {
        let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
        let cost = USUAL_KIND + alternatives(count * count.saturating_sub(1) / 2);
        candidates.extend(pairs.filter_map(|between| {
            let found = candidate(case, open, CauseKind::EndsExchanged { end, between }, cost)?;
            Some(one_way(case, found, end, between))
        }));
    }
    candidates.extend(other_pairings(case, open));
    candidates
}

/// Where all rows name the same of the two, it was taken for the other, and not the other for it.
fn one_way(case: &Case<'_>, mut found: Candidate, end: End, [a, b]: [usize; 2]) -> Candidate {
    for (kind, rows) in &mut found.parts {
        let named = |which: usize| rows.iter().all(|&row| case.dataset.rows[row].pairing.at(end) == which);
        if named(a) {
            *kind = CauseKind::OtherEnd { end, named: a, really: b };
        } else if named(b) {
            *kind = CauseKind::OtherEnd { end, named: b, really: a };
        }
    }
    found
}

/// Each row by itself with the pairing that it fits best; those that fit one and name one are a cause together.
fn other_pairings(case: &Case<'_>, open: &[usize]) -> Option<Candidate> {
    /// So many are worth a sentence each.
    const MOST: usize = 3;
    let pairings = case.rig.all_pairings();
    let cost = alternatives(pairings.len() - 1);
    let best = |row: usize| -> Option<(PairingId, f64)> {
        let others = pairings.iter().filter(|&&other| other != case.dataset.rows[row].pairing);
        let says = others.map(|&other| (other, against_gross(case, row, case.with_pairing(row, other)) - cost));
        says.max_by(|a, b| a.1.total_cmp(&b.1))
    };
    let found: Vec<(usize, PairingId, f64)> =
        open.iter().filter_map(|&row| best(row).map(|(pairing, says)| (row, pairing, says))).collect();
    let (rows, value) = choose(found.iter().map(|(row, _, says)| (*row, *says)).collect(), open.len())?;
    let chosen: Vec<(usize, PairingId)> =
        found.into_iter().filter(|(row, ..)| rows.contains(row)).map(|(row, really, _)| (row, really)).collect();
    let mut parts: Vec<(CauseKind, Vec<usize>)> = Vec::new();
    for &(row, really) in &chosen {
        let kind = CauseKind::OtherPairing { named: case.dataset.rows[row].pairing, really };
        match parts.iter_mut().find(|(other, _)| *other == kind) {
            Some((_, rows)) => rows.push(row),
            None => parts.push((kind, vec![row])),
        }
    }
    if parts.len() > MOST {
        let really = chosen.iter().map(|(_, really)| *really).collect();
        parts = vec![(CauseKind::OtherPairings { really }, rows)];
    }
    Some(Candidate::new(parts, value - USUAL_KIND))
}
