//! The solve: a dataset as a least-squares problem over the wanted unknowns, for the Levenberg-Marquardt that board and host share.

use ballbar::{
    Chain, ConvergenceTest, FreeParameters, Lengths, LmOptions, Measurement, NormalEquations, Precision, Problem, Status,
    lm_memory, minimise,
};

use super::beliefs::Beliefs;
use crate::model::PoseRow;
use crate::unknowns::Unknowns;

/// What is minimised: `Σ w (d_measured − d_computed)² + σ² · changeᵀ Λ change` over some of the unknowns; the others stay where they are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Objective<'a> {
    /// All unknowns.
    pub(super) unknowns: &'a Unknowns,
    /// The rows that count.
    pub(super) rows: &'a [&'a PoseRow],
    /// Which unknowns may change, and what is believed of them.
    pub(super) beliefs: &'a Beliefs,
    /// Deviation of a length of weight one, metres: what beliefs are weighed against. Without meaning where there are none.
    pub(super) sigma_m: f64,
}

/// Where a solve ended.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Solution {
    /// Why it ended.
    pub status: Status,
    /// The chain with the best values seen.
    pub chain: Chain<f64>,
    /// The best values seen of all unknowns, SI; those that were not free at their start.
    pub values: Vec<f64>,
    /// Weighted RMS residual at the start and after each step, metres.
    pub rms_history_m: Vec<f64>,
}

impl Solution {
    /// Steps from the start to where the solve ended. Those that were tried and lowered nothing are not among them.
    pub fn steps(&self) -> usize {
        self.rms_history_m.len().saturating_sub(1)
    }
}

/// Minimises an objective, beginning with what the unknowns are believed to be, after K. Levenberg (1944) and D. W. Marquardt (1963), the paper's
/// eq. 7 and 10. Never fails: [`Status`] says where it ended.
pub(super) fn solve(objective: &Objective<'_>, options: &LmOptions) -> Solution {
    solve_from(objective, objective.unknowns.start(), options)
}

/// The same from other values.
pub(super) fn solve_from(objective: &Objective<'_>, from: Vec<f64>, options: &LmOptions) -> Solution {
    let start = objective.unknowns.start();
    let problem = Believed { objective, precision: objective.beliefs.packed(objective.sigma_m), start: &start };
    let mut rms_history_m = Vec::new();
    let mut memory = vec![0.0; lm_memory::<f64>(problem.unknowns())];
    let minimum = minimise(&problem, from.clone(), options, &mut memory, |rms_m| rms_history_m.push(rms_m));
    let (status, values) = match minimum {
        Ok(minimum) => (minimum.status, minimum.values),
        // The memory is as long as was asked for.
        Err(_) => (Status::NothingObservable, from),
    };
    Solution { status, chain: objective.unknowns.chain(&values), values, rms_history_m }
}

/// Minimises `Σ w (d_measured − d_computed)²` over some parameters of a chain, where nothing else is unknown and nothing is believed.
pub fn solve_lengths(
    chain: &Chain<f64>,
    measurements: &[Measurement<f64>],
    free: &FreeParameters,
    options: &LmOptions,
) -> Solution {
    let mut rms_history_m = Vec::new();
    let mut memory = vec![0.0; lm_memory::<f64>(free.len())];
    let problem = Lengths { measurements: measurements.iter().copied(), free };
    let minimum = minimise(&problem, chain.clone(), options, &mut memory, |rms_m| rms_history_m.push(rms_m));
    let (status, chain) = match minimum {
        Ok(minimum) => (minimum.status, minimum.values),
        Err(_) => (Status::NothingObservable, chain.clone()),
    };
    Solution { status, values: chain.parameters().to_vec(), chain, rms_history_m }
}

struct Believed<'a> {
    objective: &'a Objective<'a>,
    /// `σ² Λ`, packed; `None` where nothing is believed.
    precision: Option<Vec<f64>>,
    start: &'a [f64],
}

impl Problem<f64> for Believed<'_> {
    type Values = Vec<f64>;

    fn unknowns(&self) -> usize {
        self.objective.beliefs.free().len()
    }

    fn add_to(&self, values: &Vec<f64>, equations: &mut NormalEquations<'_, f64>) {
        let Objective { unknowns, rows, beliefs, .. } = *self.objective;
        unknowns.for_each_block(values, rows, beliefs.free(), |rows| equations.add(rows));
        if let Some(precision) = &self.precision {
            equations.add_prior(&beliefs.change(values, self.start), Precision::Full(precision));
        }
    }

    fn moved(&self, values: &Vec<f64>, change: &[f64]) -> Vec<f64> {
        let mut moved = values.clone();
        for (&index, &by) in self.objective.beliefs.free().iter().zip(change) {
            moved[index] += by;
        }
        moved
    }
}

/// What happened and, where it is no minimum, what to do.
pub fn explanation(status: Status) -> &'static str {
    match status {
        Status::Converged(ConvergenceTest::Gradient) => "the residuals are orthogonal to every free parameter's effect",
        Status::Converged(ConvergenceTest::Cost) => "a further step would no longer lower the sum of squares",
        Status::Converged(ConvergenceTest::Step) => "a further step would change the lengths by less than a picometre",
        Status::AlreadyOptimal => "the start was the minimum already: no parameter moved",
        Status::Stalled => {
            "no step lowered the sum of squares although its gradient is not zero: the lengths tell some parameters by a hair, or are wrong"
        }
        Status::NothingObservable => {
            "no parameter is free, or no length depends on a free one; measure other poses, look for wrong rows, or hold fewer parameters"
        }
        Status::IterationLimit => "as many steps as may be tried were, and none of the robots on the way explains the lengths",
        Status::NotFinite => "the residuals at the start are not finite numbers",
    }
}
