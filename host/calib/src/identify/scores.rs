//! What would explain the residuals that was not fitted: a score test of each kind of unknowns, by linear theory at the solution.
//!
//! With columns `J` of what is fitted and `X` of a kind beside it, residuals `f` of variance `σ²`, and what is believed of the kind, `Π = diag(1/tolerance²)`:
//!
//! ```text
//! H = J J⁺     what the fit could follow of lengths, if it believed nothing
//! M = Xᵀ (I − H) X,  g = Xᵀ (I − H) f     what the fit cannot follow of the kind, and what is left for it
//! found = (M + σ²Π)⁻¹ g,  fall of χ² = gᵀ (M + σ²Π)⁻¹ g / σ²
//! ```
//!
//! Where nothing is off, `g` has covariance `σ² M`, and the fall is `Σ wᵢ zᵢ²` of independent normal `z`, with `w` the eigenvalues of
//! `(M + σ²Π)⁻¹ M`: 1 for what lengths decide, 0 for what belief does. A chi-square of `(Σw)²/Σw²` degrees of freedom, scaled, stands for it
//! (F. E. Satterthwaite, Biometrics Bulletin 2, 1946); Fisher's F where the residuals say what the noise is.
//!
//! What is believed of the fitted unknowns is left aside: where tolerances are wrong, that would look like something else which was not fitted.

mod beside;
mod words;

use ballbar::ParameterUnit;

use self::beside::Beside;
use super::fit::Fit;
use crate::model::{Dataset, Rig, Robot};
use crate::unknowns::{AnyBlock, Kind, UnknownError};

/// Less probable than this where nothing is off, a score is worth a word: of ten kinds, one fit in a hundred says one in vain.
const SIGNIFICANT: f64 = 1e-3;

/// What one kind of unknowns would explain.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct UnknownScore {
    /// The kind.
    pub kind: Kind,
    /// By how much `Σ f²/σ² + Σ (change/tolerance)²` would fall; σ is what is stated, or what residuals would show beside it.
    pub fall: f64,
    /// Effective degrees of freedom: how many of its unknowns lengths decide, rather than what is believed of them.
    pub freedom: f64,
    /// Probability of as much where nothing is off; zero where it is too small for a number.
    pub p_value: f64,
    /// By how many standard deviations a normal value is off that is as improbable.
    pub deviations: f64,
    /// What its unknowns would be, in their order.
    pub estimates: Vec<ScoreEstimate>,
}

/// What an unknown would be that was not fitted.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ScoreEstimate {
    /// What people call it.
    pub name: String,
    /// Unit of its value.
    pub unit: ParameterUnit,
    /// SI. Signs are those of the kind: by how much lengths are too long, for most.
    pub value: f64,
    /// Standard deviation, SI.
    pub std: f64,
    /// By how much `Σ f²/σ² + (change/tolerance)²` would fall with it alone.
    pub fall_alone: f64,
}

/// Why there is no score of a kind.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum NoScore {
    /// Measurements lack what it is made of.
    Lacks(#[cfg_attr(feature = "serde", serde(serialize_with = "as_text"))] UnknownError),
    /// No length changes with it.
    NoEffect,
    /// In these poses what is fitted changes the lengths in the same way.
    ActsLike {
        /// What does, strongest first.
        with: Vec<String>,
    },
    /// It is what another kind is, in these poses.
    SameAs(Kind),
    /// Too few lengths are left to tell it from noise.
    TooFew,
}

#[cfg(feature = "serde")]
fn as_text<S: serde::Serializer>(error: &UnknownError, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(error)
}

/// The scores of all kinds that were not fitted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UnknownScores {
    /// The most significant first.
    pub scores: Vec<UnknownScore>,
    /// Kinds that have none.
    pub refused: Vec<(Kind, NoScore)>,
}

impl UnknownScores {
    /// Those that noise would hardly bring, the most significant first.
    pub fn significant(&self) -> impl Iterator<Item = &UnknownScore> {
        self.beyond(SIGNIFICANT)
    }

    /// Those less probable than this where nothing is off, the most significant first.
    pub(super) fn beyond(&self, p_value: f64) -> impl Iterator<Item = &UnknownScore> {
        self.scores.iter().filter(move |score| score.p_value < p_value)
    }
}

impl UnknownScore {
    /// Whether noise would hardly bring it.
    pub fn is_significant(&self) -> bool {
        self.p_value < SIGNIFICANT
    }

    /// The unknown that would explain the most alone.
    pub fn largest(&self) -> Option<&ScoreEstimate> {
        self.estimates.iter().max_by(|a, b| a.fall_alone.total_cmp(&b.fall_alone))
    }
}

/// Scores of all kinds that `fit` has not fitted, by the robot, rig and poses that it was made from. None where it ended at no minimum, or
/// its residuals are the rounding of a file's digits.
pub fn unknown_scores(robot: &Robot, rig: &Rig, dataset: &Dataset, fit: &Fit) -> UnknownScores {
    /// A nanometre.
    const LEAST_M: f64 = 1e-9;
    if !fit.uncertainty.sigma_m.is_some_and(|seen_m| seen_m > LEAST_M) || !fit.solution.status.is_minimum() {
        return UnknownScores::default();
    }
    let fitted = fit.unknowns.kinds();
    let mut refused = Vec::new();
    let mut blocks: Vec<AnyBlock> = Vec::new();
    for kind in Kind::ALL.into_iter().filter(|kind| !fitted.contains(kind)) {
        match kind.block(robot, rig, dataset) {
            Ok(block) => blocks.push(block),
            Err(error) => refused.push((kind, NoScore::Lacks(error))),
        }
    }
    let beside = Beside::new(fit, dataset, blocks);
    let mut scores = Vec::new();
    for (at, (kind, range)) in beside.blocks.iter().enumerate() {
        let same = beside.blocks[..at].iter().find(|(_, other)| beside.are_the_same(other, range));
        let score = same.map_or_else(|| beside.score(*kind, range), |(other, _)| Err(NoScore::SameAs(*other)));
        match score {
            Ok(score) => scores.push(score),
            Err(reason) => refused.push((*kind, reason)),
        }
    }
    scores.sort_by(|a, b| b.deviations.total_cmp(&a.deviations));
    UnknownScores { scores, refused }
}
