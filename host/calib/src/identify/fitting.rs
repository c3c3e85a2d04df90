//! A fit, whole: from a design and a dataset to parameters, how sure they are, and what poses left out say of them.

use std::time::Instant;

use ballbar::{Chain, Damping, JointTerms, LmOptions, Parameter};
use nalgebra::DMatrix;
use thiserror::Error;

use super::beliefs::Beliefs;
use super::cross_validation::cross_validate;
use super::estimate::{Estimate, Estimator, Rule};
use super::fit::{Fit, FittedParameter, PriorFacts, Released};
use super::groups::leave_groups_out;
use super::hold::{Held, Hold};
use super::identifiability::Identifiability;
use super::in_user_frames::in_user_frames;
use super::lm::{Objective, solve};
use super::noise::believed_sigma_m;
use super::observation::Observation;
use super::prior::ChainPrior;
use super::reference::{Reference, independent_columns};
use super::residual::{Residual, ResidualSummary};
use super::residuals::{ALIKE, by_pairing, neighbour_correlation, outliers};
use super::robust::{WrongRow, estimate_robustly};
use super::spectrum::Spectrum;
use super::uncertainty::Uncertainty;
use crate::kinematics::CanonicalFrames;
use crate::model::{Dataset, PoseRow, Robot};
use crate::unknowns::{AnyBlock, Unknowns};

/// What to find out beside the chain, what to hold, what to believe, and how to step.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FitOptions {
    /// Parameters that stay at their design values.
    pub hold: Hold,
    /// What is believed of the others.
    pub prior: PriorRule,
    /// What becomes of rows that contradict the others.
    pub loss: Loss,
    /// λI or λ·diag.
    pub damping: Damping,
    /// What is not known beside the chain ([`crate::unknowns::Kind::block`]).
    pub unknowns: Vec<AnyBlock>,
}

/// What is believed of a chain before anything is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum PriorRule {
    /// What its tolerances say.
    #[default]
    Tolerances,
    /// Nothing: lengths alone decide, and what they do not tell is held.
    None,
}

/// What becomes of rows that contradict the others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Loss {
    /// They are left out, by Tukey's biweight and studentised residuals.
    #[default]
    Tukey,
    /// They are fitted with the others.
    None,
}

impl FitOptions {
    /// The paper's least squares: nothing believed, and all rows fitted.
    pub fn plain() -> Self {
        Self { prior: PriorRule::None, loss: Loss::None, ..Self::default() }
    }
}

/// Why there is no fit.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FitError {
    /// A fit without redundancy would meet every length and prove nothing.
    #[error("{rows} poses for {free} free parameters, expected more poses than free parameters")]
    NoRedundancy {
        /// Poses given.
        rows: usize,
        /// Parameters that would be free.
        free: usize,
    },
    /// A parameter is to be held that this robot does not have.
    #[error("the robot has no parameter `{0}`")]
    NoSuchParameter(Parameter),
}

