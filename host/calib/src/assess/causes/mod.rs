//! Why a row was left out: each likely cause is tried on the rows that a fit to the others leaves far off.
//!
//! ```text
//! FittedRows, WrongRow ─▶ Case (residuals, standard deviations, bars)
//!                         │
//!    ends     two chucks or spheres exchanged; another pairing, row by row ─┐
//!    lengths  unit, rod, none, repeated; of the next or previous row        │  CauseKind ─ remedy: the row's residual without it
//!    joints   sign, two exchanged, radians; turns of an encoder; any angle  ├─▶ weigh: how much better than "any gross error",
//!    runs     from a row to a row: an offset, a chuck or sphere displaced   ┘          less what was tried and fitted to get there
//!                         ▲                                                     │ the candidate that explains the most
//!                         └──────────── the rows it leaves ◀────────────────────┤
//!                                                                               ▼
//!                                               Cause (rows, kind, sentence); the rest: CauseKind::Unknown
//! ```
//!
//! `docs/identification.md` says what each costs.

mod case;
mod ends;
mod joints;
mod kind;
mod lengths;
mod remedy;
mod runs;
mod sentence;
mod weigh;

use std::fmt;

pub use kind::{AngleUnit, CauseKind, LengthUnit, RowsOf};

use crate::identify::{Residual, WrongRow};
use crate::model::{Dataset, Rig, Robot};
use case::Case;
use weigh::Candidate;

/// A fit to the rows that were kept, and all rows.
#[derive(Clone, Copy, Debug)]
pub struct FittedRows<'a> {
    /// The robot as it was found to be, terms of its joints and all.
    pub robot: &'a Robot,
    /// The rig as it is believed or was found to be.
    pub rig: &'a Rig,
    /// All rows, those left out among them.
    pub dataset: &'a Dataset,
    /// What the fit leaves of each of them: of other unknowns than the robot and the rig, it alone knows.
    pub residuals: &'a [Residual],
    /// Standard deviation of a length of weight one, metres, above zero.
    pub sigma_m: f64,
}

/// What probably made some rows wrong. Its text is a clause: `rows 12 and 40 fit with chuck B instead of A`.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Cause {
    /// The rows left out that it explains, by index, in order.
    pub rows: Vec<usize>,
    /// What it is.
    pub kind: CauseKind,
    /// By how much it is likelier than gross errors without a cause: the natural logarithm of the odds. Zero for [`CauseKind::Unknown`].
    pub log_odds: f64,
    sentence: String,
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.sentence)
    }
}

/// The likely cause of each row left out, what explains the most first. Each of these rows is in one cause; those that nothing
/// explains are in a last one, [`CauseKind::Unknown`].
///
/// Rows that were not left out belong to no cause, but a sentence counts them in where they fit one: `from row 201 on`.
///
/// # Panics
/// When the parts do not belong together: not a residual for each row, a row that is none of the dataset's, or a pairing that the rig lacks.
pub fn causes(fitted: &FittedRows<'_>, left_out: &[WrongRow]) -> Vec<Cause> {
    /// A cause is named where it is likelier than none by this factor: e.
    const LEAST_LOG_ODDS: f64 = 1.0;
    let case = Case::new(fitted, left_out);
    let mut open: Vec<usize> = (0..case.count()).filter(|&row| case.is_left_out(row)).collect();
    let mut causes = Vec::new();
    while let Some(best) = best(&case, &open, LEAST_LOG_ODDS) {
        for (kind, rows) in best.parts {
            open.retain(|row| !rows.contains(row));
            causes.push((rows, kind, best.log_odds));
        }
    }
    if !open.is_empty() {
        causes.push((open, CauseKind::Unknown, 0.0));
    }
    let told = |(rows, kind, log_odds): (Vec<usize>, CauseKind, f64)| {
        let sentence = sentence::sentence(&case, &rows, &kind);
        Cause { rows, kind, log_odds, sentence }
    };
    causes.into_iter().map(told).collect()
}

/// The candidate that explains the most of these rows, of those that are likely enough.
fn best(case: &Case<'_>, open: &[usize], least_log_odds: f64) -> Option<Candidate> {
    if open.is_empty() {
        return None;
    }
    let candidates = ends::candidates(case, open)
        .into_iter()
        .chain(lengths::candidates(case, open))
        .chain(joints::candidates(case, open))
        .chain(runs::candidates(case, open));
    // Of those alike the first, the simplest.
    candidates.filter(|one| one.log_odds > least_log_odds).fold(None, |best: Option<Candidate>, one| match best {
        Some(best) if best.rank >= one.rank => Some(best),
        _ => Some(one),
    })
}
