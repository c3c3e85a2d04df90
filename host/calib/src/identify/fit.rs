//! A fit, whole: from a design and a dataset to parameters, how sure they are, and what poses left out say of them.

use std::time::{Duration, Instant};

use ballbar::{Chain, Damping, FreeParameters, Kinematics, Measurement, Parameter, ParameterUnit};
use thiserror::Error;

use super::frames::in_user_frames;
use super::hold::{Held, Hold};
use super::identifiability::Identifiability;
use super::lm::{LmOptions, Solution, solve};
use super::postures::postures;
use super::residual::{Residual, ResidualSummary};
use super::residuals::{ALIKE, Outlier, PairingResiduals, by_pairing, neighbour_correlation, outliers, residuals};
use super::uncertainty::Uncertainty;
use crate::kinematics::CanonicalFrames;
use crate::model::{Dataset, Robot};

/// What to hold, and how to step.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FitOptions {
    /// Parameters that stay at their design values.
    pub hold: Hold,
    /// λI or λ·diag.
    pub damping: Damping,
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

/// One parameter before and after.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FittedParameter {
    /// Which.
    pub parameter: Parameter,
    /// Unit of the values.
    pub unit: ParameterUnit,
    /// Design value, SI.
    pub initial: f64,
    /// Fitted value, SI; the design value where held.
    pub fitted: f64,
    /// Standard deviation, SI; `None` where held or undetermined.
    pub std: Option<f64>,
    /// Why it was held; `None` where free.
    pub held: Option<Held>,
}

/// How well a fit to some poses predicts the others.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CrossValidation {
    /// Parts that were left out in turn.
    pub folds: usize,
    /// Whether each part was measured in one go: where residuals follow one another, what was measured just before and after a pose
    /// shares its errors and proves nothing of it.
    pub in_blocks: bool,
    /// Weighted RMS residual of the poses while they were left out, metres.
    pub rms_m: f64,
}

/// The result of a fit.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Fit {
    /// The fitted chain, why the solve ended, its iterations and the course of its RMS.
    pub solution: Solution,
    /// Wall time of the solve alone.
    pub solve_time: Duration,
    /// What the poses can tell, judged at the design values.
    pub identifiability: Identifiability,
    /// Deviations and condition at the fitted values.
    pub uncertainty: Uncertainty,
    /// All parameters, in order.
    pub parameters: Vec<FittedParameter>,
    /// Residuals with the design values.
    pub initial: ResidualSummary,
    /// Residuals with the fitted values.
    pub fitted: ResidualSummary,
    /// Residuals by pairing with the design values.
    pub initial_by_pairing: Vec<PairingResiduals>,
    /// Residuals by pairing with the fitted values.
    pub fitted_by_pairing: Vec<PairingResiduals>,
    /// Residuals of all rows with the fitted values.
    pub residuals: Vec<Residual>,
    /// Rows that stand out after the fit.
    pub outliers: Vec<Outlier>,
    /// Correlation of residuals with the next ones measured; `None` for too few. Far from zero, something drifts or jumps.
    pub neighbour_correlation: Option<f64>,
    /// Prediction of poses left out; `None` when too few are left to fit.
    pub cross_validation: Option<CrossValidation>,
    /// Residuals of all rows while they were left out; none where there is no cross-validation.
    pub left_out: Vec<Residual>,
    /// Residuals when only where the robot's base stands is fitted, the six parameters of its first link; `None` when one of them is held by
    /// name.
    pub base_alone: Option<ResidualSummary>,
}

impl Fit {
    /// Number of free parameters.
    pub fn free_parameters(&self) -> usize {
        self.parameters.iter().filter(|parameter| parameter.held.is_none()).count()
    }
}

/// Fits the robot's parameters to the dataset: Levenberg-Marquardt on `Σ w (d_measured − d_computed)²` ([`solve`]) from the design, over
/// the parameters that [`FitOptions::hold`] leaves free; then what the result is worth, by linear theory and by poses left out in turn.
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
/// Where no parameter is held by the paper's rule or by name, the fit does not depend on the frames that the robot is written in
/// ([`CanonicalFrames`]); its result is in these frames all the same, its redundant parameters at their design values.
///
/// # Errors
/// [`FitError`] when there are no more poses than free parameters, or when a parameter is to be held that the robot lacks.
pub fn fit(robot: &Robot, dataset: &Dataset, options: &FitOptions) -> Result<Fit, FitError> {
    if options.hold != Hold::default() {
        return fit_in_own_frames(robot, dataset, options);
    }
    let frames = CanonicalFrames::new(&robot.chain);
    let canonical = Robot { chain: frames.chain().clone(), ..robot.clone() };
    let fit = fit_in_own_frames(&canonical, dataset, options)?;
    let found = Identifiability::new(&robot.chain, &dataset.measurements(), &robot.limits, &[]);
    Ok(in_user_frames(fit, robot, dataset, &frames, &found))
}

