//! The experiment end to end: shells, fit, the other radius, Table I and II, residuals, and what one sphere can tell.

use ballbar::{Kinematics, Measurement, Parameter, ParameterUnit, Vector3};
use ballbar_calib::identify::{
    AndersonDarling, Fit, FitError, FitOptions, FittedParameter, Hold, Observation, Residual, ResidualSummary, Spectrum,
    anderson_darling, fit, residuals,
};
use ballbar_calib::model::{Dataset, PoseRow, Robot};
use ballbar_calib::simulate::{ShellError, ShellPose, Shells, ToolError, tool_error};
use miette::Diagnostic;
use thiserror::Error;

use super::pairings::{PairingRanks, RankClass};
use super::stated;
use super::stewart::{StewartPlatform, amplification};
use crate::files::{InputError, open_rig, open_robot};
use crate::remedies::Remedied;
use crate::units::m_from_mm;

/// All that the experiment gives.
#[derive(Clone, Debug)]
pub struct Experiment {
    /// The fit to the 46 cm shells, held as in the paper.
    pub fit: Fit,
    /// Residuals on the 61 cm shells with the fitted parameters.
    pub other_radius: ResidualSummary,
    /// Whether the fit's residuals look normal.
    pub normality: Option<AndersonDarling>,
    /// Fitted residuals by longitude of the shell (Fig. 3).
    pub by_longitude: Vec<Longitude>,
    /// Free parameters beside Table II's optimised ones.
    pub table_two: Vec<Recovered>,
    /// Largest difference to Table II of a parameter fitted to lengths without noise; metres, radians or 1.
    pub noise_free_worst: f64,
    /// Ranks of all subsets of the nine pairings (Table I).
    pub table_one: Vec<RankClass>,
    /// Singular values with one sphere and three chucks.
    pub one_sphere: Spectrum,
    /// The same with the sphere on the axis of joint 6.
    pub sphere_on_axis: Spectrum,
    /// The same with the sphere 0.001 mm beside that axis.
    pub sphere_beside_axis: Spectrum,
    /// Position error of a Stewart platform of six bars per bar error.
    pub stewart_amplification: f64,
    /// Tool error over the workspace with the design parameters.
    pub tool_before: ToolError,
    /// Tool error over the workspace with the fitted parameters.
    pub tool_after: ToolError,
}

/// Residuals on a slice of longitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Longitude {
    /// Where the slice begins, degrees.
    pub from_deg: f64,
    /// Where it ends, degrees.
    pub to_deg: f64,
    /// Its residuals.
    pub summary: ResidualSummary,
}

/// A free parameter: Table II's design and optimised values, and what the fit to simulated lengths gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recovered {
    /// Which.
    pub parameter: Parameter,
    /// Unit of the values.
    pub unit: ParameterUnit,
    /// Table II, design; SI.
    pub design: f64,
    /// Table II, optimised: the truth of the simulation; SI.
    pub truth: f64,
    /// Fitted; SI.
    pub fitted: f64,
    /// Standard deviation of the fitted value; SI.
    pub std: Option<f64>,
}

/// Why the experiment could not be run.
#[derive(Debug, Error, Diagnostic)]
pub enum ExperimentError {
    /// A built-in file is broken.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Input(#[from] InputError),
    /// A shell is out of reach.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Shell(#[from] Remedied<ShellError>),
    /// No fit.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Fit(#[from] Remedied<FitError>),
}

/// Poses over which tool errors are taken.
const WORKSPACE_POSES: usize = 5_000;

