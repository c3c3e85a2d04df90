//! What makes a fit not worth keeping.

use std::fmt;

use super::by_group::{GroupProofs, design_is_better};
use super::evidence::Evidence;
use super::plausibility::{Change, far_beyond_limits, large_changes_of};
use super::proof::{Proof, ProofKind};
use crate::identify::{Fit, Status, explanation};
use crate::model::Dataset;
use crate::units::{fixed, mm_from_m};

/// How large an RMS residual is believed, and why.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RmsLimit {
    /// Of a length of weight 1, metres.
    pub limit_m: f64,
    /// What it rests on.
    pub ground: RmsGround,
}

/// What a limit rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum RmsGround {
    /// Whoever asks has set it.
    Asked,
    /// Ten times the standard deviation that the poses state.
    StatedNoise,
    /// They state none: one millimetre, ten times what a bad bar and a bad robot scatter by.
    Usual,
}

impl RmsLimit {
    const TIMES_NOISE: f64 = 10.0;
    const USUAL_M: f64 = 1e-3;

    pub(super) fn new(dataset: &Dataset, asked_m: Option<f64>) -> Self {
        match (asked_m, dataset.stated_sigma_m()) {
            (Some(limit_m), _) => Self { limit_m, ground: RmsGround::Asked },
            (None, Some(sigma_m)) => Self { limit_m: Self::TIMES_NOISE * sigma_m, ground: RmsGround::StatedNoise },
            (None, None) => Self { limit_m: Self::USUAL_M, ground: RmsGround::Usual },
        }
    }
}

/// One reason why a fit is not worth keeping. Its text is a whole sentence.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Refusal {
    /// The solve did not end at a minimum.
    NoMinimum(Status),
    /// There are too few poses to leave some out.
    Unproven,
    /// Poses left out are not predicted better than by the design, by two standard errors.
    NoBetter {
        /// RMS by the design, metres.
        before_m: f64,
        /// RMS by fits without them, metres.
        after_m: f64,
        /// In how many postures they are.
        postures: usize,
    },
    /// Poses that the fit has not seen are predicted worse than by the design.
    Worse {
        /// Which poses.
        name: String,
        /// RMS by the design, metres.
        before_m: f64,
        /// RMS by the fit, metres.
        after_m: f64,
    },
    /// The residuals are too large to be noise.
    TooLarge {
        /// RMS residual, metres.
        rms_m: f64,
        /// What it exceeds.
        limit: RmsLimit,
    },
    /// So many rows contradict the others that nobody can say which of them are right.
    TooManyWrong {
        /// Rows that were left out.
        rows: usize,
        /// Of how many.
        of: usize,
    },
    /// Too many poses have joint values that the robot cannot have.
    BeyondLimits {
        /// Such poses.
        rows: usize,
        /// Of how many.
        of: usize,
        /// A joint that is beyond, from 1.
        joint: usize,
        /// Where that is so first.
        place: String,
    },
    /// Parameters went where no robot's are.
    Implausible(Vec<Change>),
    /// The robot would stand, or its tool be mounted, far from where its file says, and a mistake in the measurements explains them as well.
    Mistaken(Vec<Change>),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mm = |m: f64| format!("{} mm", fixed(mm_from_m(m), 3));
        match self {
            Self::NoMinimum(status) => write!(f, "No minimum was reached: {}.", explanation(*status)),
            Self::Unproven => f.write_str("There are too few poses to leave some out and prove the result on them."),
            Self::NoBetter { before_m, after_m, postures } => write!(
                f,
                "Poses left out of the fit are predicted no better than by the design, by two standard errors over {postures} postures: RMS {}, \
                 by the design {}.",
                mm(*after_m),
                mm(*before_m)
            ),
            Self::Worse { name, before_m, after_m } => {
                write!(
                    f,
                    "The design predicts better than the fit on {name}: RMS {}, by the fit {}.",
                    mm(*before_m),
                    mm(*after_m)
                )
            }
            Self::TooLarge { rms_m, limit } => {
                let ground = match limit.ground {
                    RmsGround::Asked => "the limit that was given",
                    RmsGround::StatedNoise => "ten times the noise that the poses state",
                    RmsGround::Usual => "the most that is believed of poses that state no noise",
                };
                write!(f, "The fit leaves an RMS of {}, more than {}, {ground}: ", mm(*rms_m), mm(limit.limit_m))?;
                f.write_str("robot, rig and poses do not belong together as the files say, or lengths are wrong.")
            }
            Self::TooManyWrong { rows, of } => write!(
                f,
                "{rows} of {of} lengths contradict the others and had to be left out, more than a quarter: nobody can say which of them are right."
            ),
            Self::BeyondLimits { rows, of, joint, place } => write!(
                f,
                "{rows} of {of} poses have joints far beyond their limits, the first at {place}, joint {joint}: these are not joint values of this \
                 robot in the file's units, or the limits in the robot's file are wrong."
            ),
            Self::Implausible(changes) => write!(
                f,
                "{}: no such robot exists. These poses do not tell its parameters, or the robot's file is another robot's, or says wrongly where it \
                 stands or what tool it has.",
                moved(changes)
            ),
            Self::Mistaken(changes) => write!(
                f,
                "{}: far more than designs are off, and a mistake in the measurements explains them without that.",
                moved(changes)
            ),
        }
    }
}

