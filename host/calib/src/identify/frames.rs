//! A fit in canonical frames, told in the user's.
//!
//! Which parameters are held, how the equations are scaled and how a start converges must not depend on where along its axis a frame was put.
//! Where nobody names a parameter of his own frames, the fit is therefore made in canonical ones. Its result comes back by the chain that is
//! the same robot, and by `∂user/∂canonical` for what is known of it to first order.

use ballbar::{Parameter, ParameterKind};
use nalgebra::DMatrix;

use super::fit::{Fit, FittedParameter};
use super::hold::Held;
use super::identifiability::{Finding, Identifiability};
use super::residual::ResidualSummary;
use super::residuals::residuals;
use super::uncertainty::Uncertainty;
use crate::kinematics::CanonicalFrames;
use crate::model::{Dataset, Robot};

/// A derivative that is rounding of frames half a kilometre away.
const ROUNDING: f64 = 1e-7;

/// The same fit with chain, parameters, findings and deviations in the frames of `robot`. A parameter that no free one moves is held, for the
/// reason that `found` gives in these frames.
pub(super) fn in_user_frames(
    mut fit: Fit,
    robot: &Robot,
    dataset: &Dataset,
    frames: &CanonicalFrames,
    found: &Identifiability,
) -> Fit {
    let free: Vec<usize> = (0..fit.parameters.len()).filter(|&index| fit.parameters[index].held.is_none()).collect();
    let moves = frames.user_by_canonical(&fit.solution.chain).select_columns(&free);
    let is_moved = |row: usize| moves.row(row).amax() > ROUNDING;
    let moved: Vec<usize> = (0..moves.nrows()).filter(|&row| is_moved(row)).collect();

    fit.uncertainty = moved_uncertainty(fit.uncertainty, &moves.select_rows(&moved));
    fit.solution.chain = frames.in_user_frames(&fit.solution.chain);
    // The same but for rounding; where a file's own lengths are met, nothing is left of them.
    let [before, after] = [&robot.chain, &fit.solution.chain].map(|chain| residuals(chain, dataset));
    (fit.initial, fit.fitted) = (ResidualSummary::new(&before), ResidualSummary::new(&after));
    fit.residuals = after;
    let values = robot.chain.parameters().iter().zip(fit.solution.chain.parameters());
    fit.parameters = fit
        .parameters
        .into_iter()
        .zip(values)
        .enumerate()
        .map(|(index, (canonical, (&initial, &fitted)))| {
            let place = moved.iter().position(|&row| row == index);
            let std = place.and_then(|place| fit.uncertainty.std[place]);
            let held = if place.is_some() { None } else { Some(held(&canonical, &found.findings[index])) };
            FittedParameter { initial, fitted, std, held, ..canonical }
        })
        .collect();
    for (finding, parameter) in fit.identifiability.findings.iter_mut().zip(&fit.parameters) {
        *finding = match &parameter.held {
            Some(Held::Finding(found)) => found.clone(),
            _ => Finding::Identified,
        };
    }
    fit
}

/// Why a parameter that nothing moves is held, its own words first, since others name it otherwise: as in canonical frames, or, where the
/// user's beta is a right angle, because it turns its link as alpha does.
fn held(canonical: &FittedParameter, found: &Finding) -> Held {
    if *found != Finding::Identified {
        return Held::Finding(found.clone());
    }
    canonical.held.clone().unwrap_or_else(|| {
        let alpha = canonical.parameter.index() - canonical.parameter.kind() as usize + ParameterKind::Alpha as usize;
        Held::Finding(Finding::Redundant { with: vec![Parameter::from_index(alpha)] })
    })
}

/// `D C Dᵀ`; what an undetermined parameter moves is not determined either.
fn moved_uncertainty(canonical: Uncertainty, moves: &DMatrix<f64>) -> Uncertainty {
    let covariance = moves * &canonical.covariance * moves.transpose();
    let std = |row: usize| {
        let is_determined = canonical.std.iter().zip(moves.row(row).iter()).all(|(std, by)| std.is_some() || by.abs() < ROUNDING);
        is_determined.then(|| covariance[(row, row)].sqrt())
    };
    Uncertainty { std: (0..moves.nrows()).map(std).collect(), covariance, ..canonical }
}
