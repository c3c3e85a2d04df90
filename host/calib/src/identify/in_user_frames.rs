//! A fit in canonical frames, seen in the frames that the robot is written in.

use ballbar::{Parameter, ParameterKind};
use nalgebra::DMatrix;

use super::fit::{Fit, FittedParameter};
use super::hold::Held;
use super::identifiability::{Finding, Identifiability};
use super::uncertainty::Uncertainty;
use crate::kinematics::CanonicalFrames;
use crate::model::Robot;
use crate::unknowns::Unknowns;

/// A parameter that a metre or radian of no canonical one moves by as much stays where it is: above the rounding of frames a hundred metres
/// away.
const STAYS: f64 = 1e-7;

/// The same fit with values, deviations and reasons of the robot's own parameters. Redundant ones are at their design values; what was held for
/// other reasons may move along with what was free, as another frame's coordinates do. `unknowns` are those of the robot as it is written, and
/// `found` is what the poses tell of them.
pub(super) fn in_user_frames(fit: Fit, frames: &CanonicalFrames, unknowns: Unknowns, found: &Identifiability) -> Fit {
    let fitted = frames.in_user_frames(&fit.solution.chain);
    let of_chain = unknowns.of_chain().len();
    let mut solution = fit.solution;
    let found_again = |index: usize| index < of_chain && fitted.parameters()[index] != unknowns.list()[index].start;
    let mut user_by_free = user_by_free(&frames.user_by_canonical(&solution.chain), &fit.parameters);
    // A zero that was lost is found as the same offset in all frames, and nothing else moves with it.
    let free = (0..fit.parameters.len()).filter(|&index| fit.parameters[index].held.is_none());
    let lost = free.enumerate().filter(|&(_, index)| found_again(index) && is_offset(index)).collect::<Vec<_>>();
    for (column, index) in lost {
        user_by_free.column_mut(column).fill(0.0);
        user_by_free[(index, column)] = 1.0;
    }
    solution.values[..of_chain].copy_from_slice(fitted.parameters());
    solution.chain = fitted;

    let moves: Vec<bool> = user_by_free.row_iter().map(|row| row.amax() > STAYS).collect();
    let moved: Vec<usize> = (0..moves.len()).filter(|&index| moves[index]).collect();
    let uncertainty = moved_uncertainty(fit.uncertainty, &user_by_free.select_rows(&moved));
    let stds = moved.iter().zip(&uncertainty.std);
    let std_of = |index: usize| stds.clone().find(|(other, _)| **other == index).and_then(|(_, std)| *std);
    let values = unknowns.list().iter().zip(&solution.values).zip(fit.parameters).enumerate();
    let parameters = values.map(|(index, ((unknown, &value), canonical))| FittedParameter {
        name: unknown.name.clone(),
        unit: unknown.unit,
        initial: unknown.start,
        fitted: value,
        std: std_of(index),
        held: if moves[index] { None } else { Some(reason(index, canonical, &found.findings[index])) },
    });
    let parameters: Vec<FittedParameter> = parameters.collect();
    let mut identifiability = fit.identifiability;
    let findings = identifiability.findings.iter_mut().zip(&parameters).zip(&found.findings);
    for ((finding, parameter), found) in findings {
        *finding = match &parameter.held {
            Some(Held::Finding(reason)) => reason.clone(),
            // What beliefs free the poses need not tell.
            None if fit.prior.is_some() && !matches!(found, Finding::Redundant { .. }) => found.clone(),
            _ => Finding::Identified,
        };
    }
    Fit { parameters, solution, uncertainty, unknowns, identifiability, ..fit }
}

impl Fit {
    /// The robot as it was found to be: its chain, and the terms of its joints with the masses where their links are.
    pub fn robot(&self, robot: &Robot) -> Robot {
        let chain = self.solution.chain.clone();
        let terms = CanonicalFrames::new(&robot.chain).terms_in_user_frames(&chain, &self.terms(robot));
        Robot { chain, terms, ..robot.clone() }
    }
}

fn is_offset(index: usize) -> bool {
    Parameter::from_index(index).kind() == ParameterKind::Offset
}

/// Why a parameter stays that nothing moves: in these frames' own names, or, where they do not tell, as in canonical ones, or because it turns
/// its link as alpha does, where beta is a right angle.
fn reason(index: usize, canonical: FittedParameter, found: &Finding) -> Held {
    match (found, canonical.held) {
        (Finding::Identified, Some(held)) => held,
        (Finding::Identified, None) => {
            let alpha = Parameter::new(Parameter::from_index(index).number(), ParameterKind::Alpha);
            Held::Finding(Finding::Redundant { with: alpha.iter().map(Parameter::to_string).collect() })
        }
        (found, _) => Held::Finding(found.clone()),
    }
}

/// `∂user/∂canonical` of all unknowns by the free ones: those behind the chain's are the same in all frames.
fn user_by_free(of_chain: &DMatrix<f64>, canonical: &[FittedParameter]) -> DMatrix<f64> {
    let (chain, all) = (of_chain.nrows(), canonical.len());
    let free: Vec<usize> = (0..all).filter(|&index| canonical[index].held.is_none()).collect();
    DMatrix::from_fn(all, free.len(), |row, column| match free[column] {
        index if index < chain && row < chain => of_chain[(row, index)],
        index => f64::from(row == index),
    })
}

/// Deviations and covariance of what moves, by those of what was free.
fn moved_uncertainty(canonical: Uncertainty, moved_by_free: &DMatrix<f64>) -> Uncertainty {
    let covariance = moved_by_free * &canonical.covariance * moved_by_free.transpose();
    let depends = |row: usize, column: usize| moved_by_free[(row, column)].abs() > STAYS;
    let is_told = |row: usize| (0..moved_by_free.ncols()).all(|column| canonical.std[column].is_some() || !depends(row, column));
    let std = (0..covariance.nrows()).map(|row| is_told(row).then(|| covariance[(row, row)].max(0.0).sqrt())).collect();
    Uncertainty { std, covariance, ..canonical }
}
