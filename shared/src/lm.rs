//! Levenberg-Marquardt: K. Levenberg, Quarterly of Applied Mathematics 2(2), 1944, and D. W. Marquardt, J. SIAM 11(2), 1963; the paper's
//! eq. 7 and 10.
//!
//! It knows a [`Problem`] and nothing of robots, works in memory that is lent, and ends with a reason.

use core::mem;

use serde::{Deserialize, Serialize};

use crate::Real;
use crate::normal::{MemoryTooShort, NormalEquations, take};
use crate::step::{DampedSolver, Damping};

/// Least squares: residuals that depend on unknowns, and perhaps a prior.
pub trait Problem<S: Real> {
    /// Where the unknowns stand, in whatever form the problem keeps that.
    type Values: Clone;

    /// How many unknowns there are.
    fn unknowns(&self) -> usize;

    /// Adds all rows at these values, and the prior, to empty equations of [`Problem::unknowns`].
    fn add_to(&self, values: &Self::Values, equations: &mut NormalEquations<'_, S>);

    /// Other values: these, changed by a step, which has one entry an unknown.
    fn moved(&self, values: &Self::Values, change: &[S]) -> Self::Values;
}

/// Bounds and damping of a solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LmOptions {
    /// What λ multiplies.
    pub damping: Damping,
    /// Steps that may be taken, refused ones included.
    pub max_iterations: usize,
}

impl Default for LmOptions {
    fn default() -> Self {
        Self { damping: Damping::Identity, max_iterations: 200 }
    }
}

/// Why a solve ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// A minimum was reached, and the unknowns moved.
    Converged(ConvergenceTest),
    /// The start already met the gradient test, or fits to the rounding of the numbers: nothing moved.
    AlreadyOptimal,
    /// No damping, however strong, lowered the cost, yet the gradient test is not met.
    Stalled,
    /// There is no unknown, or nothing measured depends on one.
    NothingObservable,
    /// The allowed steps were used up; the values are the best ones seen.
    IterationLimit,
    /// The cost at the start is infinite or not a number.
    NotFinite,
}

/// Which test a converged solve met.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ConvergenceTest {
    /// The residual is orthogonal to every column: the largest cosine is below 1e-10 (`f32`: 1.2e-7).
    Gradient,
    /// The last step lowered, and the next one would lower, the cost by less than 1e-12 of it (`f32`: 1e-6); or the next one promises
    /// less than ten times that, or than rounding of the residuals makes of the cost, and does not lower it.
    Cost,
    /// The next step changes what is computed by less than 1e-12 m RMS, a picometre (`f32`: 1.2 nm).
    Step,
}

impl Status {
    /// Whether the unknowns are at a minimum.
    pub fn is_minimum(self) -> bool {
        matches!(self, Self::Converged(_) | Self::AlreadyOptimal)
    }

    /// A word for machines.
    pub fn name(self) -> &'static str {
        match self {
            Self::Converged(_) => "converged",
            Self::AlreadyOptimal => "already_optimal",
            Self::Stalled => "stalled",
            Self::NothingObservable => "nothing_observable",
            Self::IterationLimit => "iteration_limit",
            Self::NotFinite => "not_finite",
        }
    }
}

/// Where a solve ended.
#[derive(Clone, Debug)]
pub struct Minimum<V> {
    /// Why it ended.
    pub status: Status,
    /// The best values seen.
    pub values: V,
    /// Steps from the start to there. Those that were tried and lowered nothing are not among them.
    pub steps: usize,
}

/// Numbers of memory that [`minimise`] needs for so many unknowns: 2,178 for 36.
pub const fn lm_memory<S: Real>(unknowns: usize) -> usize {
    2 * NormalEquations::<S>::memory(unknowns) + DampedSolver::<S>::memory(unknowns)
}

/// Minimises the cost of a problem, beginning with `start`. `on_step` is told the RMS residual at the start and after each step, metres.
///
/// # Errors
/// [`MemoryTooShort`] when less than [`lm_memory`] is lent. Otherwise it never fails: [`Status`] says where it ended.
pub fn minimise<S: Real, P: Problem<S>>(
    problem: &P,
    start: P::Values,
    options: &LmOptions,
    mut memory: &mut [S],
    on_step: impl FnMut(S),
) -> Result<Minimum<P::Values>, MemoryTooShort> {
    let unknowns = problem.unknowns();
    let (needed, lent) = (lm_memory::<S>(unknowns), memory.len());
    let equations_memory = NormalEquations::<S>::memory(unknowns);
    let mut part = |count| take(&mut memory, count).map_err(|_| MemoryTooShort { needed, lent });
    let mut equations = NormalEquations::new(unknowns, part(equations_memory)?)?;
    let trial = NormalEquations::new(unknowns, part(equations_memory)?)?;
    let factorisation = DampedSolver::new(unknowns, part(DampedSolver::<S>::memory(unknowns))?)?;
    problem.add_to(&start, &mut equations);
    let tolerances = Tolerances::new(&equations);
    let mut descent = Descent {
        problem,
        options,
        tolerances,
        values: start,
        equations,
        trial,
        factorisation,
        lambda: tolerances.first_lambda,
        rise: S::nearest(2.0),
        steps: 0,
        on_step,
    };
    let status = descent.run();
    Ok(Minimum { status, values: descent.values, steps: descent.steps })
}

