//! Levenberg-Marquardt over the incremental normal equations (the paper's eq. 7 and 10).

use ballbar::{Chain, DampedSolver, Damping, FreeParameters, Kinematics, MAX_PARAMETERS, Measurement, NormalEquations, Step};

/// Bounds and damping of a solve.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Status {
    /// A minimum was reached, and the parameters moved.
    Converged(ConvergenceTest),
    /// The start already met the gradient test, or fits to a nanometre: nothing moved.
    AlreadyOptimal,
    /// No damping, however strong, lowered the cost, yet the gradient test is not met.
    Stalled,
    /// No parameter is free, or no length depends on a free one.
    NothingObservable,
    /// The allowed steps were used up; the parameters are the best ones seen.
    IterationLimit,
    /// The cost at the start is infinite or not a number.
    NotFinite,
}

/// Which test a converged solve met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum ConvergenceTest {
    /// The residual is orthogonal to every free column: the largest cosine is below 1e-10.
    Gradient,
    /// The last step lowered, and the next one would lower, the cost by less than 1e-12 of it; or the next one promises less
    /// than 1e-11 of it and summing the cost rounds that off.
    Cost,
    /// The next step would change the lengths by less than 1e-12 m RMS: a picometre, less than any bar can tell.
    Step,
}

impl Status {
    /// Whether the parameters are at a minimum.
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

    /// What happened and, where it is no minimum, what to do.
    pub fn explanation(self) -> &'static str {
        match self {
            Self::Converged(ConvergenceTest::Gradient) => "the residuals are orthogonal to every free parameter's effect",
            Self::Converged(ConvergenceTest::Cost) => "a further step would no longer lower the sum of squares",
            Self::Converged(ConvergenceTest::Step) => "a further step would change the lengths by less than a picometre",
            Self::AlreadyOptimal => "the start was the minimum already: no parameter moved",
            Self::Stalled => {
                "no step lowered the sum of squares although its gradient is not zero; hold parameters that are weakly excited, or look for wrong rows"
            }
            Self::NothingObservable => {
                "no parameter is free, or no length depends on a free one; measure other poses, look for wrong rows, or hold fewer parameters"
            }
            Self::IterationLimit => {
                "as many steps as may be tried were, before a minimum was reached; hold more parameters, or only those that the poses do not tell"
            }
            Self::NotFinite => "the residuals at the start are not finite numbers",
        }
    }
}

/// Where a solve ended.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Solution {
    /// Why it ended.
    pub status: Status,
    /// The chain with the best parameters seen.
    pub chain: Chain<f64>,
    /// Weighted RMS residual at the start and after each step, metres.
    pub rms_history_m: Vec<f64>,
}

impl Solution {
    /// Steps from the start to where the solve ended. Those that were tried and lowered nothing are not among them.
    pub fn steps(&self) -> usize {
        self.rms_history_m.len().saturating_sub(1)
    }
}

const GRADIENT_TOLERANCE: f64 = 1e-10;
const COST_TOLERANCE: f64 = 1e-12;
const STEP_TOLERANCE_M: f64 = 1e-12;
/// Below a nanometre residuals are the rounding of a file's digits, and a start that has them is the minimum already.
const ROUNDED_RMS_M: f64 = 1e-9;
/// A column whose squared norm is below this fraction of what a translation's would be (the sum of weights) is rounding.
const ZERO_COLUMN: f64 = 1e-24;
/// λ at the start, relative to the largest diagonal entry (λI) or as it is (λ·diag). Designs are good starts, so it is small;
/// a refused step raises it.
const FIRST_LAMBDA: f64 = 1e-6;
/// Below this relative λ the damping of redundant columns drowns in rounding.
const SMALLEST_LAMBDA: f64 = 1e-12;
/// Above this relative λ a step no longer changes anything.
const LARGEST_LAMBDA: f64 = 1e12;

/// Minimises `Σ w (d_measured − d_computed)²` over the free parameters of `chain`, beginning with its present values: the paper's eq. 7 and 10,
/// after K. Levenberg, Quarterly of Applied Mathematics 2(2), 1944, and D. W. Marquardt, J. SIAM 11(2), 1963. Never fails: [`Status`] says
/// where it ended.
pub fn solve(chain: &Chain<f64>, measurements: &[Measurement<f64>], free: &FreeParameters, options: &LmOptions) -> Solution {
    Solver::new(chain, measurements, free, options).run()
}

/// One solve: the best parameters so far and the equations there.
struct Solver<'a> {
    measurements: &'a [Measurement<f64>],
    options: &'a LmOptions,
    chain: Chain<f64>,
    equations: Box<NormalEquations<f64>>,
    trial: Box<NormalEquations<f64>>,
    factorisation: Box<DampedSolver<f64>>,
    lambda: f64,
    /// Factor of the next rise of λ; doubles with each refused step (Nielsen's rule).
    rise: f64,
    iterations: usize,
    rms_history_m: Vec<f64>,
}

