//! Everything that the page says, computed from robot, rig, poses and fit. SI units, base frame.

use std::collections::BTreeMap;

use ballbar::{JointKind, Kinematics, Vector3};
use ballbar_calib::assess::Assessment;
use ballbar_calib::identify::{Fit, FittedParameter, Outlier, Residual, ResidualSummary, explanation, residuals};
use ballbar_calib::model::{Dataset, PairingId, PoseRow, Rig, Robot};
use nalgebra::DMatrix;

use super::workspace::Workspace;

/// What the facts are computed from.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// The robot that the fit began with.
    pub robot: &'a Robot,
    /// Chucks and spheres.
    pub rig: &'a Rig,
    /// The rig's file, or built-in name.
    pub rig_name: &'a str,
    /// The poses that were fitted.
    pub dataset: &'a Dataset,
    /// The fit to them.
    pub fit: &'a Fit,
    /// What the fit is worth.
    pub assessment: &'a Assessment,
    /// What else is to be known, in whole sentences.
    pub remarks: &'a [String],
}

/// One pose.
#[derive(Clone, Debug)]
pub struct RowFact {
    /// Where it lies in the order of measurement ([`ballbar_calib::assess::Order::places`]).
    pub order: f64,
    /// Number over all files, from 1.
    pub number: usize,
    /// File and line.
    pub place: String,
    /// Index into [`Facts::pairings`].
    pub pairing: usize,
    /// Encoder outputs, radians or metres.
    pub q: Vec<f64>,
    /// Azimuth of the bar at the chuck, from the base's x towards its y, 0 to 2π radians.
    pub longitude_rad: f64,
    /// Elevation of the bar above the base's x-y plane, radians.
    pub latitude_rad: f64,
    /// When it was measured, seconds, where the file says so.
    pub t_s: Option<f64>,
    /// Length of the bar at mid travel, metres, where the file says so.
    pub bar_m: Option<f64>,
    /// The measured length, metres.
    pub length_m: f64,
    /// The sphere as the fit sees it, metres.
    pub sphere_m: Vector3<f64>,
    /// Residual with the design, measured less computed, metres.
    pub before_m: f64,
    /// The same with the fit.
    pub after_m: f64,
    /// The same times the root of the row's weight, which is 1 on average: what scatters alike in all rows, metres.
    pub whitened_m: f64,
    /// That weight.
    pub weight: f64,
}

/// A half sphere about a chuck on which poses were measured.
#[derive(Clone, Copy, Debug)]
pub struct Shell {
    /// Index into [`Facts::chucks`].
    pub chuck: usize,
    /// Median of the lengths, metres.
    pub radius_m: f64,
}

/// Singular values of all columns at the design, scaled.
#[derive(Clone, Debug)]
pub struct Singular {
    /// Descending.
    pub values: Vec<f64>,
    /// How many count.
    pub rank: usize,
}

/// Correlations of the free parameters.
#[derive(Clone, Debug)]
pub struct Correlation {
    /// Their names.
    pub names: Vec<String>,
    /// −1 to 1; zero where a parameter is undetermined.
    pub values: DMatrix<f64>,
}

