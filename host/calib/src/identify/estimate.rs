//! The likeliest values of all free unknowns, by some rows and by what is believed beforehand.

use ballbar::LmOptions;
use nalgebra::DVector;

use super::beliefs::Beliefs;
use super::evidence::{Likeliest, Linear, likeliest};
use super::lm::{Objective, Solution, solve};
use super::observation::Observation;
use super::prior::{ChainPrior, Part, Share, Weighing};
use super::residual::{Residual, ResidualSummary};
use super::shared_errors::{Fitted, shared_errors};
use super::uncertainty::{Uncertainty, inverse_root};
use crate::model::PoseRow;
use crate::unknowns::Unknowns;

/// How estimates are made from any rows of one robot.
pub(super) struct Estimator<'a> {
    pub(super) unknowns: &'a Unknowns,
    pub(super) lm: LmOptions,
    /// Deviation of a length of weight one, metres, where it is stated or found out before.
    pub(super) stated_m: Option<f64>,
    /// Deviation to begin with, metres.
    pub(super) usual_m: f64,
    pub(super) rule: Rule<'a>,
}

/// Which unknowns are free, and what is believed of the chain.
pub(super) enum Rule<'a> {
    /// These, and nothing.
    Plain(Vec<usize>),
    /// By tolerances; the free ones are found anew when parts are released, which come first of those that could stand for one another.
    Prior { chain: &'a ChainPrior, free: &'a dyn Fn(&[usize]) -> Vec<usize> },
}

/// What an estimate came to.
#[derive(Clone, Debug)]
pub(super) struct Estimate {
    pub(super) beliefs: Beliefs,
    /// What beliefs were weighed against, metres.
    pub(super) sigma_m: f64,
    pub(super) weighing: Weighing,
    pub(super) released: Vec<Share>,
    pub(super) solution: Solution,
}

/// A part that changed by more of its tolerances is not as its tolerance says.
const BEYOND: f64 = 4.0;
/// Lengths that are off by more are wrong: however tight the tolerances, many lengths are not held back by as much.
const HOPELESS_M: f64 = 5e-3;
/// More parts than this are not lost: the lengths are wrong, or the design is.
const MOST_RELEASED: usize = 6;