/// Runs the experiment; `on_step` is called with a share of the whole, which adds up to 1.
///
/// # Errors
/// [`ExperimentError`] when a built-in file, a shell or a fit fails.
pub fn run(seed: u64, mut on_step: impl FnMut(f64)) -> Result<Experiment, ExperimentError> {
    let design = open_robot("puma560")?;
    let truth = open_robot("puma560-optimised")?;
    let rig = open_rig("triangles")?;
    let shells = |radius_mm: f64, sigma_mm: f64, seed: u64| {
        let pairings = rig.all_pairings();
        let shells = Shells {
            planned_with: &design,
            truth: &truth,
            rig: &rig,
            pairings: &pairings,
            bar_m: m_from_mm(radius_mm),
            per_pairing: stated::POSES_PER_PAIRING,
            sigma_m: m_from_mm(sigma_mm),
            seed,
        };
        shells.simulate(|| ()).map_err(Remedied)
    };
    let options = FitOptions { hold: Hold::paper(), ..FitOptions::plain() };

    let fitted_shells = shells(stated::FITTED_RADIUS_MM, stated::FITTED_RMS_MM, seed)?;
    on_step(0.1);
    let fit_of = |poses: &[ShellPose]| fit(&design, &dataset(poses), &options).map_err(Remedied);
    let fit = fit_of(&fitted_shells)?;
    let noise_free = fit_of(&shells(stated::FITTED_RADIUS_MM, 0.0, seed)?)?;
    on_step(0.1);
    let other = dataset(&shells(stated::OTHER_RADIUS_MM, stated::FITTED_RMS_MM, seed.wrapping_add(1))?);
    on_step(0.1);

    let rows: Vec<_> = fitted_shells.iter().map(|pose| (pose.row.pairing, pose.row.measurement)).collect();
    let ranks = PairingRanks::new(&design.chain, &rows);
    let share = 0.7 / f64::from(ranks.subsets());
    let table_one = ranks.classes(|| on_step(share));

    let fitted = Kinematics::new(&fit.solution.chain);
    let platform = StewartPlatform { base_side_m: 0.2, plate_side_m: 0.1, bar_m: m_from_mm(stated::FITTED_RADIUS_MM) };
    Ok(Experiment {
        other_radius: ResidualSummary::new(&residuals(&fitted, &other)),
        normality: anderson_darling(&fit.residuals.iter().map(|f| f.value_m).collect::<Vec<_>>()),
        by_longitude: by_longitude(&fitted_shells, &fit.residuals),
        noise_free_worst: worst_difference(noise_free.solution.chain.parameters(), truth.chain.parameters()),
        table_one,
        one_sphere: with_sphere_at(&design, &fitted_shells, rig.spheres[0].position_m),
        sphere_on_axis: with_sphere_at(&design, &fitted_shells, Vector3::new(0.0, 0.0, 0.05)),
        sphere_beside_axis: with_sphere_at(&design, &fitted_shells, Vector3::new(1e-6, 0.0, 0.05)),
        stewart_amplification: amplification(&platform).unwrap_or(f64::NAN),
        tool_before: tool_error(&truth.chain, &design.chain, &truth.limits, WORKSPACE_POSES, seed),
        tool_after: tool_error(&truth.chain, &fit.solution.chain, &truth.limits, WORKSPACE_POSES, seed),
        table_two: recovered(&fit, &truth),
        fit,
    })
}

/// Simulated poses as if they had been read from a file.
fn dataset(poses: &[ShellPose]) -> Dataset {
    let numbered = poses.iter().enumerate().map(|(i, pose)| PoseRow { line: i + 1, ..pose.row.clone() });
    Dataset { rows: numbered.collect(), files: vec!["simulated".to_owned()] }
}

fn by_longitude(poses: &[ShellPose], residuals: &[Residual]) -> Vec<Longitude> {
    const SLICES: usize = 12;
    let width = 360.0 / SLICES as f64;
    let slice = |i: usize| {
        let range = i as f64 * width..(i + 1) as f64 * width;
        let inside = poses.iter().zip(residuals).filter(|(pose, _)| range.contains(&pose.longitude_rad.to_degrees()));
        let inside: Vec<Residual> = inside.map(|(_, &f)| f).collect();
        Longitude { from_deg: range.start, to_deg: range.end, summary: ResidualSummary::new(&inside) }
    };
    (0..SLICES).map(slice).filter(|slice| slice.summary.count > 0).collect()
}

fn worst_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// What the same poses could tell if all bars ended at one sphere.
fn with_sphere_at(robot: &Robot, poses: &[ShellPose], sphere_tool_m: Vector3<f64>) -> Spectrum {
    let moved = |pose: &ShellPose| {
        let mut measurement: Measurement<f64> = pose.row.measurement;
        measurement.pairing.sphere_tool_m = sphere_tool_m;
        measurement
    };
    let measurements: Vec<_> = poses.iter().map(moved).collect();
    Spectrum::new(&Observation::new(&robot.chain, &measurements).jacobian)
}

fn recovered(fit: &Fit, truth: &Robot) -> Vec<Recovered> {
    let free = fit.parameters.iter().filter(|parameter| parameter.held.is_none());
    let recovered = |parameter: &FittedParameter| {
        let which: Parameter = parameter.name.parse().ok()?;
        Some(Recovered {
            parameter: which,
            unit: parameter.unit,
            design: parameter.initial,
            truth: truth.chain.parameters()[which.index()],
            fitted: parameter.fitted,
            std: parameter.std,
        })
    };
    free.filter_map(recovered).collect()
}
