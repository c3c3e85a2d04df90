//! Which kinds of unknowns pay: forward selection by scores, each proved on poses left out.

use super::fit::Fit;
use super::options::FitError;
use super::postures::{mean_and_error, postures};
use super::residual::Residual;
use super::scores::{UnknownScore, unknown_scores};
use crate::model::{Dataset, Rig, Robot};
use crate::unknowns::{AnyBlock, Kind};

/// Less probable than this where nothing is off, a kind is tried: of ten kinds, in one clean fit of forty. Poses left out refuse some of these.
const WORTH_A_TRY: f64 = 2.5e-3;

/// A kind that was tried, by what residuals said, and what poses left out say of it.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TriedKind {
    /// The kind.
    pub kind: Kind,
    /// What would have explained the residuals before.
    pub score: UnknownScore,
    /// Weighted RMS of poses left out in turn without it, metres.
    pub left_out_before_m: f64,
    /// The same with it.
    pub left_out_m: f64,
    /// By how much the mean square falls, in standard errors by how it differs from posture to posture.
    pub gain: f64,
}

/// A fit with those kinds of unknowns that pay.
#[derive(Clone, Debug)]
pub struct PayingUnknowns {
    /// The fit with all that were taken.
    pub fit: Fit,
    /// In the order in which they were taken.
    pub taken: Vec<TriedKind>,
    /// Those that would explain residuals, but do not predict poses left out better by more than the standard error.
    pub left: Vec<TriedKind>,
}

/// Takes the kind of the most significant score, fits with it, and keeps it where poses left out are predicted better by more than the
/// standard error of the difference; then the next, until none is left. `blocks` are fitted in any case, and `fit` makes fits of the robot to the
/// poses with other blocks of unknowns.
///
/// # Errors
/// Those of `fit` without any other kind; where one cannot be fitted, it is not taken.
pub fn fit_paying_unknowns(
    robot: &Robot,
    rig: &Rig,
    dataset: &Dataset,
    mut blocks: Vec<AnyBlock>,
    fit: impl Fn(Vec<AnyBlock>) -> Result<Fit, FitError>,
) -> Result<PayingUnknowns, FitError> {
    let mut best = fit(blocks.clone())?;
    let (mut taken, mut left): (Vec<TriedKind>, Vec<TriedKind>) = (Vec::new(), Vec::new());
    'next: loop {
        let scores = unknown_scores(robot, rig, dataset, &best);
        for score in scores.beyond(WORTH_A_TRY) {
            let was_tried = left.iter().any(|tried| tried.kind == score.kind);
            let Ok(block) = score.kind.block(robot, rig, dataset) else { continue };
            let more: Vec<AnyBlock> = blocks.iter().cloned().chain([block]).collect();
            let Some(with) = (!was_tried).then(|| fit(more.clone()).ok()).flatten() else { continue };
            let Some((pays, tried)) = tried(robot, dataset, score, &best, &with) else { continue };
            if pays {
                taken.push(tried);
                (best, blocks) = (with, more);
                continue 'next;
            }
            left.push(tried);
        }
        return Ok(PayingUnknowns { fit: best, taken, left });
    }
}

/// What a kind brings, and whether that is enough; `None` where no poses could be left out.
fn tried(robot: &Robot, dataset: &Dataset, score: &UnknownScore, before: &Fit, with: &Fit) -> Option<(bool, TriedKind)> {
    let rows = dataset.rows.len();
    if before.left_out.len() != rows || with.left_out.len() != rows {
        return None;
    }
    // What only one of them has left out as wrong is no gain of the other.
    let both = |row: usize| before.left_out[row].weight > 0.0 && with.left_out[row].weight > 0.0;
    let square = |of: &[Residual], row: usize| if both(row) { of[row].weight * of[row].value_m.powi(2) } else { 0.0 };
    let of_rows = postures(robot.chain.joint_kinds(), dataset.rows.iter().map(|row| &row.measurement.q));
    let (mean, error) = mean_and_error(&of_rows, |row| square(&before.left_out, row) - square(&with.left_out, row))?;
    let tried = TriedKind {
        kind: score.kind,
        score: score.clone(),
        left_out_before_m: before.cross_validation?.rms_m,
        left_out_m: with.cross_validation?.rms_m,
        gain: mean / error,
    };
    Some((with.solution.status.is_minimum() && mean > error, tried))
}