impl<'a> Solver<'a> {
    fn new(chain: &Chain<f64>, measurements: &'a [Measurement<f64>], free: &FreeParameters, options: &'a LmOptions) -> Self {
        let mut equations = Box::new(NormalEquations::new(free.clone()));
        evaluate(chain, measurements, &mut equations);
        let trial = Box::new(NormalEquations::new(free.clone()));
        let rms_history_m = vec![rms(&equations)];
        let factorisation = Box::default();
        let lambda = FIRST_LAMBDA;
        Self {
            measurements,
            options,
            chain: chain.clone(),
            equations,
            trial,
            factorisation,
            lambda,
            rise: 2.0,
            iterations: 0,
            rms_history_m,
        }
    }

    fn run(mut self) -> Solution {
        let status = self.iterate();
        Solution { status, chain: self.chain, rms_history_m: self.rms_history_m }
    }

    fn iterate(&mut self) -> Status {
        if !self.equations.cost().is_finite() {
            return Status::NotFinite;
        }
        if largest_diagonal(&self.equations) <= ZERO_COLUMN * self.equations.weight() {
            return Status::NothingObservable;
        }
        if self.rms_history_m[0] < ROUNDED_RMS_M {
            return Status::AlreadyOptimal;
        }
        let mut last_reduction = f64::INFINITY;
        loop {
            if largest_cosine(&self.equations) <= GRADIENT_TOLERANCE {
                return self.minimum(ConvergenceTest::Gradient);
            }
            if self.iterations == self.options.max_iterations {
                return Status::IterationLimit;
            }
            self.iterations += 1;

            let Some(step) = self.step() else { if self.raise_lambda() { continue } else { return Status::Stalled } };
            let cost = self.equations.cost();
            // Damping shrinks the promise of a step, so only a lightly damped one may speak of convergence.
            if self.lambda <= FIRST_LAMBDA {
                if step.predicted_reduction.max(0.0).sqrt() <= STEP_TOLERANCE_M * self.equations.weight().sqrt() {
                    return self.minimum(ConvergenceTest::Step);
                }
                if last_reduction <= COST_TOLERANCE * cost && step.predicted_reduction <= COST_TOLERANCE * cost {
                    return self.minimum(ConvergenceTest::Cost);
                }
            }

            let mut candidate = self.chain.clone();
            candidate.apply(&step.change);
            evaluate(&candidate, self.measurements, &mut self.trial);
            let reduction = cost - self.trial.cost();
            if reduction > 0.0 {
                self.accept(candidate, reduction / step.predicted_reduction);
                last_reduction = reduction;
            } else if self.lambda <= FIRST_LAMBDA && step.predicted_reduction <= 10.0 * COST_TOLERANCE * cost {
                // What the step promised is below what summing the cost rounds off.
                return self.minimum(ConvergenceTest::Cost);
            } else if !self.raise_lambda() {
                return Status::Stalled;
            }
        }
    }

    fn step(&mut self) -> Option<Step<f64>> {
        let unit = match self.options.damping {
            Damping::Identity => largest_diagonal(&self.equations),
            Damping::Diagonal => 1.0,
        };
        self.factorisation.solve(&self.equations, self.lambda * unit, self.options.damping).ok()
    }

    fn accept(&mut self, candidate: Chain<f64>, gain_ratio: f64) {
        self.chain = candidate;
        std::mem::swap(&mut self.equations, &mut self.trial);
        self.rms_history_m.push(rms(&self.equations));
        // Nielsen's rule with a faster fall: near the minimum the model is right and damping only delays.
        let fall = (1.0 - (2.0 * gain_ratio - 1.0).powi(3)).clamp(0.01, 2.0);
        self.lambda = (self.lambda * fall).max(SMALLEST_LAMBDA);
        self.rise = 2.0;
    }

    fn raise_lambda(&mut self) -> bool {
        self.lambda *= self.rise;
        self.rise *= 2.0;
        self.lambda <= LARGEST_LAMBDA
    }

    fn minimum(&self, test: ConvergenceTest) -> Status {
        if self.rms_history_m.len() > 1 { Status::Converged(test) } else { Status::AlreadyOptimal }
    }
}

fn evaluate(chain: &Chain<f64>, measurements: &[Measurement<f64>], equations: &mut NormalEquations<f64>) {
    let kinematics = Kinematics::new(chain);
    let mut row = [0.0; MAX_PARAMETERS];
    equations.clear();
    for measurement in measurements {
        let residual_m = kinematics.residual_row(measurement, &mut row);
        equations.add(&row, residual_m, measurement.weight);
    }
}

fn rms(equations: &NormalEquations<f64>) -> f64 {
    (equations.cost() / equations.weight()).sqrt()
}

fn diagonal(equations: &NormalEquations<f64>) -> impl Iterator<Item = f64> + '_ {
    (0..equations.free().len()).filter_map(|i| equations.entry(i, i))
}

fn largest_diagonal(equations: &NormalEquations<f64>) -> f64 {
    diagonal(equations).fold(0.0, f64::max)
}

/// Largest cosine of an angle between the residual vector and a free column.
fn largest_cosine(equations: &NormalEquations<f64>) -> f64 {
    let largest = largest_diagonal(equations).max(equations.weight());
    let cosines = diagonal(equations).zip(equations.gradient()).map(|(square, gradient)| {
        let size = (square * equations.cost()).sqrt();
        // A column of rounding has no direction.
        if square > ZERO_COLUMN * largest && size > 0.0 { gradient.abs() / size } else { 0.0 }
    });
    cosines.fold(0.0, f64::max)
}
