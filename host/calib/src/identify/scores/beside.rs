//! Candidates beside a fit, by linear theory at its solution.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::{NoScore, ScoreEstimate, UnknownScore};
use crate::identify::fit::Fit;
use crate::identify::identifiability::mimics;
use crate::identify::noise::NoiseTest;
use crate::identify::observation::Observation;
use crate::identify::pivoting::PivotedColumns;
use crate::identify::spectrum::{RANK_THRESHOLD, Spectrum, column_scales};
use crate::identify::tail::{deviations, ln_chi2_tail, ln_f_tail};
use crate::model::{Dataset, PoseRow};
use crate::unknowns::{AnyBlock, Kind, Unknown, Unknowns};

/// What is known of the noise.
#[derive(Clone, Copy, Debug)]
enum Noise {
    /// Standard deviation of a length of weight one, metres, as it is stated.
    Stated(f64),
    /// Sum of the squares that the fit leaves, square metres, and their degrees of freedom.
    Seen { square_m2: f64, freedom: f64 },
}

/// Candidates beside what was fitted.
pub(super) struct Beside {
    unknowns: Unknowns,
    /// Of lengths alone, over all unknowns.
    observation: Observation,
    /// The candidates, by their unknowns.
    pub(super) blocks: Vec<(Kind, Range<usize>)>,
    /// What of the fit moves independently.
    independent: Vec<usize>,
    /// `Xᵀ (I − H) X` and `Xᵀ f` of all candidates.
    left: DMatrix<f64>,
    pull: DVector<f64>,
    /// Index of the first candidate.
    first: usize,
    noise: Noise,
}

impl Beside {
    pub(super) fn new(fit: &Fit, dataset: &Dataset, blocks: Vec<AnyBlock>) -> Self {
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
        let scales = column_scales(&observation.jacobian);
        let scaled = DMatrix::from_fn(observation.jacobian.nrows(), moving.len(), |row, column| {
            observation.jacobian[(row, moving[column])] / scales[moving[column]]
        });
        let PivotedColumns { order, basis, .. } = PivotedColumns::new(scaled, RANK_THRESHOLD);
        let columns = observation.jacobian.columns(first, unknowns.list().len() - first);
        let columns = columns - &basis * basis.tr_mul(&columns);
        let residual_m = &observation.residual_m - &basis * basis.tr_mul(&observation.residual_m);
        let left = columns.tr_mul(&columns);
        let pull = columns.tr_mul(&residual_m);

        let freedom = (rows.len() as f64 - basis.ncols() as f64).max(0.0);
        let seen_m = (residual_m.norm_squared() / freedom.max(1.0)).sqrt();
        let seen = Noise::Seen { square_m2: seen_m * seen_m * freedom, freedom };
        let is_believed = |stated_m: &f64| !NoiseTest::new(seen_m, *stated_m, freedom).is_some_and(|test| test.is_more());
        let noise = dataset.stated_sigma_m().filter(is_believed).map_or(seen, Noise::Stated);
        let independent = order.into_iter().map(|column| moving[column]).collect();
        Self { unknowns, observation, blocks, independent, left, pull, first, noise }
    }

    /// Whether two candidates change the lengths in the same ways.
    pub(super) fn are_the_same(&self, a: &Range<usize>, b: &Range<usize>) -> bool {
        let rank = |indices: Vec<usize>| Spectrum::of_columns(&self.observation.jacobian, &indices).rank;
        let (of_a, of_b) = (rank(a.clone().collect()), rank(b.clone().collect()));
        of_a > 0 && of_a == of_b && of_a == rank(a.clone().chain(b.clone()).collect())
    }

    pub(super) fn score(&self, kind: Kind, range: &Range<usize>) -> Result<UnknownScore, NoScore> {
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
        let with = mimics(jacobian, &self.independent, largest);
        const SHOWN: usize = 4;
        NoScore::ActsLike { with: with.into_iter().take(SHOWN).map(|index| self.unknowns.list()[index].name.clone()).collect() }
    }
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