/// All of it.
#[derive(Clone, Debug)]
pub struct Facts {
    /// Name of the robot.
    pub robot: String,
    /// The robot's file, or built-in name.
    pub robot_file: String,
    /// The rig's.
    pub rig_file: String,
    /// Files of the fitted poses.
    pub files: Vec<String>,
    /// Kinds of the joints.
    pub joints: Vec<JointKind>,
    /// Chucks: name and centre, metres.
    pub chucks: Vec<(String, Vector3<f64>)>,
    /// Pairings that occur, as `chuck:sphere`, and the chuck's index.
    pub pairings: Vec<(String, usize)>,
    /// The fitted poses, in the order of measurement.
    pub rows: Vec<RowFact>,
    /// The poses that were left out because they contradict the others, each with its likely cause.
    pub left_out: Vec<(RowFact, String)>,
    /// Where they lie, as far as their lengths are alike.
    pub shells: Vec<Shell>,
    /// Residuals of the fitted poses with the design.
    pub before: ResidualSummary,
    /// Residuals of the fitted poses with the fit.
    pub after: ResidualSummary,
    /// What the result is called, and what that rests on.
    pub assessment: Assessment,
    /// Residuals when only where the robot's base stands was fitted.
    pub base_alone: Option<ResidualSummary>,
    /// All parameters.
    pub parameters: Vec<FittedParameter>,
    /// What the poses can tell.
    pub singular: Singular,
    /// RMS at the start and after each step, metres.
    pub rms_history_m: Vec<f64>,
    /// How many steps the solve took.
    pub steps: usize,
    /// Why the solve ended.
    pub explanation: &'static str,
    /// The most parameters of this robot that any lengths can tell (the paper's eq. 1).
    pub independent: usize,
    /// How many of them the fit told: the rank of the free columns.
    pub told: usize,
    /// Standard deviation of one length, metres.
    pub sigma_m: Option<f64>,
    /// Correlation of residuals with the next ones measured.
    pub neighbour_correlation: Option<f64>,
    /// Rows that stand out: index into `rows`.
    pub outliers: Vec<Outlier>,
    /// Of the free parameters.
    pub correlation: Correlation,
    /// Predicted error of the tool.
    pub workspace: Workspace,
    /// What else is to be known.
    pub remarks: Vec<String>,
}

impl Facts {
    /// Computes them.
    pub fn new(inputs: &Inputs<'_>) -> Self {
        let Inputs { robot, rig, dataset, fit, .. } = inputs;
        let pairings = dataset.pairings();
        let before = residuals(&robot.kinematics(), dataset);
        let all = rows(inputs, &pairings, &before);
        let (rows, left_out) = divided(inputs, all);
        // From rows of the dataset to those that were fitted.
        let is_before = |row: usize| fit.wrong_rows.iter().filter(|wrong| wrong.row < row).count();
        let outliers = fit.outliers.iter().map(|outlier| Outlier { row: outlier.row - is_before(outlier.row), ..*outlier });
        Self {
            robot: robot.name.clone(),
            robot_file: robot.source.as_str().to_owned(),
            rig_file: inputs.rig_name.to_owned(),
            files: dataset.files.clone(),
            joints: robot.chain.joint_kinds().to_vec(),
            chucks: rig.chucks.iter().map(|chuck| (chuck.name.clone(), chuck.position_m)).collect(),
            pairings: pairings.iter().map(|&id| (rig.pairing_name(id), id.chuck)).collect(),
            before: fit.initial,
            after: fit.fitted,
            assessment: inputs.assessment.clone(),
            base_alone: fit.base_alone,
            parameters: fit.parameters.clone(),
            singular: Singular {
                values: fit.identifiability.spectrum.singular_values.clone(),
                rank: fit.identifiability.spectrum.rank,
            },
            rms_history_m: fit.solution.rms_history_m.clone(),
            steps: fit.solution.steps(),
            explanation: explanation(fit.solution.status),
            independent: fit.unknowns.independent(),
            told: fit.uncertainty.spectrum.rank,
            sigma_m: fit.uncertainty.sigma_m,
            neighbour_correlation: fit.neighbour_correlation,
            outliers: outliers.collect(),
            correlation: correlation(fit),
            workspace: Workspace::new(robot, fit),
            remarks: inputs.remarks.to_vec(),
            shells: shells(&rows, &pairings),
            left_out,
            rows,
        }
    }

    /// Number of parameters that the fit was free to change.
    pub fn free_parameters(&self) -> usize {
        self.parameters.iter().filter(|parameter| parameter.held.is_none()).count()
    }

    /// Whether the files say that some lengths are surer than others.
    pub fn is_weighted(&self) -> bool {
        self.rows.iter().any(|row| row.whitened_m != row.after_m)
    }
}

