//! What may be wrong with measurements that no parameters fit: each conceivable mistake is put right and fitted anew.

use std::fmt;

use ballbar::{Chain, FreeParameters, Kinematics, LmOptions, Measurement, Parameter};

use super::evidence::Evidence;
use super::mistake::{Mistake, any_constant, conceivable};
use super::plausibility::{change_of_ends, large_changes};
use super::refusals::Refusal;
use crate::identify::{Finding, solve_lengths};
use crate::kinematics::CanonicalFrames;
use crate::units::{fixed, mm_from_m};

/// What may be wrong. Its text is a whole sentence.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Suspicion {
    /// With one of these mistakes put right, the lengths fit.
    Mistakes {
        /// The likeliest first, with the RMS residual of a fit without it, metres.
        found: Vec<(Mistake, f64)>,
        /// The RMS residual of the fit to the measurements as they are, metres.
        rms_m: f64,
    },
    /// The lengths do not depend on the joint values beside them.
    Unrelated {
        /// RMS residual, metres.
        rms_m: f64,
        /// What lengths of other poses would leave, metres.
        strange_m: f64,
    },
}

impl fmt::Display for Suspicion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mm = |m: f64| fixed(mm_from_m(m), if m < 1e-3 { 3 } else { 1 });
        match self {
            Self::Mistakes { found, rms_m } => {
                f.write_str("Look at this first: ")?;
                for (i, (mistake, right_m)) in found.iter().enumerate() {
                    let or = if i > 0 { "; or " } else { "" };
                    write!(
                        f,
                        "{or}{mistake} (put right, a fit leaves an RMS of {} mm instead of {} mm)",
                        mm(*right_m),
                        mm(*rms_m)
                    )?;
                }
                f.write_str(".")
            }
            Self::Unrelated { rms_m, strange_m } => write!(
                f,
                "Look at this first: the lengths seem to have nothing to do with the joint values beside them; a fit leaves {} mm, and lengths in \
                 any order would leave some {} mm. Were rows shuffled, or are these poses of another robot or rig?",
                mm(*rms_m),
                mm(*strange_m)
            ),
        }
    }
}

/// A mistake explains what it makes so many times smaller.
const FAR_BETTER: f64 = 3.0;
/// Mistakes that fit alike within this factor cannot be told from one another.
const ALIKE: f64 = 1.5;
/// Below it, fits are alike: a good robot scatters by so much.
const SCATTER_M: f64 = 0.1e-3;
/// How many of those are named.
const NAMED: usize = 2;

/// Looks for the mistake that explains why a fit is refused; `None` where none does.
pub(super) fn suspect(evidence: &Evidence<'_>, refusals: &[Refusal]) -> Option<Suspicion> {
    let Evidence { dataset, fit, .. } = evidence;
    let is_too_large = refusals.iter().any(|refusal| matches!(refusal, Refusal::TooLarge { .. }));
    let is_implausible = refusals.iter().any(|refusal| matches!(refusal, Refusal::Implausible(_)));
    let is_beyond_limits = refusals.iter().any(|refusal| matches!(refusal, Refusal::BeyondLimits { .. }));
    let is_divided = refusals.iter().any(|refusal| matches!(refusal, Refusal::TooManyWrong { .. }));
    if !(is_too_large || is_implausible || is_beyond_limits || is_divided) {
        return None;
    }
    let trial = Trial::new(evidence);
    let as_they_are = dataset.measurements();
    let Tried { rms_m, is_plausible, .. } = trial.fit(&as_they_are)?;
    // Where the parameters went too far to be believed, others that fit no better may still be the right ones.
    let is_far = is_implausible || !is_plausible;
    let most_m = if is_far { ALIKE * rms_m.max(SCATTER_M) } else { rms_m / FAR_BETTER };
    let most_m = if is_too_large { most_m.min(fit.fitted.rms_m / FAR_BETTER) } else { most_m };
    let explains = |mistake: Mistake| {
        let right = mistake.put_right(evidence);
        let Tried { rms_m, is_plausible, .. } = trial.fit(&right).filter(|_| right != as_they_are)?;
        (is_plausible && rms_m < most_m).then_some((mistake, rms_m))
    };
    let mut found: Vec<(Mistake, f64)> = conceivable(evidence).into_iter().filter_map(explains).collect();
    if found.is_empty() {
        found.extend(any_constant(evidence).and_then(explains));
    }
    let named = likeliest(found, fit.fitted.rms_m);
    if named.is_some() {
        return named;
    }
    let strange_m = strange_m(evidence, &as_they_are);
    let is_unrelated = is_too_large && !is_beyond_limits && rms_m > UNRELATED * strange_m;
    is_unrelated.then_some(Suspicion::Unrelated { rms_m: fit.fitted.rms_m, strange_m })
}