/// Fits the robot's parameters, and what else [`FitOptions::unknowns`] asks for, to the dataset: Levenberg-Marquardt on
/// `Σ f²/σ² + Σ (change/tolerance)²` from the design, over what [`FitOptions::hold`] leaves free, of the rows that no others contradict; then
/// what the result is worth, by linear theory and by poses left out in turn.
///
/// Which parameters are held by themselves does not depend on how the robot's frames are written: they are found out, and the others fitted, in
/// canonical frames, and values and deviations come back in the robot's own. Whoever holds a parameter by name, or none, or the paper's, means
/// those of the frames as they are written.
///
/// With [`FitOptions::plain`] the minimum is the paper's least-squares solution (A. Goswami, A. Quaid and M. Peshkin, IEEE Control Systems 13(5),
/// 1993); which parameters are free is then found anew for each dataset ([`Identifiability`]).
///
/// ```
/// use ballbar_calib::designs;
/// use ballbar_calib::identify::{FitOptions, fit};
/// use ballbar_calib::model::Dataset;
/// use ballbar_calib::simulate::Shells;
///
/// let (design, rig) = (designs::puma560(), designs::triangles());
/// let mut truth = design.clone();
/// truth.chain.parameters_mut()[16] += 0.002; // x3
/// let pairings = rig.all_pairings();
/// let shells = Shells {
///     planned_with: &design, truth: &truth, rig: &rig, pairings: &pairings, bar_m: 0.46, per_pairing: 20, sigma_m: 0.0, seed: 1,
/// };
/// let poses = Dataset::new("simulated", shells.simulate(|| ())?.into_iter().map(|pose| pose.row).collect())?;
///
/// let fit = fit(&design, &poses, &FitOptions::default())?;
/// assert!(fit.solution.status.is_minimum() && fit.fitted.rms_m < 1e-9);
/// assert!((fit.solution.chain.parameters()[16] - truth.chain.parameters()[16]).abs() < 1e-8);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`FitError`] when there are no more poses than free parameters, or when a parameter is to be held that the robot lacks.
pub fn fit(robot: &Robot, dataset: &Dataset, options: &FitOptions) -> Result<Fit, FitError> {
    if !options.hold.is_of_any_frames() {
        return fit_as_written(&robot.chain, &robot.terms, robot, dataset, options);
    }
    let frames = CanonicalFrames::new(&robot.chain);
    let canonical = fit_as_written(frames.chain(), &frames.terms(&robot.terms), robot, dataset, options)?;
    // Redundant parameters come back at their design values, but zeros that were lost as they were found.
    let frames = CanonicalFrames::new(&canonical.remastered(&robot.chain));
    let unknowns = Unknowns::new(&robot.chain, &robot.terms, options.unknowns.clone());
    let rows: Vec<&PoseRow> = dataset.rows.iter().collect();
    let found = what_poses_tell(&unknowns, &rows, robot, believed_sigma_m(dataset), &[]);
    Ok(in_user_frames(canonical, &frames, unknowns, &found))
}

