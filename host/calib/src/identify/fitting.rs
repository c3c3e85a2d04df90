//! A fit, whole: from a design and a dataset to parameters, how sure they are, and what poses left out say of them.

use std::time::{Duration, Instant};

use ballbar::{Chain, JointTerms, LmOptions};

use super::beliefs::Beliefs;
use super::cross_validation::cross_validate;
use super::estimate::{Estimate, Estimator, Rule};
use super::fit::{Fit, FittedParameter, PriorFacts, Released};
use super::freedom::{Freedom, what_poses_tell};
use super::groups::leave_groups_out;
use super::hold::Held;
use super::in_user_frames::in_user_frames;
use super::lm::{Objective, solve};
use super::noise::believed_sigma_m;
use super::options::{FitError, FitOptions, Loss};
use super::reference::Dependence;
use super::residual::{Residual, ResidualSummary};
use super::residuals::{ALIKE, by_pairing, neighbour_correlation, outliers};
use super::robust::{WrongRow, estimate_robustly};
use super::uncertainty::Uncertainty;
use crate::kinematics::CanonicalFrames;
use crate::model::{Dataset, PoseRow, Robot};
use crate::unknowns::Unknowns;

/// Fits the robot's parameters, and what else [`FitOptions::unknowns`] asks for, to the dataset: Levenberg-Marquardt on
/// `Σ f²/σ² + Σ (change/tolerance)²` from the design, over what [`FitOptions::hold`] leaves free, of the rows that no others contradict; then
/// what the result is worth, by linear theory and by poses left out in turn.
///
/// Which parameters are held by themselves does not depend on how the robot's frames are written: they are found out, and the others fitted, in
/// canonical frames, and values and deviations come back in the robot's own. Whoever holds a parameter by name, or none, or the paper's, means
/// those of the frames as they are written.
///
/// With [`FitOptions::plain`] the minimum is the paper's least-squares solution (A. Goswami, A. Quaid and M. Peshkin, IEEE Control Systems 13(5),
/// 1993); which parameters are free is then found anew for each dataset ([`Identifiability`](super::Identifiability)).
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
    let dependence = Dependence::new(&robot.chain, &robot.limits);
    let found = what_poses_tell(&unknowns, &rows, &dependence, believed_sigma_m(dataset), &[]);
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
    if let Some(&name) = options.hold.names.iter().find(|name| name.index() >= unknowns.of_chain().len()) {
        return Err(FitError::NoSuchParameter(name));
    }
    let rows: Vec<&PoseRow> = dataset.rows.iter().collect();
    let freedom = Freedom::new(&unknowns, robot, dataset, options);
    let free = |first: &[usize]| freedom.free(first);
    let rule = match &freedom.prior {
        None => Rule::Plain(free(&[])),
        Some(chain) => Rule::Prior { chain, free: &free },
    };
    let lm = LmOptions { damping: options.damping, ..LmOptions::default() };
    let (stated_m, usual_m) = (dataset.stated_sigma_m(), freedom.usual_m);
    let mut estimator = Estimator { unknowns: &unknowns, lm, stated_m, usual_m, rule };
    let start = estimator.first_beliefs();
    if rows.len() + start.believed() <= start.free().len() {
        return Err(FitError::NoRedundancy { rows: rows.len(), free: start.free().len() - start.believed() });
    }

    let began = Instant::now();
    let stated_m = stated_m.filter(|_| freedom.prior.is_some());
    let mut found = Found::new(&estimator, &rows, &start, options.loss, (stated_m, stated_m));
    if let Some(seen_m) = found.uncertainty.beyond_stated_m(stated_m).filter(|_| !found.is_hopeless) {
        // What the rows state is not what they do: beliefs are weighed against what they do.
        estimator.stated_m = Some(seen_m);
        found = Found::new(&estimator, &rows, &start, options.loss, (Some(seen_m), None));
    }
    let solve_time = began.elapsed();
    let found_by = FoundBy { unknowns: &unknowns, dataset, lm, freedom: &freedom, solve_time };
    Ok(found.told(found_by))
}