/// `Link 3 moved by 120 mm, the zero of joint 2 by 12°`.
pub(super) fn moved(changes: &[Change]) -> String {
    const SHOWN: usize = 4;
    let words: Vec<String> = changes.iter().take(SHOWN).map(Change::to_string).collect();
    let more = if changes.len() > SHOWN { format!(" and {} more", changes.len() - SHOWN) } else { String::new() };
    format!("The fit changes {}{more}", words.join(", "))
}

/// What the grounds come to.
pub(super) enum Judged {
    /// The fit is better than what it began with.
    Better,
    /// What it began with is as good.
    NothingToCorrect,
    /// The fit is not worth keeping.
    Refused(Vec<Refusal>),
}

/// Poses that may have a joint far beyond its limits before the robot or the file is not believed: single rows are outliers.
const FEW: f64 = 0.05;

/// Rows that may be left out before the others are no longer believed.
const MOST_WRONG: f64 = 0.25;

/// Whether the start may be the truth: its residuals can be believed, and are within two standard deviations of one length as the fit
/// estimates it.
fn is_as_good(fit: &Fit, limit: RmsLimit) -> bool {
    const DEVIATIONS: f64 = 2.0;
    let rms_m = fit.initial.rms_m;
    rms_m <= limit.limit_m && fit.uncertainty.sigma_m.is_some_and(|sigma_m| rms_m <= DEVIATIONS * sigma_m)
}

pub(super) fn judge(evidence: &Evidence<'_>, limit: RmsLimit, proofs: &[Proof], by_group: &[GroupProofs]) -> Judged {
    let Evidence { robot, dataset, fit, .. } = evidence;
    let mut refusals = Vec::new();
    let mut is_unchanged = fit.solution.status == Status::AlreadyOptimal;
    let is_minimum = fit.solution.status.is_minimum();
    if !is_minimum {
        refusals.push(Refusal::NoMinimum(fit.solution.status));
    }
    match proofs.iter().find(|proof| proof.kind == ProofKind::LeftOut) {
        _ if is_unchanged || !is_minimum => {}
        None => refusals.push(Refusal::Unproven),
        Some(proof) if proof.speaks_for() => {}
        Some(_) if is_as_good(fit, limit) => is_unchanged = true,
        Some(proof) => refusals.push(Refusal::NoBetter {
            before_m: proof.before_summary().rms_m,
            after_m: proof.after_summary().rms_m,
            postures: proof.posture_count(),
        }),
    }
    if !is_unchanged {
        let against = proofs.iter().filter(|proof| proof.kind != ProofKind::LeftOut && proof.speaks_against());
        refusals.extend(against.map(|proof| Refusal::Worse {
            name: proof.name.clone(),
            before_m: proof.before_summary().rms_m,
            after_m: proof.after_summary().rms_m,
        }));
        refusals.extend(design_is_better(by_group).map(|group| Refusal::Worse {
            name: format!("lengths {}, while none of them is fitted", group.name),
            before_m: group.before_m,
            after_m: group.after_m,
        }));
        let impossible: Vec<Change> =
            large_changes_of(&robot.chain, fit).into_iter().filter(|change| change.is_impossible).collect();
        if !impossible.is_empty() {
            refusals.push(Refusal::Implausible(impossible));
        }
    }
    let rms_m = fit.fitted.rms_m;
    if rms_m.is_nan() || rms_m > limit.limit_m {
        refusals.push(Refusal::TooLarge { rms_m, limit });
    }
    let of = dataset.rows.len();
    let wrong = fit.wrong_rows.len();
    if wrong as f64 > MOST_WRONG * of as f64 {
        refusals.push(Refusal::TooManyWrong { rows: wrong, of });
    }
    if let Some(beyond) = far_beyond_limits(robot, dataset).filter(|beyond| beyond.rows as f64 > FEW * of as f64) {
        let place = dataset.place(beyond.first);
        refusals.push(Refusal::BeyondLimits { rows: beyond.rows, of, joint: beyond.joint, place });
    }
    match (refusals.is_empty(), is_unchanged) {
        (false, _) => Judged::Refused(refusals),
        (true, true) => Judged::NothingToCorrect,
        (true, false) => Judged::Better,
    }
}