/// The same in the frames in which the chain is written.
fn fit_as_written(
    design: &Chain<f64>,
    terms: &JointTerms<f64>,
    robot: &Robot,
    dataset: &Dataset,
    options: &FitOptions,
) -> Result<Fit, FitError> {
    let unknowns = Unknowns::new(design, terms, options.unknowns.clone());
    let hold = &options.hold;
    let named: Vec<usize> = hold.names.iter().map(|name| name.index()).collect();
    if let Some(&name) = hold.names.iter().find(|name| name.index() >= unknowns.of_chain().len()) {
        return Err(FitError::NoSuchParameter(name));
    }
    let all_rows: Vec<&PoseRow> = dataset.rows.iter().collect();
    let usual_m = sigma_m(dataset, &unknowns, |sigma_m| what_poses_tell(&unknowns, &all_rows, robot, sigma_m, &named).noise_m);
    let identifiability = what_poses_tell(&unknowns, &all_rows, robot, usual_m, &named);
    let reference = Dependence::new(design, robot);

    let lm = LmOptions { damping: options.damping, ..LmOptions::default() };
    let chain_prior = (options.prior == PriorRule::Tolerances).then(|| ChainPrior::new(design, &robot.tolerances, &robot.limits));
    let exact: Vec<usize> = chain_prior.iter().flat_map(ChainPrior::exact).collect();
    let reasons = |first: &[usize]| match &chain_prior {
        None => hold.reasons(unknowns.of_chain().len(), &reference.independent(&[], &[]), &identifiability),
        Some(_) => {
            let apart: Vec<usize> = named.iter().chain(&exact).copied().collect();
            hold.reasons_beside_prior(unknowns.of_chain().len(), &reference.independent(first, &apart), &exact, &identifiability)
        }
    };
    let free = |first: &[usize]| free_of(&reasons(first));
    let rule = match &chain_prior {
        None => Rule::Plain(free(&[])),
        Some(chain) => Rule::Prior { chain, free: &free },
    };
    let mut estimator = Estimator { unknowns: &unknowns, lm, stated_m: dataset.stated_sigma_m(), usual_m, rule };
    let start = estimator.first_beliefs();
    if all_rows.len() + start.believed() <= start.free().len() {
        return Err(FitError::NoRedundancy { rows: all_rows.len(), free: start.free().len() - start.believed() });
    }

    let began = Instant::now();
    let (mut estimate, mut wrong_rows) = estimated(&estimator, &all_rows, &start, options.loss);
    let mut kept = kept_rows(&all_rows, &wrong_rows);
    let stated_m = estimator.stated_m.filter(|_| chain_prior.is_some());
    let mut uncertainty = estimate.uncertainty(&unknowns, &kept, stated_m, stated_m);
    let is_hopeless = estimator.is_hopeless(&kept, &estimate);
    if let Some(seen_m) = uncertainty.beyond_stated_m(estimator.stated_m).filter(|_| chain_prior.is_some() && !is_hopeless) {
        // What the rows state is not what they do: beliefs are weighed against what they do.
        estimator.stated_m = Some(seen_m);
        (estimate, wrong_rows) = estimated(&estimator, &all_rows, &start, options.loss);
        kept = kept_rows(&all_rows, &wrong_rows);
        uncertainty = estimate.uncertainty(&unknowns, &kept, estimator.stated_m, None);
    }
    let solve_time = began.elapsed();

    let Estimate { beliefs, sigma_m, weighing, released, solution } = estimate;
    let released_indices: Vec<usize> =
        chain_prior.iter().flat_map(|chain| weighing.released.iter().flat_map(|part| chain.indices(*part))).collect();
    let reasons = reasons(&released_indices);
    let objective = Objective { unknowns: &unknowns, rows: &kept, beliefs: &beliefs, sigma_m };
    let is_wrong = |row: usize| wrong_rows.iter().any(|wrong| wrong.row == row);
    let residuals_at = |values: &[f64]| {
        let mut residuals = Residual::of_rows(&unknowns, values, dataset.rows.iter());
        wrong_rows.iter().for_each(|wrong| residuals[wrong.row].weight = 0.0);
        residuals
    };
    let before = residuals_at(&unknowns.start());
    let after = residuals_at(&solution.values);
    let base_alone = base_alone(&objective, &reasons, &lm).map(|values| ResidualSummary::new(&residuals_at(&values)));
    let neighbour_correlation = neighbour_correlation(dataset, &after);
    let in_blocks = neighbour_correlation.is_some_and(|correlation| correlation > ALIKE);
    let (cross_validation, of_kept) = (!is_hopeless).then(|| cross_validate(&objective, &lm, in_blocks)).flatten().unzip();
    let left_out = of_kept.map_or_else(Vec::new, |of_kept| {
        let mut left_out = after.clone();
        let kept = (0..left_out.len()).filter(|&row| !is_wrong(row)).collect::<Vec<_>>();
        kept.into_iter().zip(of_kept).for_each(|(row, residual)| left_out[row] = residual);
        left_out
    });
    let kept_indices: Vec<usize> = (0..dataset.rows.len()).filter(|&row| !is_wrong(row)).collect();
    let left_out_groups = leave_groups_out(dataset, &kept_indices, (&unknowns, &solution.values), &beliefs, &uncertainty);
    Ok(Fit {
        solve_time,
        identifiability,
        prior: chain_prior.is_some().then(|| PriorFacts {
            factor: weighing.factor,
            sigma_m,
            released: released
                .iter()
                .map(|share| Released { part: share.part, change: share.change, tolerance: share.tolerance })
                .collect(),
        }),
        parameters: fitted_parameters(&unknowns, &solution.values, beliefs.free(), &uncertainty, reasons),
        initial: ResidualSummary::new(&before),
        fitted: ResidualSummary::new(&after),
        initial_by_pairing: by_pairing(dataset, &before),
        fitted_by_pairing: by_pairing(dataset, &after),
        outliers: outliers(dataset, &after),
        neighbour_correlation,
        cross_validation,
        left_out,
        left_out_groups,
        base_alone,
        residuals: after,
        uncertainty,
        wrong_rows,
        solution,
        unknowns,
    })
}

fn estimated(estimator: &Estimator<'_>, rows: &[&PoseRow], start: &Beliefs, loss: Loss) -> (Estimate, Vec<WrongRow>) {
    match loss {
        Loss::Tukey => estimate_robustly(estimator, rows, start),
        Loss::None => (estimator.estimate(rows), Vec::new()),
    }
}

