//! A plan in numbers.

use std::path::Path;

use ballbar_calib::model::{Rig, Robot};
use ballbar_calib::plan::{
    CheckFound, Comparison, Hindrance, Plan, PlanOptions, PlanRow, Quality, RowKind, RowMargins, ShellSummary,
};
use serde::Serialize;

use super::margins::{Least, MarginLine};
use crate::units::{ScreenUnit, mm_from_m, tidy};

/// A plan, in the units of the screen.
#[derive(Clone, Debug, Serialize)]
pub struct PlanDocument {
    /// Name of the robot.
    pub robot: String,
    /// `closed form` or `numeric`.
    pub inverse_kinematics: &'static str,
    /// Bars at mid travel.
    pub bar_mm: Vec<f64>,
    /// Shell by shell.
    pub shells: Vec<ShellLine>,
    /// Points tried.
    pub points: usize,
    /// Those that were reached.
    pub reached: usize,
    /// Poses to measure.
    pub poses: usize,
    /// Points on the way.
    pub vias: usize,
    /// Of all joints as they go from row to row, poses standing still included; the bar's attaching is not.
    pub duration_s: f64,
    /// How often the bar is attached.
    pub attachments: usize,
    /// What has to be left.
    pub margins: MarginLine,
    /// What is left.
    pub least: Least,
    /// Parameters that the poses would tell.
    pub rank: usize,
    /// Parameters of the robot.
    pub parameters: usize,
    /// The most that can be independent.
    pub independent_expected: usize,
    /// Of the columns that can.
    pub condition: f64,
    /// Of all poses.
    pub quality: Option<QualityLine>,
    /// Of chosen ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub optimal: Option<ComparisonLine>,
    /// How long it took.
    pub planning_s: f64,
    /// The same gives the same plan.
    pub seed: u64,
    /// The file that was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub out: Option<String>,
    /// What is wrong with it, a sentence each.
    pub warnings: Vec<String>,
    /// Empty when they went to a file.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rows: Vec<RowLine>,
}

/// A row of the plan.
#[derive(Clone, Debug, Serialize)]
pub struct RowLine {
    /// `via` or `measure`.
    pub kind: &'static str,
    /// Name of the chuck.
    pub chuck: String,
    /// Name of the sphere.
    pub sphere: String,
    /// The bar at mid travel.
    pub bar_mm: f64,
    /// Degrees or millimetres.
    pub q: Vec<f64>,
    /// Of the bar, while it is attached.
    pub latitude_deg: Option<f64>,
    /// As the latitude.
    pub longitude_deg: Option<f64>,
    /// As the latitude.
    pub length_mm: Option<f64>,
    /// What is left.
    #[serde(flatten)]
    pub margins: Option<RowMarginLine>,
}

/// What is left on the way to a row.
#[derive(Clone, Debug, Serialize)]
pub struct RowMarginLine {
    /// To the ends of the bar's travel.
    pub travel_margin_mm: Option<f64>,
    /// Between solids.
    pub clearance_mm: f64,
    /// The solids that come nearest.
    pub nearest: String,
    /// To the limits of revolute joints.
    pub limit_margin_deg: Option<f64>,
    /// To the limits of prismatic joints.
    pub limit_margin_mm: Option<f64>,
    /// From singularities.
    pub singularity: f64,
}

/// What came of the points of a shell.
#[derive(Clone, Debug, Serialize)]
pub struct ShellLine {
    /// `chuck:sphere`.
    pub pairing: String,
    /// The bar at mid travel.
    pub bar_mm: f64,
    /// Points tried.
    pub points: usize,
    /// Those that were reached.
    pub reached: usize,
    /// Poses to measure.
    pub measured: usize,
    /// Points on the way.
    pub vias: usize,
    /// Without attaching the bar.
    pub duration_s: f64,
    /// Why the others were not.
    pub not_reached: Vec<Reason>,
}

/// Why points were not reached.
#[derive(Clone, Debug, Serialize)]
pub struct Reason {
    /// In a few words.
    pub why: String,
    /// How many.
    pub points: usize,
}

/// How well poses would tell the parameters.
#[derive(Clone, Debug, Serialize)]
pub struct QualityLine {
    /// How many.
    pub poses: usize,
    /// How many they tell.
    pub parameters: usize,
    /// Of the information.
    pub log10_determinant: f64,
    /// Of a length to a plausible deviation.
    pub mean_sensitivity_mm: f64,
    /// Of the columns.
    pub condition: f64,
    /// Of the columns.
    pub smallest_singular_mm: f64,
    /// Smallest singular value squared over the largest.
    pub noise_amplification_index_mm: f64,
    /// `None` where some parameters are not told: their errors would be missing in it.
    pub amplification: Option<f64>,
}

/// Chosen poses beside as many of the grid.
#[derive(Clone, Debug, Serialize)]
pub struct ComparisonLine {
    /// Poses that they were chosen from.
    pub pool: usize,
    /// The chosen ones.
    pub chosen: QualityLine,
    /// As many of the grid.
    pub grid_of_same_size: Option<QualityLine>,
    /// The whole grid.
    pub grid: Option<QualityLine>,
}