/// When to stop, by what the numbers of a precision can tell and how noisy the rows are.
#[derive(Clone, Copy)]
struct Tolerances<S> {
    gradient: S,
    cost: S,
    /// Part of the cost that rounding of the residuals makes of it, times the RMS residual.
    rounded_cost_m: S,
    step_m: S,
    rounded_rms_m: S,
    /// A column whose squared norm is below this fraction of what a translation's would be (the sum of weights) is rounding.
    zero_column: S,
    /// λ at the start, relative to the largest diagonal entry (λI) or as it is (λ·diag). Designs are good starts, so it is small;
    /// a refused step raises it.
    first_lambda: S,
    /// Below this relative λ the damping of redundant columns drowns in rounding.
    smallest_lambda: S,
    /// Above this relative λ a step no longer changes anything.
    largest_lambda: S,
}

impl<S: Real> Tolerances<S> {
    /// Lengths are of the order of a metre, so that an ulp of one is what a residual is rounded by.
    fn new(start: &NormalEquations<'_, S>) -> Self {
        let ulps = |count: f64| S::nearest(count) * S::EPSILON;
        let at_least = |least: f64, by_precision: S| S::nearest(least).max(by_precision);
        let root = |value: S| value.square_root();
        let rows = S::nearest(start.rows().max(1) as f64);
        Self {
            gradient: at_least(1e-10, ulps(1.0)),
            cost: at_least(1e-12, ulps(8.0)),
            // Σ f² changes by 2 Σ f δ when each residual is rounded by δ.
            rounded_cost_m: ulps(2.0) / root(rows),
            step_m: at_least(1e-12, ulps(0.01)),
            // Below a nanometre residuals are the rounding of a file's digits, and a start that has them is the minimum already.
            rounded_rms_m: at_least(1e-9, ulps(1.0)),
            zero_column: at_least(1e-24, ulps(8.0) * ulps(8.0)),
            // 1e-6 and 9e-13; in f32 1.9e-3 and 3e-6.
            first_lambda: S::nearest(0.75) * root(root(S::EPSILON)) * root(root(root(S::EPSILON))),
            smallest_lambda: S::nearest(0.5) * root(S::EPSILON) * root(root(S::EPSILON)),
            largest_lambda: S::nearest(1e12),
        }
    }
}

/// One solve: the best values so far and the equations there.
struct Descent<'a, S, P: Problem<S>, F>
where
    S: Real,
{
    problem: &'a P,
    options: &'a LmOptions,
    tolerances: Tolerances<S>,
    values: P::Values,
    equations: NormalEquations<'a, S>,
    trial: NormalEquations<'a, S>,
    factorisation: DampedSolver<'a, S>,
    lambda: S,
    /// Factor of the next rise of λ; doubles with each refused step (Nielsen's rule).
    rise: S,
    steps: usize,
    on_step: F,
}