fn kept_rows<'a>(rows: &[&'a PoseRow], wrong: &[WrongRow]) -> Vec<&'a PoseRow> {
    let is_wrong = |row: usize| wrong.iter().any(|wrong| wrong.row == row);
    (0..rows.len()).filter(|&row| !is_wrong(row)).map(|row| rows[row]).collect()
}

fn free_of(reasons: &[Option<Held>]) -> Vec<usize> {
    (0..reasons.len()).filter(|&index| reasons[index].is_none()).collect()
}

/// What of a chain's parameters is dependent in every experiment.
struct Dependence<'a> {
    design: &'a Chain<f64>,
    jacobian: DMatrix<f64>,
    rank: usize,
}

impl<'a> Dependence<'a> {
    fn new(design: &'a Chain<f64>, robot: &Robot) -> Self {
        let jacobian = Reference::new(design, &robot.limits).jacobian(design);
        let rank = Spectrum::new(&jacobian).rank;
        Self { design, jacobian, rank }
    }

    /// Independent parameters, ascending: those at `first` before those that the paper frees, and these before the others; none of those
    /// that are set `apart`.
    fn independent(&self, first: &[usize], apart: &[usize]) -> Vec<usize> {
        let others = (0..self.design.parameter_count()).filter(|index| !first.contains(index) && !apart.contains(index));
        let is_last = |index: &usize| self.design.is_conventionally_held(Parameter::from_index(*index));
        let (last, usual): (Vec<usize>, Vec<usize>) = others.partition(is_last);
        independent_columns(&[first.to_vec(), usual, last], &self.jacobian, self.rank)
    }
}

/// What the poses can tell at the design, around the parameters at the indices `held`.
fn what_poses_tell(unknowns: &Unknowns, rows: &[&PoseRow], robot: &Robot, sigma_m: f64, held: &[usize]) -> Identifiability {
    let believed: Vec<usize> = (0..unknowns.list().len()).filter(|&index| unknowns.list()[index].tolerance.is_some()).collect();
    let beliefs = Beliefs::without_chain(unknowns, believed);
    let observation = Observation::of(unknowns, &unknowns.start(), rows, Some((&beliefs, sigma_m)));
    Identifiability::of(unknowns.of_chain(), unknowns.list(), &observation, &robot.limits, held)
}

/// What a length of weight one deviates by, metres: as it is stated, or else as the lengths show it. Without meaning, and not looked for,
/// where nothing is weighed against it.
fn sigma_m(dataset: &Dataset, unknowns: &Unknowns, shown_m: impl Fn(f64) -> f64) -> f64 {
    /// Each beside the one before; more change nothing that could be seen.
    const ROUNDS: usize = 2;
    if dataset.stated_sigma_m().is_some() || !unknowns.have_priors() {
        return believed_sigma_m(dataset);
    }
    (0..ROUNDS).fold(believed_sigma_m(dataset), |sigma_m, _| shown_m(sigma_m).max(f64::MIN_POSITIVE))
}

/// What of the design's error is only that nobody knew where the robot stands: no fault of the robot, and corrected by a frame.
fn base_alone(objective: &Objective<'_>, reasons: &[Option<Held>], lm: &LmOptions) -> Option<Vec<f64>> {
    let base: Vec<usize> = objective.unknowns.of_chain().of_base().collect();
    let is_wanted = base.iter().all(|&index| !matches!(reasons[index], Some(Held::ByName)));
    let beliefs = Beliefs::without_chain(objective.unknowns, base);
    is_wanted.then(|| solve(&Objective { beliefs: &beliefs, ..*objective }, lm).values)
}

fn fitted_parameters(
    unknowns: &Unknowns,
    values: &[f64],
    free: &[usize],
    uncertainty: &Uncertainty,
    reasons: Vec<Option<Held>>,
) -> Vec<FittedParameter> {
    let std_of = |index: usize| free.binary_search(&index).ok().and_then(|position| uncertainty.std[position]);
    let list = unknowns.list().iter().zip(values).zip(reasons).enumerate();
    list.map(|(index, ((unknown, &fitted), held))| FittedParameter {
        name: unknown.name.clone(),
        unit: unknown.unit,
        initial: unknown.start,
        fitted,
        std: std_of(index),
        held,
    })
    .collect()
}