fn rows(inputs: &Inputs<'_>, pairings: &[PairingId], before: &[Residual]) -> Vec<RowFact> {
    let Inputs { robot, dataset, fit, assessment, .. } = inputs;
    let kinematics = Kinematics::new(&fit.solution.chain);
    let fact = |(i, row): (usize, &PoseRow)| {
        let sphere_m = kinematics.point_in_base(&row.measurement.q, &row.measurement.pairing.sphere_tool_m);
        let bar_m = sphere_m - row.measurement.pairing.chuck_base_m;
        RowFact {
            order: assessment.order.places[i],
            number: row.number,
            place: dataset.place(i),
            pairing: pairings.iter().position(|&id| id == row.pairing).unwrap_or_default(),
            q: row.measurement.q.as_array()[..robot.chain.joints()].to_vec(),
            longitude_rad: bar_m.y.atan2(bar_m.x).rem_euclid(std::f64::consts::TAU),
            latitude_rad: bar_m.z.atan2(bar_m.x.hypot(bar_m.y)),
            t_s: row.t_s,
            bar_m: row.bar_m,
            length_m: row.measurement.length_m,
            sphere_m,
            before_m: before[i].value_m,
            after_m: fit.residuals[i].value_m,
            whitened_m: fit.residuals[i].whitened_m(),
            weight: fit.residuals[i].weight,
        }
    };
    dataset.rows.iter().enumerate().map(fact).collect()
}

/// Those that were fitted, and those that were not, with what is thought of them.
fn divided(inputs: &Inputs<'_>, rows: Vec<RowFact>) -> (Vec<RowFact>, Vec<(RowFact, String)>) {
    let Inputs { fit, assessment, .. } = inputs;
    let (mut fitted, mut left_out) = (Vec::new(), Vec::new());
    for (i, row) in rows.into_iter().enumerate() {
        if fit.wrong_rows.iter().any(|wrong| wrong.row == i) {
            let cause = assessment.causes.iter().find(|cause| cause.rows.contains(&i));
            left_out.push((row, cause.map(ToString::to_string).unwrap_or_default()));
        } else {
            fitted.push(row);
        }
    }
    (fitted, left_out)
}

/// One shell a chuck and bar, where the lengths differ by no more than a bar travels.
fn shells(rows: &[RowFact], pairings: &[PairingId]) -> Vec<Shell> {
    /// Of the median length; the longest and shortest of other lengths lie on no sphere worth drawing.
    const WIDEST: f64 = 0.25;
    let mut lengths: BTreeMap<(usize, Option<u64>), Vec<f64>> = BTreeMap::new();
    for row in rows {
        let bar = row.bar_m.map(f64::to_bits);
        lengths.entry((pairings[row.pairing].chuck, bar)).or_default().push(row.length_m);
    }
    let shell = |((chuck, _), mut lengths_m): ((usize, Option<u64>), Vec<f64>)| {
        lengths_m.sort_by(f64::total_cmp);
        let radius_m = lengths_m[lengths_m.len() / 2];
        (lengths_m[lengths_m.len() - 1] - lengths_m[0] <= WIDEST * radius_m).then_some(Shell { chuck, radius_m })
    };
    lengths.into_iter().filter_map(shell).collect()
}

fn correlation(fit: &Fit) -> Correlation {
    let free = fit.parameters.iter().filter(|parameter| parameter.held.is_none());
    let names: Vec<String> = free.map(|parameter| parameter.name.clone()).collect();
    let uncertainty = &fit.uncertainty;
    let value = |i: usize, j: usize| match (uncertainty.std[i], uncertainty.std[j]) {
        (Some(a), Some(b)) if a > 0.0 && b > 0.0 => (uncertainty.covariance[(i, j)] / (a * b)).clamp(-1.0, 1.0),
        _ => 0.0,
    };
    Correlation { values: DMatrix::from_fn(names.len(), names.len(), value), names }
}
