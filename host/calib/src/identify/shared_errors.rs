//! Errors that the lengths of one configuration share, because its joints stand elsewhere than they say.
//!
//! Of rows scaled to weight one, those of a configuration deviate by `V = σ² I + τ² G Gᵀ`, where a row of `G` has what each joint's angle adds to
//! the length. `G Gᵀ = U S² Uᵀ` turns them into directions that are independent, `y = Uᵀ [J f]`, with variances `σ² + τ² s²`. So sums over
//! rows become those of independent ones less what the directions weigh less, whatever τ: `Σ y yᵀ ρ²s²/(1 + ρ²s²)` for `ρ = τ/σ`.

use ballbar::ParameterKind;
use nalgebra::{DMatrix, DVector};

use super::beliefs::Beliefs;
use super::evidence::golden_section;
use super::lines::lines;
use super::postures::postures;
use crate::model::PoseRow;
use crate::unknowns::Unknowns;

/// How far joints stand from where they say, anew in each configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SharedErrors {
    /// Standard deviation of each joint, radians; a prismatic joint's metre counts as a radian.
    pub joint: f64,
    /// What a length of weight one deviates by besides, metres.
    pub own_m: f64,
    /// By how much likelier the lengths are than without (natural logarithm).
    pub gain: f64,
    /// Degrees of freedom with which `joint` is known.
    pub freedom: f64,
    /// By how much larger they make the deviations of parameters than independent lengths that scatter as much would: the median.
    pub factor: f64,
}

impl SharedErrors {
    /// Whether chance makes lengths look so in less than one of ten thousand datasets.
    pub fn are_certain(&self) -> bool {
        const CERTAIN: f64 = 7.0;
        self.gain > CERTAIN
    }
}

/// What is known of the fit that the lengths belong to.
pub(super) struct Fitted<'a> {
    pub(super) unknowns: &'a Unknowns,
    pub(super) values: &'a [f64],
    pub(super) beliefs: &'a Beliefs,
    /// What beliefs were weighed against, metres.
    pub(super) sigma_m: f64,
    /// Beliefs as rows of `√w J`, over the free unknowns.
    pub(super) believed: &'a DMatrix<f64>,
    /// `R` with `R Rᵀ = (JᵀWJ + σ²Λ)⁺`.
    pub(super) root: &'a DMatrix<f64>,
}

/// What was found of them, and what it means for the fit.
pub(super) struct Found {
    /// Its factor is still to be found.
    pub(super) errors: SharedErrors,
    /// Covariance of `R⁻¹ · unknowns`.
    pub(super) covariance: DMatrix<f64>,
    /// What of it is due to the shared errors.
    pub(super) of_shared: DMatrix<f64>,
}

/// One direction of a configuration's lengths: how much joints move it, squared, and what it says.
struct Direction {
    s2: f64,
    /// `[J R, f]`.
    row: DVector<f64>,
}

/// A nanometre: below it, residuals are the rounding of a file's digits.
const LEAST_SIGMA_M: f64 = 1e-9;

/// By restricted maximum likelihood: the unknowns, of which the beliefs say what they say, are integrated out (H. D. Patterson and R. Thompson,
/// Biometrika 58, 1971). `known_m` is the deviation of independent lengths, where it is stated. `None` where no configuration has two lengths, or
/// where these show no error that they share.
pub(super) fn shared_errors(fitted: &Fitted<'_>, rows: &[&PoseRow], seen_m: f64, known_m: Option<f64>) -> Option<Found> {
    let kinds = fitted.unknowns.of_chain().design().joint_kinds();
    let configurations = postures(kinds, rows.iter().map(|row| &row.measurement.q));
    let count = configurations.iter().max().map_or(0, |last| last + 1);
    if count == rows.len() || seen_m < LEAST_SIGMA_M {
        return None;
    }
    let likelihood = Likelihood::new(fitted, rows, &configurations, count);
    likelihood.found(seen_m, known_m)
}

struct Likelihood {
    rows: usize,
    /// `Σ [J R, f]ᵀ [J R, f]` of independent rows.
    square: DMatrix<f64>,
    directions: Vec<Direction>,
    /// `Rᵀ Λ R` and `Rᵀ Λ · change` per square metre.
    precision: DMatrix<f64>,
    pull: DVector<f64>,
    sigma_m: f64,
}

impl Likelihood {
    fn new(fitted: &Fitted<'_>, rows: &[&PoseRow], configurations: &[usize], count: usize) -> Self {
        let Fitted { unknowns, values, beliefs, sigma_m, believed, root } = *fitted;
        let joints = unknowns.of_chain().design().joints();
        let offsets = (0..joints).filter_map(|joint| ballbar::Parameter::new(joint + 1, ParameterKind::Offset));
        let wanted: Vec<usize> = beliefs.free().iter().copied().chain(offsets.map(|offset| offset.index())).collect();
        let free = beliefs.free().len();
        let (all, residual_m) = lines(unknowns, values, rows, &wanted);
        let (jacobian, by_joint) = (all.columns(0, free), all.columns(free, joints));
        let mut own = (jacobian * root).resize_horizontally(root.ncols() + 1, 0.0);
        own.set_column(root.ncols(), &residual_m);

        let mut rows_of = vec![Vec::new(); count];
        configurations.iter().enumerate().for_each(|(row, &configuration)| rows_of[configuration].push(row));
        let directions = rows_of.iter().flat_map(|rows| directions(&by_joint.select_rows(rows), &own.select_rows(rows)));
        let prior = believed * root;
        let variance = sigma_m * sigma_m;
        let change = DVector::from_vec(beliefs.change(values, &unknowns.start()));
        let pull = if prior.is_empty() { DVector::zeros(root.ncols()) } else { prior.tr_mul(&(believed * change)) / variance };
        let precision = prior.tr_mul(&prior) / variance;
        Self { rows: rows.len(), square: own.tr_mul(&own), directions: directions.collect(), precision, pull, sigma_m }
    }

