//! How well lengths are predicted that the fit has not seen, and how sure that is.

use std::collections::HashSet;

use super::evidence::Evidence;
use crate::identify::{FEWEST_POSTURES, Residual, ResidualSummary, mean_and_error, postures, residuals};
use crate::model::{Dataset, PoseRow};

/// What keeps lengths apart from the fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum ProofKind {
    /// No fit has seen them, nor another length of their postures.
    Apart,
    /// Fitted poses, left out in parts in turn, postures whole.
    LeftOut,
    /// No fit has seen them, but other lengths of their postures, whose errors they share.
    SamePostures,
}

/// Lengths that the fit has not seen.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Proof {
    /// Which lengths, to follow "on".
    pub name: String,
    /// What keeps them apart.
    pub kind: ProofKind,
    /// Residuals with the design, metres.
    pub before: Vec<Residual>,
    /// Residuals with the fit, metres.
    pub after: Vec<Residual>,
    /// The posture of each, from 0.
    pub postures: Vec<usize>,
}

impl Proof {
    /// Of a group of fitted rows, beside another prediction of them.
    pub(super) fn of_group(before: Vec<Residual>, after: Vec<Residual>, postures: Vec<usize>) -> Self {
        Self { name: String::new(), kind: ProofKind::LeftOut, before, after, postures }
    }

    /// Size of the residuals with the design.
    pub fn before_summary(&self) -> ResidualSummary {
        ResidualSummary::new(&self.before)
    }

    /// Size of the residuals with the fit.
    pub fn after_summary(&self) -> ResidualSummary {
        ResidualSummary::new(&self.after)
    }

    /// Number of postures.
    pub fn posture_count(&self) -> usize {
        self.postures.iter().max().map_or(0, |last| last + 1)
    }

    /// Standard error of the RMS with the fit, metres, by how it differs from posture to posture; `None` for too few.
    pub fn rms_error_m(&self) -> Option<f64> {
        let (_, error) = mean_and_error(&self.postures, |row| self.after[row].weight * self.after[row].value_m.powi(2))?;
        let rms_m = self.after_summary().rms_m;
        (rms_m > 0.0).then(|| error / (2.0 * rms_m))
    }

    /// Whether the fit predicts these lengths worse than the design does, and they are enough to say so.
    pub fn speaks_against(&self) -> bool {
        self.posture_count() >= FEWEST_POSTURES && self.after_summary().rms_m > self.before_summary().rms_m
    }

    /// Whether the fit predicts these lengths better than the design by more than twice what chance would do to the difference.
    pub fn speaks_for(&self) -> bool {
        let square = |residual: &Residual| residual.weight * residual.value_m.powi(2);
        let gain = mean_and_error(&self.postures, |row| square(&self.before[row]) - square(&self.after[row]));
        gain.is_some_and(|(mean, error)| mean > 2.0 * error)
    }

    /// Whether what is predicted after is worse than before, by so many standard errors of the difference.
    pub(super) fn is_worse_by(&self, errors: f64) -> bool {
        let square = |residual: &Residual| residual.weight * residual.value_m.powi(2);
        let loss = mean_and_error(&self.postures, |row| square(&self.after[row]) - square(&self.before[row]));
        loss.is_some_and(|(mean, error)| mean > errors * error)
    }
}

/// Of what the fit has not seen, then of its own poses left out in turn, then of other lengths of fitted postures.
pub(super) fn proofs(evidence: &Evidence<'_>, before: Vec<Residual>) -> Vec<Proof> {
    let Evidence { robot, dataset, fit, .. } = evidence;
    let kinds = robot.chain.joint_kinds();
    let proof = |name: String, kind: ProofKind, rows: &Dataset| {
        let postures = postures(kinds, rows.rows.iter().map(|row| &row.measurement.q));
        Proof { name, kind, before: residuals(&robot.kinematics(), rows), after: fit.residuals_of(rows), postures }
    };
    let (mut apart, mut same) = (Vec::new(), Vec::new());
    for (name, rows) in evidence.unseen {
        let seen = in_fitted_postures(evidence, rows);
        let (others, new) = (*rows).clone().split(|row: &PoseRow| seen.contains(&row.number));
        let (all, of_new) = (rows.rows.len(), new.rows.len());
        if of_new > 0 {
            let name = if of_new == all { name.clone() } else { format!("{name}, {of_new} of {all} in postures not fitted") };
            apart.push(proof(name, ProofKind::Apart, &new));
        }
        if !others.rows.is_empty() {
            same.push(proof(format!("{name}, other lengths of fitted postures"), ProofKind::SamePostures, &others));
        }
    }
    let left_out = fit.cross_validation.map(|proof| Proof {
        name: format!(
            "the fitted poses, each predicted by a fit without it ({} parts{})",
            proof.folds,
            if proof.in_blocks { ", each measured in one go" } else { "" }
        ),
        kind: ProofKind::LeftOut,
        before: fitted(&before),
        after: fitted(&fit.left_out),
        postures: postures(
            kinds,
            dataset.rows.iter().zip(&before).filter(|(_, f)| f.weight > 0.0).map(|(row, _)| &row.measurement.q),
        ),
    });
    apart.into_iter().chain(left_out).chain(same).collect()
}

/// Without rows that were left out as wrong.
fn fitted(residuals: &[Residual]) -> Vec<Residual> {
    residuals.iter().copied().filter(|residual| residual.weight > 0.0).collect()
}

/// Numbers of the rows in whose posture a length was fitted.
fn in_fitted_postures(evidence: &Evidence<'_>, rows: &Dataset) -> HashSet<usize> {
    let fitted = evidence.dataset.rows.len();
    let all = evidence.dataset.rows.iter().chain(&rows.rows).map(|row| &row.measurement.q);
    let numbers = postures(evidence.robot.chain.joint_kinds(), all);
    let known: HashSet<usize> = numbers[..fitted].iter().copied().collect();
    let seen = rows.rows.iter().zip(&numbers[fitted..]).filter(|(_, posture)| known.contains(posture));
    seen.map(|(row, _)| row.number).collect()
}

/// The proof that says the least good of a fit: the one to go by.
pub(super) fn decisive(proofs: &[Proof]) -> Option<&Proof> {
    let unseen = proofs.iter().filter(|proof| proof.kind != ProofKind::SamePostures);
    let worst = unseen.max_by(|a, b| a.after_summary().rms_m.total_cmp(&b.after_summary().rms_m));
    worst.or(proofs.first())
}