impl PlanDocument {
    /// Of a plan, what fine steps along it found, and the file that it went to.
    pub fn new(
        robot: &Robot,
        rig: &Rig,
        options: &PlanOptions,
        plan: &Plan,
        found: &CheckFound,
        planning_s: f64,
        out: Option<&Path>,
    ) -> Self {
        let sum = |of: fn(&ShellSummary) -> usize| plan.shells.iter().map(of).sum();
        Self {
            robot: robot.name.clone(),
            inverse_kinematics: if plan.is_closed_form { "closed form" } else { "numeric" },
            bar_mm: options.bars_m.iter().map(|&m| tidy(mm_from_m(m))).collect(),
            shells: plan.shells.iter().map(|shell| ShellLine::new(rig, shell)).collect(),
            points: sum(|shell| shell.points),
            reached: sum(|shell| shell.reached),
            poses: sum(|shell| shell.measured),
            vias: plan.rows.iter().filter(|row| row.kind == RowKind::Via).count(),
            duration_s: plan.duration_s,
            attachments: plan.shells.iter().filter(|shell| shell.measured > 0).count(),
            rank: plan.expectation.rank,
            parameters: robot.chain.parameter_count(),
            independent_expected: plan.expectation.independent,
            condition: plan.expectation.condition,
            quality: plan.quality.as_ref().map(|quality| QualityLine::new(quality, plan.expectation.independent)),
            optimal: plan.comparison.as_ref().map(|comparison| ComparisonLine::new(comparison, plan.expectation.independent)),
            planning_s,
            seed: options.seed,
            out: out.map(|path| path.display().to_string()),
            warnings: Vec::new(),
            margins: MarginLine::from(&options.margins),
            least: Least::new(robot, found),
            rows: match out {
                Some(_) => Vec::new(),
                None => plan.rows.iter().map(|row| RowLine::new(robot, rig, row)).collect(),
            },
        }
    }
}

impl QualityLine {
    fn new(quality: &Quality, independent: usize) -> Self {
        let Quality {
            poses,
            parameters,
            log10_determinant,
            mean_sensitivity_mm,
            condition,
            smallest_singular_mm,
            noise_amplification_index_mm,
            amplification,
        } = *quality;
        Self {
            poses,
            parameters,
            log10_determinant,
            mean_sensitivity_mm,
            condition,
            smallest_singular_mm,
            noise_amplification_index_mm,
            amplification: (parameters >= independent).then_some(amplification),
        }
    }
}

impl ComparisonLine {
    fn new(comparison: &Comparison, independent: usize) -> Self {
        let line = |quality: &Quality| QualityLine::new(quality, independent);
        Self {
            pool: comparison.pool,
            chosen: line(&comparison.chosen),
            grid_of_same_size: comparison.grid_of_same_size.as_ref().map(line),
            grid: comparison.grid.as_ref().map(line),
        }
    }
}

impl RowLine {
    fn new(robot: &Robot, rig: &Rig, row: &PlanRow) -> Self {
        let q = robot.chain.joint_kinds().iter().zip(row.q.as_array());
        Self {
            kind: match row.kind {
                RowKind::Via => "via",
                RowKind::Measure => "measure",
            },
            chuck: rig.chucks[row.pairing.chuck].name.clone(),
            sphere: rig.spheres[row.pairing.sphere].name.clone(),
            bar_mm: tidy(mm_from_m(row.bar_m)),
            q: q.map(|(&kind, &q)| ScreenUnit::from(kind).from_si(q)).collect(),
            latitude_deg: row.bar.map(|bar| bar.latitude_rad.to_degrees()),
            longitude_deg: row.bar.map(|bar| bar.longitude_rad.to_degrees()),
            length_mm: row.bar.map(|bar| mm_from_m(bar.length_m)),
            margins: row.margins.as_ref().map(RowMarginLine::from),
        }
    }
}

impl From<&RowMargins> for RowMarginLine {
    fn from(margins: &RowMargins) -> Self {
        // Infinite where the robot has no joint of the kind.
        let of_joints = |margin: f64| margin.is_finite().then_some(margin);
        Self {
            travel_margin_mm: margins.travel_m.map(mm_from_m),
            clearance_mm: mm_from_m(margins.clearance_m),
            nearest: margins.nearest.clone(),
            limit_margin_deg: of_joints(margins.limit_rad.to_degrees()),
            limit_margin_mm: of_joints(mm_from_m(margins.limit_m)),
            singularity: margins.singularity,
        }
    }
}

impl ShellLine {
    fn new(rig: &Rig, shell: &ShellSummary) -> Self {
        let reason = |(hindrance, points): &(Hindrance, usize)| Reason { why: hindrance.to_string(), points: *points };
        Self {
            pairing: rig.pairing_name(shell.pairing),
            bar_mm: tidy(mm_from_m(shell.bar_m)),
            points: shell.points,
            reached: shell.reached,
            measured: shell.measured,
            vias: shell.vias,
            duration_s: shell.duration_s,
            not_reached: shell.hindrances.iter().map(reason).collect(),
        }
    }
}
