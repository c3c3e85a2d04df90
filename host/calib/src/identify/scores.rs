//! What would explain the residuals that was not fitted: a score test of each kind of unknowns, by linear theory at the solution.
//!
//! With columns `J` of what is fitted and `X` of a kind beside it, residuals `f` of variance `σ²`, and beliefs `Λ` and `Π = diag(1/tolerance²)`:
//!
//! ```text
//! H = J (JᵀJ + σ²Λ)⁻¹ Jᵀ     what the fit follows of lengths; its beliefs are in its covariance already
//! M = Xᵀ (I − H) X,  g = Xᵀ f     what the fit cannot follow of the kind, and what is left for it
//! found = (M + σ²Π)⁻¹ g,  fall of χ² = gᵀ (M + σ²Π)⁻¹ g / σ²
//! ```
//!
//! Where nothing is off, `g` has covariance `σ² M`, and the fall is `Σ wᵢ zᵢ²` of independent normal `z`, with `w` the eigenvalues of
//! `(M + σ²Π)⁻¹ M`: 1 for what lengths decide, 0 for what belief does. A chi-square of `(Σw)²/Σw²` degrees of freedom, scaled, stands for it
//! (F. E. Satterthwaite, Biometrics Bulletin 2, 1946); Fisher's F where the residuals say what the noise is.

use std::fmt;
use std::ops::Range;

use ballbar::ParameterUnit;
use nalgebra::{DMatrix, DVector};

use super::fit::Fit;
use super::identifiability::mimics;
use super::observation::Observation;
use super::pivoting::PivotedColumns;
use super::spectrum::{RANK_THRESHOLD, Spectrum, column_scales};
use super::tail::{deviations, ln_chi2_tail, ln_f_tail};
use crate::model::{Dataset, PoseRow, Rig, Robot};
use crate::units::ScreenUnit;
use crate::unknowns::{AnyBlock, Kind, Unknown, UnknownError, Unknowns};

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

impl fmt::Display for NoScore {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lacks(error) => error.fmt(f),
            Self::NoEffect => f.write_str("no length of these poses changes with it"),
            Self::ActsLike { with } => write!(f, "in these poses it acts like {}", with.join(", ")),
            Self::SameAs(kind) => write!(f, "in these poses it is the same as {}", kind.name()),
            Self::TooFew => f.write_str("too few lengths are left to tell it from noise"),
        }
    }
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

    /// What it would be: `a bar zero of +0.825 mm`, or `joints that yield to gravity, most of all compliance2 of +0.00057 deg/Nm`.
    pub fn what(&self) -> String {
        match self.largest() {
            Some(only) if self.estimates.len() == 1 => format!("a {} of {only}", one(self.kind)),
            Some(largest) => format!("{}, most of all {} of {largest}", several(self.kind), largest.name),
            None => several(self.kind).to_owned(),
        }
    }
}

impl fmt::Display for UnknownScore {
    /// A sentence without its full stop.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let comma = if self.estimates.len() == 1 { "" } else { "," };
        write!(f, "{}{comma} would explain them, {:.0} standard deviations", self.what(), self.deviations)
    }
}

impl fmt::Display for ScoreEstimate {
    /// Value and unit, with the digits that its deviation leaves.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = ScreenUnit::from(self.unit);
        let digits = (1.0 - unit.from_si(self.std).abs().log10().floor()).clamp(0.0, 9.0) as usize;
        write!(f, "{:+.digits$}", unit.from_si(self.value))?;
        if unit == ScreenUnit::One { Ok(()) } else { write!(f, " {}", unit.name()) }
    }
}

/// One unknown of a kind, to follow "a".
fn one(kind: Kind) -> &'static str {
    match kind {
        Kind::BarZero => "bar zero",
        Kind::RodZeros => "zero of the rod",
        Kind::BarGain => "bar gain",
        Kind::Latency => "latency",
        Kind::Rig => "place of a chuck or sphere",
        Kind::Sets => "set's offset",
        Kind::Drift => "drift from the first length to the last",
        Kind::Compliance => "joint's compliance",
        Kind::Eccentricity => "disc's eccentricity",
        Kind::Backlash => "joint's backlash",
    }
}