impl Estimator<'_> {
    /// What is free and believed before anything is released.
    pub(super) fn first_beliefs(&self) -> Beliefs {
        match &self.rule {
            Rule::Plain(free) => Beliefs::without_chain(self.unknowns, free.clone()),
            Rule::Prior { chain, free } => Beliefs::new(self.unknowns, free(&[]), chain, &Weighing::as_stated()),
        }
    }

    /// From all these rows.
    pub(super) fn estimate(&self, rows: &[&PoseRow]) -> Estimate {
        match &self.rule {
            Rule::Plain(free) => {
                let beliefs = Beliefs::without_chain(self.unknowns, free.clone());
                let sigma_m = self.stated_m.unwrap_or(self.usual_m);
                let solution = self.solve(rows, &beliefs, sigma_m);
                Estimate { beliefs, sigma_m, weighing: Weighing::as_stated(), released: Vec::new(), solution }
            }
            Rule::Prior { chain, free } => {
                let mut estimate = self.weighed(rows, chain, free, Vec::new());
                for _ in 0..MOST_RELEASED {
                    if self.rms_m(rows, &estimate) > HOPELESS_M {
                        break;
                    }
                    let Some(next) = self.released_next(rows, chain, free, &estimate) else { break };
                    estimate = next;
                }
                estimate.released = estimate.shares(chain, &self.unknowns.start());
                estimate.released.retain(|share| estimate.weighing.released.contains(&share.part));
                estimate
            }
        }
    }

    /// The estimate with one part more released: of those that changed by far more than they may, the one that makes all the others likeliest.
    /// Where parts do the same, such as a joint's zero and a turn of the link behind it, the zero: that is what gets lost. `None` where all
    /// parts are as their tolerances say.
    fn released_next(
        &self,
        rows: &[&PoseRow],
        chain: &ChainPrior,
        free: &dyn Fn(&[usize]) -> Vec<usize>,
        before: &Estimate,
    ) -> Option<Estimate> {
        /// Costs that differ by less, of the fall that the best one brings, are alike.
        const ALIKE: f64 = 0.05;
        const TRIED: usize = 4;
        let start = self.unknowns.start();
        let mut beyond: Vec<Share> = before.shares(chain, &start);
        beyond.retain(|share| share.tolerances() > BEYOND && !before.weighing.released.contains(&share.part));
        beyond.sort_by(|a, b| b.tolerances().total_cmp(&a.tolerances()));
        beyond.truncate(TRIED);
        let tried = beyond.into_iter().map(|share| {
            let released = before.weighing.released.iter().copied().chain([share.part]).collect();
            let estimate = self.weighed(rows, chain, free, released);
            (self.cost(rows, chain, &estimate), estimate, matches!(share.part, Part::Offset(..)))
        });
        let is_robot = |estimate: &Estimate| {
            let shares = estimate.shares(chain, &start);
            let mut released = shares.iter().filter(|share| estimate.weighing.released.contains(&share.part));
            estimate.solution.status.is_minimum() && released.all(|share| chain.is_conceivable(share))
        };
        let tried: Vec<(f64, Estimate, bool)> = tried.filter(|(_, estimate, _)| is_robot(estimate)).collect();
        let best = tried.iter().map(|(cost, ..)| *cost).min_by(f64::total_cmp)?;
        let most = best + ALIKE * (self.cost(rows, chain, before) - best).max(0.0);
        let alike = tried.into_iter().filter(|(cost, ..)| *cost <= most);
        let found = alike.min_by(|a, b| b.2.cmp(&a.2).then(a.0.total_cmp(&b.0)))?;
        Some(found.1)
    }

    /// Weighed by evidence, with some parts released.
    fn weighed(
        &self,
        rows: &[&PoseRow],
        chain: &ChainPrior,
        free: &dyn Fn(&[usize]) -> Vec<usize>,
        released: Vec<Part>,
    ) -> Estimate {
        let first: Vec<usize> = released.iter().flat_map(|part| chain.indices(*part)).collect();
        let free = free(&first);
        let mut weighing = Weighing { factor: 1.0, released };
        let mut sigma_m = self.stated_m.unwrap_or(self.usual_m);
        let mut beliefs = Beliefs::new(self.unknowns, free.clone(), chain, &weighing);
        let mut solution = self.solve(rows, &beliefs, sigma_m);
        if solution.status.is_minimum()
            && let Some(found) = self.likeliest(rows, &solution.values, &beliefs, |factor| {
                Beliefs::new(self.unknowns, free.clone(), chain, &Weighing { factor, ..weighing.clone() })
            })
        {
            weighing.factor = found.factor;
            sigma_m = found.sigma_m;
            beliefs = Beliefs::new(self.unknowns, free, chain, &weighing);
            solution = self.solve(rows, &beliefs, sigma_m);
        }
        Estimate { beliefs, sigma_m, weighing, released: Vec::new(), solution }
    }

    fn likeliest(
        &self,
        rows: &[&PoseRow],
        values: &[f64],
        beliefs: &Beliefs,
        with_factor: impl Fn(f64) -> Beliefs,
    ) -> Option<Likeliest> {
        let observation = Observation::of(self.unknowns, values, rows, None);
        let jacobian = observation.columns(beliefs.free());
        let change = beliefs.change(values, &self.unknowns.start());
        let residual_m = observation.residual_m + &jacobian * DVector::from_vec(change);
        let linear = Linear { jacobian, residual_m, count: rows.len() };
        likeliest(&linear, |factor| with_factor(factor).proper_precision(self.unknowns), self.stated_m)
    }

    fn solve(&self, rows: &[&PoseRow], beliefs: &Beliefs, sigma_m: f64) -> Solution {
        solve(&Objective { unknowns: self.unknowns, rows, beliefs, sigma_m }, &self.lm)
    }

    /// Whether the solve came to nothing: no rows of a robot lead there, and none will be found among them.
    pub(super) fn is_hopeless(&self, rows: &[&PoseRow], estimate: &Estimate) -> bool {
        !estimate.solution.status.is_minimum() && self.rms_m(rows, estimate) > HOPELESS_M
    }

    fn rms_m(&self, rows: &[&PoseRow], estimate: &Estimate) -> f64 {
        let residuals = Residual::of_rows(self.unknowns, &estimate.solution.values, rows.iter().copied());
        ResidualSummary::new(&residuals).rms_m
    }

    /// `Σ w f²/σ² + changeᵀ Λ change` with tolerances as stated, to compare estimates with other parts released.
    fn cost(&self, rows: &[&PoseRow], chain: &ChainPrior, estimate: &Estimate) -> f64 {
        let sigma_m = self.stated_m.unwrap_or(self.usual_m);
        let values = &estimate.solution.values;
        let residuals = Residual::of_rows(self.unknowns, values, rows.iter().copied());
        let of_lengths: f64 = residuals.iter().map(|f| (f.whitened_m() / sigma_m).powi(2)).sum();
        let as_stated = Weighing { factor: 1.0, released: estimate.weighing.released.clone() };
        let beliefs = Beliefs::new(self.unknowns, estimate.beliefs.free().to_vec(), chain, &as_stated);
        of_lengths + beliefs.cost(values, &self.unknowns.start())
    }
}

impl Estimate {
    /// Deviations at the solution, by rows that it was made from: of plain least squares by what residuals show, beside a prior by what is stated.
    /// `own_m` is the deviation that lengths have of their own, where that is stated and may be so, metres.
    pub(super) fn uncertainty(
        &self,
        unknowns: &Unknowns,
        rows: &[&PoseRow],
        stated_m: Option<f64>,
        own_m: Option<f64>,
    ) -> Uncertainty {
        let Self { beliefs, sigma_m, solution, .. } = self;
        let free = beliefs.free();
        let observation = Observation::of(unknowns, &solution.values, rows, Some((beliefs, *sigma_m)));
        let mut uncertainty = Uncertainty::with_noise(&observation, free, stated_m);
        uncertainty.deviations_known = own_m.is_none().then_some(uncertainty.freedom);
        let believed = observation.beliefs.select_columns(free);
        let root = inverse_root(&uncertainty.spectrum);
        let fitted = Fitted { unknowns, values: &solution.values, beliefs, sigma_m: *sigma_m, believed: &believed, root: &root };
        match uncertainty.sigma_m.and_then(|seen_m| shared_errors(&fitted, rows, seen_m, own_m)) {
            Some(found) => uncertainty.with_shared_errors(found),
            None => uncertainty,
        }
    }

    fn shares(&self, chain: &ChainPrior, start: &[f64]) -> Vec<Share> {
        let free = self.beliefs.free();
        let of_chain = free.partition_point(|&index| index < chain.parameters());
        let change = self.beliefs.change(&self.solution.values, start);
        chain.shares(&free[..of_chain], &change[..of_chain], &self.weighing)
    }
}
