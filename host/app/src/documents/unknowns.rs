//! What else may be unknown than what was fitted, and what was taken in by itself.

use ballbar_calib::identify::{PayingUnknowns, ScoreEstimate, TriedKind, UnknownScore, UnknownScores};
use serde::Serialize;

use crate::units::{ScreenUnit, mm_from_m};

/// Kinds of unknowns beside a fit.
#[derive(Clone, Debug, Default, Serialize)]
pub struct UnknownsDocument {
    /// Kinds that were taken in because they pay, in order; none where nobody asked.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub taken: Vec<TriedLine>,
    /// Kinds that explain residuals, but predict poses left out no better by more than the standard error.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left: Vec<TriedLine>,
    /// Kinds that would explain what residuals are left, and that noise would hardly bring; the most significant first.
    pub would_explain: Vec<ScoreLine>,
    /// Kinds that cannot be told, and why.
    pub cannot_tell: Vec<CannotTell>,
}

/// What a kind would explain.
#[derive(Clone, Debug, Serialize)]
pub struct ScoreLine {
    /// The kind's name.
    pub kind: &'static str,
    /// A sentence.
    pub sentence: String,
    /// By how much the sum of squares would fall, in variances of a length.
    pub fall: f64,
    /// Effective degrees of freedom.
    pub freedom: f64,
    /// Probability of as much where nothing is off.
    pub p_value: f64,
    /// Standard deviations of a normal value that is as improbable.
    pub deviations: f64,
    /// What its unknowns would be.
    pub estimates: Vec<EstimateLine>,
}

/// What an unknown would be, in the units of the screen.
#[derive(Clone, Debug, Serialize)]
pub struct EstimateLine {
    /// Its name.
    pub name: String,
    /// Unit of the values.
    pub unit: &'static str,
    /// The value.
    pub value: f64,
    /// Its standard deviation.
    pub std: f64,
}

/// A kind that was tried.
#[derive(Clone, Debug, Serialize)]
pub struct TriedLine {
    /// What would have explained the residuals before.
    #[serde(flatten)]
    pub score: ScoreLine,
    /// What it would be: `a bar zero of +0.825 mm`.
    #[serde(skip)]
    pub what: String,
    /// RMS of poses left out in turn without it.
    pub left_out_before_mm: f64,
    /// With it.
    pub left_out_mm: f64,
    /// Fall of their mean square, in its standard errors.
    pub gain: f64,
}

/// A kind that cannot be told.
#[derive(Clone, Debug, Serialize)]
pub struct CannotTell {
    /// The kind's name.
    pub kind: &'static str,
    /// Why.
    pub why: String,
}

impl UnknownsDocument {
    /// Of what was taken, where that was asked for, and of what else there may be.
    pub fn new(paying: Option<&PayingUnknowns>, scores: &UnknownScores) -> Self {
        let lines = |tried: &[TriedKind]| tried.iter().map(TriedLine::new).collect();
        Self {
            taken: paying.map_or_else(Vec::new, |paying| lines(&paying.taken)),
            left: paying.map_or_else(Vec::new, |paying| lines(&paying.left)),
            would_explain: scores.significant().map(ScoreLine::new).collect(),
            cannot_tell: scores
                .refused
                .iter()
                .map(|(kind, why)| CannotTell { kind: kind.name(), why: why.to_string() })
                .collect(),
        }
    }
}

impl ScoreLine {
    fn new(score: &UnknownScore) -> Self {
        let UnknownScore { kind, fall, freedom, p_value, deviations, ref estimates } = *score;
        let estimates = estimates.iter().map(EstimateLine::new).collect();
        Self { kind: kind.name(), sentence: score.to_string(), fall, freedom, p_value, deviations, estimates }
    }
}

impl EstimateLine {
    fn new(estimate: &ScoreEstimate) -> Self {
        let unit = ScreenUnit::from(estimate.unit);
        let (value, std) = (unit.from_si(estimate.value), unit.from_si(estimate.std));
        Self { name: estimate.name.clone(), unit: unit.name(), value, std }
    }
}

impl TriedLine {
    fn new(tried: &TriedKind) -> Self {
        Self {
            score: ScoreLine::new(&tried.score),
            what: tried.score.what(),
            left_out_before_mm: mm_from_m(tried.left_out_before_m),
            left_out_mm: mm_from_m(tried.left_out_m),
            gain: tried.gain,
        }
    }
}