/// Looks for a mistake where a fit is good but says that the robot stands, or its tool is mounted, far from where its file says: put right, it leaves
/// them where they were, and fits as well. `None` where there is none, or nothing moved.
pub(super) fn suspect_moved(evidence: &Evidence<'_>) -> Option<Suspicion> {
    /// Of how far they are, what may be left: less is no chance.
    const LEFT: f64 = 0.1;
    let Evidence { robot, dataset, fit, .. } = evidence;
    let moved = change_of_ends(&robot.chain, &fit.solution.chain);
    if moved < 1.0 {
        return None;
    }
    let trial = Trial::new(evidence);
    let most_m = ALIKE * fit.fitted.rms_m.max(SCATTER_M);
    let as_they_are = dataset.measurements();
    let explains = |mistake: Mistake| {
        let right = mistake.put_right(evidence);
        let tried = trial.fit(&right).filter(|_| right != as_they_are)?;
        let is_it = tried.is_plausible && tried.change_of_ends < LEFT * moved && tried.rms_m < most_m;
        is_it.then_some((mistake, tried.rms_m))
    };
    likeliest(conceivable(evidence).into_iter().filter_map(explains).collect(), fit.fitted.rms_m)
}

/// Those that fit best; `None` of none.
fn likeliest(mut found: Vec<(Mistake, f64)>, rms_m: f64) -> Option<Suspicion> {
    let best_m = found.iter().map(|(_, rms_m)| *rms_m).min_by(f64::total_cmp)?;
    found.retain(|(_, rms_m)| *rms_m <= ALIKE * best_m.max(SCATTER_M));
    found.truncate(NAMED);
    Some(Suspicion::Mistakes { found, rms_m })
}

/// A fit that leaves more than this share of what lengths of other poses would leave has learned nothing from the joints.
const UNRELATED: f64 = 0.5;

/// RMS residual of the design with lengths in any order, but for their mean: `√(var(measured) + var(computed))`, metres.
fn strange_m(evidence: &Evidence<'_>, measurements: &[Measurement<f64>]) -> f64 {
    let kinematics = Kinematics::new(&evidence.robot.chain);
    let measured_m: Vec<f64> = measurements.iter().map(|row| row.length_m).collect();
    let computed_m: Vec<f64> = measurements.iter().map(|row| kinematics.length(&row.q, &row.pairing)).collect();
    (variance(&measured_m) + variance(&computed_m)).sqrt()
}

fn variance(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count
}

/// Quick fits, all of the same parameters (in canonical frames) and rows: those that these poses tell, weak ones too. How weak they are was judged
/// by the residuals of measurements that do not fit, and a fit without them would leave what is wrong with the design.
struct Trial {
    design: Chain<f64>,
    free: FreeParameters,
    options: LmOptions,
}

/// What came of a quick fit.
struct Tried {
    /// RMS residual, metres.
    rms_m: f64,
    /// Whether its parameters are a robot's.
    is_plausible: bool,
    /// As [`change_of_ends`] has it.
    change_of_ends: f64,
}

impl Trial {
    /// A design is a good start: what has not come near in so many steps is not the right one.
    const STEPS: usize = 20;

    fn new(evidence: &Evidence<'_>) -> Self {
        let Evidence { robot, fit, .. } = evidence;
        let design = CanonicalFrames::new(&robot.chain).chain().clone();
        let is_untold = |index: usize| {
            let finding = &fit.identifiability.findings[index];
            matches!(finding, Finding::NotExcited { .. } | Finding::NoEffect | Finding::LeftOut)
        };
        let is_redundant = |index: usize| design.is_conventionally_held(Parameter::from_index(index));
        let free = (0..design.parameter_count()).filter(|&index| !is_redundant(index) && !is_untold(index));
        let free = FreeParameters::from_indices(free).unwrap_or(FreeParameters::all(0));
        Self { design, free, options: LmOptions { max_iterations: Self::STEPS, ..LmOptions::default() } }
    }

    /// `None` where nothing can be fitted.
    fn fit(&self, measurements: &[Measurement<f64>]) -> Option<Tried> {
        let rows = self.rows(measurements);
        if rows.len() <= self.free.len() {
            return None;
        }
        let fitted = solve_lengths(&self.design, &rows, &self.free, &self.options).chain;
        let kinematics = Kinematics::new(&fitted);
        let weight: f64 = rows.iter().map(|row| row.weight).sum();
        let squares: f64 = rows.iter().map(|row| row.weight * kinematics.residual(row).powi(2)).sum();
        let is_plausible = large_changes(&self.design, &fitted).iter().all(|change| !change.is_impossible);
        let change_of_ends = change_of_ends(&self.design, &fitted);
        Some(Tried { rms_m: (squares / weight).sqrt(), is_plausible, change_of_ends }).filter(|tried| tried.rms_m.is_finite())
    }

    /// Enough rows to tell, evenly chosen; all where there are few.
    fn rows(&self, measurements: &[Measurement<f64>]) -> Vec<Measurement<f64>> {
        const ENOUGH: usize = 200;
        const PER_PARAMETER: usize = 6;
        let count = measurements.len();
        let most = ENOUGH.max(PER_PARAMETER * self.free.len()).min(count);
        (0..most).map(|i| measurements[i * count / most]).collect()
    }
}