impl<S: Real, P: Problem<S>, F: FnMut(S)> Descent<'_, S, P, F> {
    fn run(&mut self) -> Status {
        let Tolerances { gradient, cost: cost_tolerance, step_m, first_lambda, .. } = self.tolerances;
        (self.on_step)(self.equations.rms_m());
        if !self.equations.cost().is_finite() {
            return Status::NotFinite;
        }
        if largest_diagonal(&self.equations) <= self.tolerances.zero_column * self.equations.weight() {
            return Status::NothingObservable;
        }
        if self.equations.cost() <= self.tolerances.rounded_rms_m * self.tolerances.rounded_rms_m * self.equations.weight() {
            return Status::AlreadyOptimal;
        }
        let (mut last_reduction, mut last_unseen) = (None, None);
        for _ in 0..self.options.max_iterations {
            if self.largest_cosine() <= gradient {
                return self.minimum(ConvergenceTest::Gradient);
            }
            let cost = self.equations.cost();
            let Some((candidate, promised)) = self.step() else {
                if self.raise_lambda() {
                    continue;
                }
                return Status::Stalled;
            };
            // Damping shrinks the promise of a step, so only a lightly damped one may speak of convergence.
            let is_light = self.lambda <= first_lambda;
            if is_light && promised.max(S::zero()).square_root() <= step_m * self.equations.weight().square_root() {
                return self.minimum(ConvergenceTest::Step);
            }
            let is_small = |reduction: S| reduction <= cost_tolerance * cost;
            if is_light && last_reduction.is_some_and(is_small) && is_small(promised) {
                return self.minimum(ConvergenceTest::Cost);
            }

            self.trial.clear();
            self.problem.add_to(&candidate, &mut self.trial);
            let reduction = cost - self.trial.cost();
            if reduction > S::zero() {
                self.accept(candidate, reduction / promised);
                last_reduction = Some(reduction);
            } else if is_light && promised <= S::nearest(10.0) * cost_tolerance.max(self.rounded_cost()) * cost {
                // What the step promised is below what the cost is rounded by. Where that is much, the linear model knows better, for as
                // long as its steps grow shorter.
                let grows_shorter = last_unseen.is_none_or(|last: S| promised < S::nearest(0.5) * last);
                if self.rounded_cost() <= cost_tolerance || !grows_shorter {
                    return self.minimum(ConvergenceTest::Cost);
                }
                self.accept(candidate, S::one());
                (last_reduction, last_unseen) = (Some(promised), Some(promised));
            } else if !self.raise_lambda() {
                return Status::Stalled;
            }
        }
        if self.largest_cosine() <= gradient { self.minimum(ConvergenceTest::Gradient) } else { Status::IterationLimit }
    }

    /// The values after the next step, and by how much the linear model expects the cost to fall.
    fn step(&mut self) -> Option<(P::Values, S)> {
        let unit = match self.options.damping {
            Damping::Identity => largest_diagonal(&self.equations),
            Damping::Diagonal => S::one(),
        };
        let step = self.factorisation.solve(&self.equations, self.lambda * unit, self.options.damping).ok()?;
        Some((self.problem.moved(&self.values, step.change), step.predicted_reduction))
    }

    fn accept(&mut self, candidate: P::Values, gain_ratio: S) {
        self.values = candidate;
        mem::swap(&mut self.equations, &mut self.trial);
        self.steps += 1;
        (self.on_step)(self.equations.rms_m());
        // Nielsen's rule with a faster fall: near the minimum the model is right and damping only delays.
        let gain = S::nearest(2.0) * gain_ratio - S::one();
        let fall = (S::one() - gain * gain * gain).clamp(S::nearest(0.01), S::nearest(2.0));
        self.lambda = (self.lambda * fall).max(self.tolerances.smallest_lambda);
        self.rise = S::nearest(2.0);
    }

    fn raise_lambda(&mut self) -> bool {
        self.lambda *= self.rise;
        self.rise *= S::nearest(2.0);
        self.lambda <= self.tolerances.largest_lambda
    }

    /// Ends at a minimum, with a last step that is too small to be seen in the cost: it still brings weakly excited unknowns nearer. A
    /// start that moved nothing stays as it is.
    fn minimum(&mut self, test: ConvergenceTest) -> Status {
        if self.steps == 0 {
            return Status::AlreadyOptimal;
        }
        self.lambda = self.tolerances.smallest_lambda;
        if let Some((candidate, promised)) = self.step()
            && promised <= S::nearest(10.0) * self.tolerances.cost.max(self.rounded_cost()) * self.equations.cost()
        {
            self.values = candidate;
        }
        Status::Converged(test)
    }

    /// Part of the cost that is rounding of the residuals.
    fn rounded_cost(&self) -> S {
        self.tolerances.rounded_cost_m / self.equations.rms_m()
    }

    /// Largest cosine of an angle between the residual vector and a column.
    fn largest_cosine(&self) -> S {
        let equations = &self.equations;
        let largest = largest_diagonal(equations).max(equations.weight());
        let cosines = equations.diagonal().zip(equations.gradient()).map(|(square, &gradient)| {
            let size = (square * equations.cost()).square_root();
            // A column of rounding has no direction.
            let has_direction = square > self.tolerances.zero_column * largest && size > S::zero();
            if has_direction { gradient.abs() / size } else { S::zero() }
        });
        cosines.fold(S::zero(), |largest, cosine| largest.max(cosine))
    }
}

fn largest_diagonal<S: Real>(equations: &NormalEquations<'_, S>) -> S {
    equations.diagonal().fold(S::zero(), |largest, square| largest.max(square))
}