/// Several of them.
fn several(kind: Kind) -> &'static str {
    match kind {
        Kind::BarZero => "bar zeros",
        Kind::RodZeros => "a zero of each rod",
        Kind::BarGain => "bar gains",
        Kind::Latency => "latencies",
        Kind::Rig => "chucks and spheres in other places",
        Kind::Sets => "an offset of each set",
        Kind::Drift => "drifts",
        Kind::Compliance => "joints that yield to gravity",
        Kind::Eccentricity => "encoders' discs off their axes",
        Kind::Backlash => "backlash of joints",
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

/// What is known of the noise.
#[derive(Clone, Copy, Debug)]
enum Noise {
    /// Standard deviation of a length of weight one, metres, as it is stated.
    Stated(f64),
    /// Sum of the squares that the fit leaves, square metres, and their degrees of freedom.
    Seen { square_m2: f64, freedom: f64 },
}

/// Candidates beside what was fitted.
struct Beside {
    unknowns: Unknowns,
    /// Of lengths alone, over all unknowns.
    observation: Observation,
    /// The candidates, by their unknowns.
    blocks: Vec<(Kind, Range<usize>)>,
    /// What moves in the fit.
    moving: Vec<usize>,
    /// `Xᵀ (I − H) X` and `Xᵀ f` of all candidates.
    left: DMatrix<f64>,
    pull: DVector<f64>,
    /// Index of the first candidate.
    first: usize,
    noise: Noise,
}

impl Beside {
    fn new(fit: &Fit, dataset: &Dataset, blocks: Vec<AnyBlock>) -> Self {
        let first = fit.unknowns.list().len();
        let kinds: Vec<Kind> = blocks.iter().map(AnyBlock::kind).collect();
        let unknowns = fit.unknowns.with(blocks);
        let sizes = unknowns.sizes();
        let mut next = first;
        let ranges = sizes[sizes.len() - kinds.len()..].iter().map(|size| {
            next += size;
            next - size..next
        });
        let blocks: Vec<(Kind, Range<usize>)> = kinds.into_iter().zip(ranges).collect();

        // Rows that the fit has left out have no weight.
        let rows: Vec<&PoseRow> =
            dataset.rows.iter().zip(&fit.residuals).filter(|(_, f)| f.weight > 0.0).map(|(row, _)| row).collect();
        let starts = unknowns.list()[first..].iter().map(|unknown| unknown.start);
        let values: Vec<f64> = fit.solution.values.iter().copied().chain(starts).collect();
        let observation = Observation::of(&unknowns, &values, &rows, None);

        let moving: Vec<usize> = (0..first).filter(|&index| fit.parameters[index].held.is_none()).collect();
        // What beliefs say of the fitted ones is left aside: where they are wrong, it would look like something else that was not fitted.
        let scales = column_scales(&observation.jacobian);
        let scaled = DMatrix::from_fn(observation.jacobian.nrows(), moving.len(), |row, column| {
            observation.jacobian[(row, moving[column])] / scales[moving[column]]
        });
        let basis = PivotedColumns::new(scaled, RANK_THRESHOLD).basis;
        let columns = observation.jacobian.columns(first, unknowns.list().len() - first);
        let columns = columns - &basis * basis.tr_mul(&columns);
        let residual_m = &observation.residual_m - &basis * basis.tr_mul(&observation.residual_m);
        let left = columns.tr_mul(&columns);
        let pull = columns.tr_mul(&residual_m);

        let freedom = (rows.len() as f64 - basis.ncols() as f64).max(0.0);
        let seen_m = (residual_m.norm_squared() / freedom.max(1.0)).sqrt();
        let seen = Noise::Seen { square_m2: seen_m * seen_m * freedom, freedom };
        let noise =
            dataset.stated_sigma_m().filter(|stated_m| !is_beyond(*stated_m, seen_m, freedom)).map_or(seen, Noise::Stated);
        Self { unknowns, observation, blocks, moving, left, pull, first, noise }
    }

    /// Whether two candidates change the lengths in the same ways.
    fn are_the_same(&self, a: &Range<usize>, b: &Range<usize>) -> bool {
        let rank = |indices: Vec<usize>| Spectrum::of_columns(&self.observation.jacobian, &indices).rank;
        let (of_a, of_b) = (rank(a.clone().collect()), rank(b.clone().collect()));
        of_a > 0 && of_a == of_b && of_a == rank(a.clone().chain(b.clone()).collect())
    }

    fn score(&self, kind: Kind, range: &Range<usize>) -> Result<UnknownScore, NoScore> {
        let unknowns = &self.unknowns.list()[range.clone()];
        let (from, size) = (range.start - self.first, range.len());
        let left = self.left.view((from, from), (size, size)).into_owned();
        let pull = self.pull.rows(from, size).into_owned();
        let whole = |index: usize| self.observation.jacobian.column(index).norm();
        if range.clone().all(|index| whole(index) == 0.0) {
            return Err(NoScore::NoEffect);
        }
        let found = match self.noise {
            Noise::Stated(sigma_m) => Found::new(unknowns, &left, &pull, sigma_m * sigma_m),
            // What the kind explains is no noise.
            Noise::Seen { square_m2, freedom } => {
                let mut found = Found::new(unknowns, &left, &pull, square_m2 / freedom);
                for _ in 0..2 {
                    let rest = freedom - found.freedom;
                    if rest < 1.0 {
                        return Err(NoScore::TooFew);
                    }
                    found = Found::new(unknowns, &left, &pull, (square_m2 - found.fall_m2).max(0.0) / rest);
                }
                found
            }
        };
        /// Lengths tell at least as much of something as is believed of it already.
        const TOLD: f64 = 0.5;
        if found.weights.max() < TOLD {
            return Err(self.acts_like(range));
        }
        Ok(found.score(kind, unknowns, self.noise))
    }

    /// What does to lengths as the largest of some unknowns does.
    fn acts_like(&self, range: &Range<usize>) -> NoScore {
        let jacobian = &self.observation.jacobian;
        let effect = |index: &usize| jacobian.column(*index).norm() * self.unknowns.list()[*index].plausible;
        let largest = range.clone().max_by(|a, b| effect(a).total_cmp(&effect(b))).unwrap_or(range.start);
        let scales = column_scales(jacobian);
        let scaled = DMatrix::from_fn(jacobian.nrows(), self.moving.len(), |row, column| {
            jacobian[(row, self.moving[column])] / scales[self.moving[column]]
        });
        let independent = PivotedColumns::new(scaled, RANK_THRESHOLD).order.into_iter().map(|column| self.moving[column]);
        let with = mimics(jacobian, &independent.collect::<Vec<_>>(), largest);
        const SHOWN: usize = 4;
        NoScore::ActsLike { with: with.into_iter().take(SHOWN).map(|index| self.unknowns.list()[index].name.clone()).collect() }
    }
}

/// Whether residuals are surely larger than is stated.
fn is_beyond(stated_m: f64, seen_m: f64, freedom: f64) -> bool {
    freedom > 0.0 && ln_chi2_tail(freedom * (seen_m / stated_m).powi(2), freedom) < (0.5 * SIGNIFICANT).ln()
}

/// The unknowns of one kind as the residuals have them, beside noise of one size.
struct Found {
    values: DVector<f64>,
    std: DVector<f64>,
    /// `g² / (M + σ²Π)` of each, square metres.
    fall_alone_m2: DVector<f64>,
    /// `gᵀ (M + σ²Π)⁻¹ g`, square metres.
    fall_m2: f64,
    /// `σ²`, square metres.
    variance: f64,
    weights: DVector<f64>,
    /// `Σ w`.
    freedom: f64,
}

impl Found {
    fn new(unknowns: &[Unknown], left: &DMatrix<f64>, pull: &DVector<f64>, variance: f64) -> Self {
        // In units of what is believed over the noise, so that belief is the identity. Of what nobody has said how well it is known, only what
        // is plausible is believed.
        let believed =
            |unknown: &Unknown| unknown.tolerance.unwrap_or(unknown.plausible) / variance.sqrt().max(f64::MIN_POSITIVE);
        let scale = DVector::from_iterator(unknowns.len(), unknowns.iter().map(believed));
        let scaled = DMatrix::from_fn(left.nrows(), left.ncols(), |i, j| scale[i] * left[(i, j)] * scale[j]);
        let eigen = scaled.symmetric_eigen();
        let told = eigen.eigenvalues.map(|value| value.max(0.0));
        let along = eigen.eigenvectors.tr_mul(&pull.component_mul(&scale));
        let weights = told.map(|value| value / (1.0 + value));
        let root =
            DMatrix::from_fn(scale.len(), told.len(), |i, k| scale[i] * eigen.eigenvectors[(i, k)] / (1.0 + told[k]).sqrt());
        let shrunk = along.zip_map(&told, |along, told| along / (1.0 + told).sqrt());
        let std = DVector::from_iterator(scale.len(), root.row_iter().map(|row| variance.sqrt() * row.norm()));
        let fall_alone_m2 =
            DVector::from_fn(scale.len(), |i, _| (scale[i] * pull[i]).powi(2) / (scale[i].powi(2) * left[(i, i)].max(0.0) + 1.0));
        Self {
            values: &root * &shrunk,
            std,
            fall_alone_m2,
            fall_m2: shrunk.norm_squared(),
            variance,
            freedom: weights.sum(),
            weights,
        }
    }

    fn score(&self, kind: Kind, unknowns: &[Unknown], noise: Noise) -> UnknownScore {
        let squares = self.weights.norm_squared();
        let freedom = self.freedom * self.freedom / squares;
        let ln_p = match noise {
            Noise::Stated(_) => ln_chi2_tail(self.fall_m2 / self.variance * self.freedom / squares, freedom),
            Noise::Seen { freedom: all, .. } => {
                ln_f_tail(self.fall_m2 / self.variance / self.freedom, freedom, (all - self.freedom).max(1.0))
            }
        };
        let estimates = unknowns.iter().enumerate().map(|(i, unknown)| ScoreEstimate {
            name: unknown.name.clone(),
            unit: unknown.unit,
            value: unknown.start + self.values[i],
            std: self.std[i],
            fall_alone: self.fall_alone_m2[i] / self.variance,
        });
        UnknownScore {
            kind,
            fall: self.fall_m2 / self.variance,
            freedom: self.freedom,
            p_value: ln_p.exp(),
            deviations: deviations(ln_p),
            estimates: estimates.collect(),
        }
    }
}