fn fit_in_own_frames(robot: &Robot, dataset: &Dataset, options: &FitOptions) -> Result<Fit, FitError> {
    let design = &robot.chain;
    let measurements = dataset.measurements();
    let names = options.hold.names.as_slice();
    if let Some(&name) = names.iter().find(|name| name.index() >= design.parameter_count()) {
        return Err(FitError::NoSuchParameter(name));
    }
    let identifiability = Identifiability::new(design, &measurements, &robot.limits, names);
    let reasons = options.hold.reasons(design, &identifiability);
    let free = FreeParameters::filtered(reasons.len(), |index| reasons[index].is_none());
    if measurements.len() <= free.len() {
        return Err(FitError::NoRedundancy { rows: measurements.len(), free: free.len() });
    }

    let lm = LmOptions { damping: options.damping, ..LmOptions::default() };
    let start = Instant::now();
    let solution = solve(design, &measurements, &free, &lm);
    let solve_time = start.elapsed();

    let uncertainty = Uncertainty::new(&solution.chain, &measurements, &free);
    let before = residuals(design, dataset);
    let after = residuals(&solution.chain, dataset);
    let base_alone = base_alone(design, dataset, &measurements, &reasons, &lm);
    let neighbour_correlation = neighbour_correlation(dataset, &after);
    let in_blocks = neighbour_correlation.is_some_and(|correlation| correlation > ALIKE);
    let (cross_validation, left_out) = cross_validate(design, &measurements, &free, &lm, in_blocks).unzip();
    Ok(Fit {
        solve_time,
        identifiability,
        parameters: fitted_parameters(design, &solution.chain, &free, &uncertainty, reasons),
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
    })
}

/// What of the design's error is only that nobody knew where the robot stands: no fault of the robot, and corrected by a frame.
fn base_alone(
    design: &Chain<f64>,
    dataset: &Dataset,
    measurements: &[Measurement<f64>],
    reasons: &[Option<Held>],
    lm: &LmOptions,
) -> Option<ResidualSummary> {
    /// Position and orientation of the first link, the first in parameter order.
    const BASE: usize = 6;
    let is_wanted = reasons.iter().take(BASE).all(|held| !matches!(held, Some(Held::ByName)));
    is_wanted.then(|| {
        let base = solve(design, measurements, &FreeParameters::all(BASE), lm).chain;
        ResidualSummary::new(&residuals(&base, dataset))
    })
}

fn fitted_parameters(
    design: &Chain<f64>,
    fitted: &Chain<f64>,
    free: &FreeParameters,
    uncertainty: &Uncertainty,
    reasons: Vec<Option<Held>>,
) -> Vec<FittedParameter> {
    let std_of = |index: usize| {
        let position = free.indices().position(|free| free == index)?;
        uncertainty.std[position]
    };
    let values = design.parameters().iter().zip(fitted.parameters()).zip(reasons).enumerate();
    values
        .map(|(index, ((&initial, &fitted), held))| {
            let parameter = Parameter::from_index(index);
            FittedParameter { parameter, unit: design.unit(parameter), initial, fitted, std: std_of(index), held }
        })
        .collect()
}

/// Cross-validation in five parts, or in more where five would leave too few poses to fit; `None` where any would. Rows of the
/// same posture stay together: lengths to other spheres of one pose are no independent proof of it. Parts are taken in turn, or in
/// blocks of what was measured in one go.
fn cross_validate(
    design: &Chain<f64>,
    measurements: &[Measurement<f64>],
    free: &FreeParameters,
    lm: &LmOptions,
    in_blocks: bool,
) -> Option<(CrossValidation, Vec<Residual>)> {
    let group_of_row = postures(design.joint_kinds(), measurements.iter().map(|measurement| &measurement.q));
    let groups = group_of_row.iter().max().map_or(0, |last| last + 1);
    let fold_of = |group: usize, folds: usize| if in_blocks { group * folds / groups } else { group % folds };
    let kept = |folds: usize, fold: usize| group_of_row.iter().filter(|&&group| fold_of(group, folds) != fold).count();
    let enough = |&folds: &usize| folds <= groups && (0..folds).all(|fold| kept(folds, fold) > free.len());
    let folds = [5, 10, groups].into_iter().find(enough)?;

    let mut left_out = vec![Residual { value_m: 0.0, weight: 1.0 }; measurements.len()];
    for fold in 0..folds {
        let is_left_out = |row: usize| fold_of(group_of_row[row], folds) == fold;
        let kept: Vec<_> = (0..measurements.len()).filter(|&row| !is_left_out(row)).map(|row| measurements[row]).collect();
        let kinematics = Kinematics::new(&solve(design, &kept, free, lm).chain);
        for row in (0..measurements.len()).filter(|&row| is_left_out(row)) {
            let measurement = &measurements[row];
            left_out[row] = Residual { value_m: kinematics.residual(measurement), weight: measurement.weight };
        }
    }
    let squares: f64 = left_out.iter().map(|f| f.weight * f.value_m.powi(2)).sum();
    Some((CrossValidation { folds, in_blocks, rms_m: (squares / measurements.len() as f64).sqrt() }, left_out))
}