/// An estimate, and the rows that it was made from.
struct Found {
    estimate: Estimate,
    wrong_rows: Vec<WrongRow>,
    /// Indices of the others.
    kept: Vec<usize>,
    uncertainty: Uncertainty,
    /// Whether no robot explains the lengths.
    is_hopeless: bool,
}

/// How it was found.
struct FoundBy<'a> {
    unknowns: &'a Unknowns,
    dataset: &'a Dataset,
    lm: LmOptions,
    freedom: &'a Freedom<'a>,
    solve_time: Duration,
}

impl Found {
    /// Deviations are by what lengths deviate by, where that is given, and those of each alone, where they are ([`Estimate::uncertainty`]), metres.
    fn new(
        estimator: &Estimator<'_>,
        rows: &[&PoseRow],
        start: &Beliefs,
        loss: Loss,
        (deviation_m, own_m): (Option<f64>, Option<f64>),
    ) -> Self {
        let (estimate, wrong_rows) = match loss {
            Loss::Tukey => estimate_robustly(estimator, rows, start),
            Loss::None => (estimator.estimate(rows), Vec::new()),
        };
        let is_wrong = |row: usize| wrong_rows.binary_search_by_key(&row, |wrong| wrong.row).is_ok();
        let kept: Vec<usize> = (0..rows.len()).filter(|&row| !is_wrong(row)).collect();
        let of_kept: Vec<&PoseRow> = kept.iter().map(|&row| rows[row]).collect();
        let uncertainty = estimate.uncertainty(estimator.unknowns, &of_kept, deviation_m, own_m);
        let is_hopeless = estimator.is_hopeless(&of_kept, &estimate);
        Self { estimate, wrong_rows, kept, uncertainty, is_hopeless }
    }

    /// All that is to be known of it.
    fn told(self, by: FoundBy<'_>) -> Fit {
        let FoundBy { unknowns, dataset, lm, freedom, solve_time } = by;
        let Self { estimate, wrong_rows, kept, uncertainty, is_hopeless } = self;
        let Estimate { beliefs, sigma_m, weighing, released, solution } = estimate;
        let reasons = freedom.reasons(&freedom.indices(&weighing.released));
        let rows: Vec<&PoseRow> = kept.iter().map(|&row| &dataset.rows[row]).collect();
        let objective = Objective { unknowns, rows: &rows, beliefs: &beliefs, sigma_m };
        let residuals_at = |values: &[f64]| {
            let mut residuals = Residual::of_rows(unknowns, values, dataset.rows.iter());
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
            kept.iter().zip(of_kept).for_each(|(&row, residual)| left_out[row] = residual);
            left_out
        });
        let released =
            released.iter().map(|share| Released { part: share.part, change: share.change, tolerance: share.tolerance });
        Fit {
            solve_time,
            identifiability: freedom.identifiability.clone(),
            prior: freedom.prior.is_some().then(|| PriorFacts { factor: weighing.factor, sigma_m, released: released.collect() }),
            parameters: fitted_parameters(unknowns, &solution.values, beliefs.free(), &uncertainty, reasons),
            initial: ResidualSummary::new(&before),
            fitted: ResidualSummary::new(&after),
            initial_by_pairing: by_pairing(dataset, &before),
            fitted_by_pairing: by_pairing(dataset, &after),
            outliers: outliers(dataset, &after),
            neighbour_correlation,
            cross_validation,
            left_out,
            left_out_groups: leave_groups_out(dataset, &kept, (unknowns, &solution.values), &beliefs, &uncertainty),
            base_alone,
            residuals: after,
            uncertainty,
            wrong_rows,
            solution,
            unknowns: unknowns.clone(),
        }
    }
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