    fn found(&self, seen_m: f64, known_m: Option<f64>) -> Option<Found> {
        /// Joints' errors, in the lengths, beside those that lengths have of their own.
        const RATIOS: (f64, f64) = (0.03, 300.0);
        const COARSE: usize = 8;
        /// Of a logarithm, for the curvature.
        const STEP: f64 = 0.25;
        let s2: f64 = self.directions.iter().map(|direction| direction.s2).sum();
        if s2 <= 0.0 {
            return None;
        }
        let unit = (self.rows as f64 / s2).sqrt();
        // Of what lengths deviate by in all, τ is what own errors leave: so both stay apart.
        let at = |log_ratio: f64| self.likeliest_own(log_ratio.exp() * unit, seen_m, known_m);
        let (low, high) = (RATIOS.0.ln(), RATIOS.1.ln());
        let step = (high - low) / (COARSE - 1) as f64;
        let coarse = (0..COARSE).map(|i| low + step * i as f64).map(|log| (log, at(log).1));
        let (best, _) = coarse.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let log_ratio = golden_section(|log| -at(log).1, (best - step).max(low), (best + step).min(high), 0.05);
        let (own_m, likelihood) = at(log_ratio);
        let gain = likelihood - self.likeliest_own(0.0, seen_m, known_m).1;
        if !gain.is_finite() || gain <= 0.0 {
            return None;
        }
        let curvature = (2.0 * likelihood - at(log_ratio - STEP).1 - at(log_ratio + STEP).1) / (STEP * STEP);
        let joint = log_ratio.exp() * unit * own_m;
        let size = self.precision.nrows();
        let mut of_shared = DMatrix::zeros(size, size);
        for Direction { s2, row } in &self.directions {
            of_shared.ger(joint * joint * s2, &row.rows(0, size), &row.rows(0, size), 1.0);
        }
        let own = self.square.view((0, 0), (size, size)) * (own_m * own_m);
        let covariance = own + &self.precision * self.sigma_m.powi(4) + &of_shared;
        // A variance known with ν degrees of freedom has a logarithm of variance 2/ν; that of τ² is four times that of τ.
        let freedom = (curvature / 2.0).max(1.0);
        Some(Found { errors: SharedErrors { joint, own_m, gain, freedom, factor: 1.0 }, covariance, of_shared })
    }

    /// The likeliest deviation of independent lengths beside joints' errors of `ratio` times it, and the logarithm of the likelihood there.
    fn likeliest_own(&self, ratio: f64, seen_m: f64, known_m: Option<f64>) -> (f64, f64) {
        let weighed = self.weighed(ratio);
        if let Some(own_m) = known_m {
            return (own_m, self.likelihood(&weighed, own_m));
        }
        let (low, high) = ((seen_m * 1e-3).max(LEAST_SIGMA_M / 10.0).ln(), (2.0 * seen_m).ln());
        let own_m = golden_section(|log| -self.likelihood(&weighed, log.exp()), low, high, 0.01).exp();
        (own_m, self.likelihood(&weighed, own_m))
    }

    /// `Σ [J R, f]ᵀ V⁻¹ [J R, f]` and the logarithm of the determinant of `V`, of deviations in units of σ.
    fn weighed(&self, ratio: f64) -> (DMatrix<f64>, f64) {
        let (mut square, mut log_det) = (self.square.clone(), 0.0);
        for Direction { s2, row } in &self.directions {
            let variance = ratio * ratio * s2;
            square.ger(-variance / (1.0 + variance), row, row, 1.0);
            log_det += variance.ln_1p();
        }
        (square, log_det)
    }

    fn likelihood(&self, (square, log_det): &(DMatrix<f64>, f64), own_m: f64) -> f64 {
        let size = self.precision.nrows();
        let variance = own_m * own_m;
        let information = square.view((0, 0), (size, size)) / variance + &self.precision;
        let Some(root) = information.cholesky() else { return f64::NEG_INFINITY };
        // The columns are those of what is computed, measured less computed the residual.
        let pull = square.view((0, size), (size, 1)).column(0) / variance - &self.pull;
        let explained = pull.dot(&root.solve(&pull));
        let left = square[(size, size)] / variance - explained;
        let of_unknowns = 2.0 * root.l_dirty().diagonal().iter().map(|entry| entry.ln()).sum::<f64>();
        -0.5 * (self.rows as f64 * variance.ln() + log_det + of_unknowns + left)
    }
}

/// Of one configuration, by `U S² Uᵀ = G Gᵀ`: those that joints move.
fn directions(by_joint: &DMatrix<f64>, lines: &DMatrix<f64>) -> Vec<Direction> {
    /// Of the largest; below it joints do not move a direction.
    const STILL: f64 = 1e-12;
    let (rows, joints) = by_joint.shape();
    let is_few = rows <= joints;
    let eigen = if is_few { by_joint * by_joint.transpose() } else { by_joint.tr_mul(by_joint) }.symmetric_eigen();
    let largest = eigen.eigenvalues.amax();
    let moved = (0..eigen.eigenvalues.len()).filter(|&k| eigen.eigenvalues[k] > STILL * largest);
    let direction = |k: usize| {
        let (s2, vector) = (eigen.eigenvalues[k], eigen.eigenvectors.column(k));
        let row = if is_few { lines.tr_mul(&vector) } else { lines.tr_mul(&(by_joint * vector)) / s2.sqrt() };
        Direction { s2, row }
    };
    moved.map(direction).collect()
}
