//! A fit, whole: from a design and a dataset to parameters, how sure they are, and what poses left out say of them.

use std::time::Instant;

use ballbar::{Chain, Damping, JointTerms, LmOptions, Parameter};
use thiserror::Error;

use super::cross_validation::cross_validate;
use super::fit::{Fit, FittedParameter};
use super::hold::{Held, Hold};
use super::identifiability::Identifiability;
use super::in_user_frames::in_user_frames;
use super::lm::{Objective, solve};
use super::observation::Observation;
use super::residual::{Residual, ResidualSummary};
use super::residuals::{ALIKE, by_pairing, neighbour_correlation, outliers};
use super::uncertainty::Uncertainty;
use crate::kinematics::CanonicalFrames;
use crate::model::{Dataset, JointLimits, PoseRow, Robot};
use crate::unknowns::{AnyBlock, Unknowns};

/// What to find out beside the chain, what to hold, and how to step.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FitOptions {
    /// Parameters that stay at their design values.
    pub hold: Hold,
    /// λI or λ·diag.
    pub damping: Damping,
    /// What is not known beside the chain ([`crate::unknowns::Kind::block`]).
    pub unknowns: Vec<AnyBlock>,
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
/// `Σ w (d_measured − d_computed)²` ([`solve`]) from the design, over what [`FitOptions::hold`] leaves free; then what the result is worth, by linear theory and by poses left out in turn.
///
/// Which parameters are held by themselves does not depend on how the robot's frames are written: they are found out, and the others fitted, in
/// canonical frames, and values and deviations come back in the robot's own. Whoever holds a parameter by name, or none, or the paper's, means
/// those of the frames as they are written.
///
/// The minimum is the paper's least-squares solution (A. Goswami, A. Quaid and M. Peshkin, IEEE Control Systems 13(5), 1993); which parameters
/// are free is found anew for each dataset ([`Identifiability`]).
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
        return fit_as_written(&robot.chain, &robot.terms, &robot.limits, dataset, options);
    }
    let frames = CanonicalFrames::new(&robot.chain);
    let canonical = fit_as_written(frames.chain(), &frames.terms(&robot.terms), &robot.limits, dataset, options)?;
    let unknowns = Unknowns::new(&robot.chain, &robot.terms, options.unknowns.clone());
    let rows: Vec<&PoseRow> = dataset.rows.iter().collect();
    let observation = Observation::of(&unknowns, &unknowns.start(), &rows, sigma_of(dataset));
    let found = Identifiability::of(unknowns.of_chain(), unknowns.list(), &observation, &robot.limits, &[]);
    Ok(in_user_frames(canonical, &frames, unknowns, &found))
}

/// The same in the frames in which the chain is written.
fn fit_as_written(
    design: &Chain<f64>,
    terms: &JointTerms<f64>,
    limits: &[JointLimits],
    dataset: &Dataset,
    options: &FitOptions,
) -> Result<Fit, FitError> {
    let unknowns = Unknowns::new(design, terms, options.unknowns.clone());
    let chain = unknowns.of_chain();
    let named: Vec<usize> = options.hold.names.iter().map(|name| name.index()).collect();
    if let Some(&name) = options.hold.names.iter().find(|name| name.index() >= chain.len()) {
        return Err(FitError::NoSuchParameter(name));
    }
    let rows: Vec<&PoseRow> = dataset.rows.iter().collect();
    let start = unknowns.start();
    let found = |sigma_m: f64| {
        Identifiability::of(chain, unknowns.list(), &Observation::of(&unknowns, &start, &rows, sigma_m), limits, &named)
    };
    let sigma_m = sigma_m(dataset, &unknowns, |sigma_m| found(sigma_m).noise_m);
    let identifiability = found(sigma_m);
    let reasons = options.hold.reasons(chain, &identifiability);
    let free: Vec<usize> = (0..reasons.len()).filter(|&index| reasons[index].is_none()).collect();
    let beliefs = free.iter().filter(|&&index| unknowns.list()[index].tolerance.is_some()).count();
    if rows.len() + beliefs <= free.len() {
        return Err(FitError::NoRedundancy { rows: rows.len(), free: free.len() - beliefs });
    }

    let lm = LmOptions { damping: options.damping, ..LmOptions::default() };
    let objective = Objective { unknowns: &unknowns, rows: &rows, free: &free, sigma_m };
    let began = Instant::now();
    let solution = solve(&objective, &lm);
    let solve_time = began.elapsed();

    let uncertainty = Uncertainty::new(&Observation::of(&unknowns, &solution.values, &rows, sigma_m), &free);
    let before = residuals_at(&unknowns, &start, dataset);
    let after = residuals_at(&unknowns, &solution.values, dataset);
    let base_alone = base_alone(&objective, dataset, &reasons, &lm);
    let neighbour_correlation = neighbour_correlation(dataset, &after);
    let in_blocks = neighbour_correlation.is_some_and(|correlation| correlation > ALIKE);
    let (cross_validation, left_out) = cross_validate(&objective, &lm, in_blocks).unzip();
    Ok(Fit {
        solve_time,
        identifiability,
        parameters: fitted_parameters(&unknowns, &solution.values, &free, &uncertainty, reasons),
        initial: ResidualSummary::new(&before),
        fitted: ResidualSummary::new(&after),
        initial_by_pairing: by_pairing(dataset, &before),
        fitted_by_pairing: by_pairing(dataset, &after),
        outliers: outliers(dataset, &after),
        neighbour_correlation,
        cross_validation,
        left_out: left_out.unwrap_or_default(),
        base_alone,
        residuals: after,
        uncertainty,
        solution,
        unknowns,
    })
}

/// What a length of weight one deviates by, metres: as it is stated, or else as the lengths show it. Without meaning, and not looked for,
/// where nothing is weighed against it.
fn sigma_m(dataset: &Dataset, unknowns: &Unknowns, shown_m: impl Fn(f64) -> f64) -> f64 {
    /// Each beside the one before; more change nothing that could be seen.
    const ROUNDS: usize = 2;
    if dataset.stated_sigma_m().is_some() || !unknowns.have_priors() {
        return sigma_of(dataset);
    }
    (0..ROUNDS).fold(sigma_of(dataset), |sigma_m, _| shown_m(sigma_m).max(f64::MIN_POSITIVE))
}

/// As it is stated, or as good ball-bars have it.
fn sigma_of(dataset: &Dataset) -> f64 {
    const USUAL_M: f64 = 5e-5;
    dataset.stated_sigma_m().unwrap_or(USUAL_M)
}

fn residuals_at(unknowns: &Unknowns, values: &[f64], dataset: &Dataset) -> Vec<Residual> {
    Residual::of_rows(unknowns, values, dataset.rows.iter())
}

/// What of the design's error is only that nobody knew where the robot stands: no fault of the robot, and corrected by a frame.
fn base_alone(objective: &Objective<'_>, dataset: &Dataset, reasons: &[Option<Held>], lm: &LmOptions) -> Option<ResidualSummary> {
    let base: Vec<usize> = objective.unknowns.of_chain().of_base().collect();
    let is_wanted = base.iter().all(|&index| !matches!(reasons[index], Some(Held::ByName)));
    is_wanted.then(|| {
        let values = solve(&Objective { free: &base, ..*objective }, lm).values;
        ResidualSummary::new(&residuals_at(objective.unknowns, &values, dataset))
    })
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
