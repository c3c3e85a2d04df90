//! The margins that were asked for and those that fine steps show, and a plan that is only looked at.

use ballbar::JointKind;
use ballbar_calib::model::Robot;
use ballbar_calib::plan::{CheckFound, Margins, PlanRow, RowKind};
use serde::Serialize;

use crate::units::{mm_from_m, tidy};

/// What has to be left.
#[derive(Clone, Debug, Serialize)]
pub struct MarginLine {
    /// To the limits of revolute joints.
    pub limit_deg: f64,
    /// To the limits of prismatic joints.
    pub limit_mm: f64,
    /// To the ends of the bar's travel.
    pub travel_mm: f64,
    /// Between solids.
    pub clearance_mm: f64,
    /// From singularities.
    pub singularity: f64,
}

/// Least margins that fine steps along the plan show.
#[derive(Clone, Debug, Serialize)]
pub struct Least {
    /// How many steps were looked at.
    pub steps: usize,
    /// To the limits of revolute joints, where there are such.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit_deg: Option<f64>,
    /// To the limits of prismatic joints, where there are such.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit_mm: Option<f64>,
    /// To the ends of the bar's travel, of the robot as its file has it.
    pub travel_mm: f64,
    /// How many robots it could as well be.
    pub plausible_robots: usize,
    /// To the ends of the bar's travel, of the worst of these.
    pub plausible_travel_mm: f64,
    /// Between solids.
    pub clearance_mm: f64,
    /// The solids that come nearest.
    pub nearest: String,
    /// From 1: the row to which the way leads on which the clearance is least.
    pub nearest_row: usize,
    /// From singularities, at measured poses.
    pub singularity: f64,
}

impl Least {
    /// In the units of the screen; limits of the kinds of joints that the robot has.
    pub fn new(robot: &Robot, found: &CheckFound) -> Self {
        let has = |kind| robot.chain.joint_kinds().contains(&kind);
        Self {
            steps: found.steps,
            limit_deg: has(JointKind::Revolute).then(|| found.limit_rad.to_degrees()),
            limit_mm: has(JointKind::Prismatic).then(|| mm_from_m(found.limit_m)),
            travel_mm: mm_from_m(found.travel_m),
            plausible_robots: found.plausible_robots,
            plausible_travel_mm: mm_from_m(found.plausible_travel_m),
            clearance_mm: mm_from_m(found.clearance_m),
            nearest: found.nearest.to_string(),
            nearest_row: found.nearest_row + 1,
            singularity: found.singularity,
        }
    }

    /// Whether all margins are kept, up to the rounding of a plan's file.
    pub fn is_kept(&self, margins: &MarginLine) -> bool {
        // Nine decimals of a degree in the file.
        const ROUNDING: f64 = 1e-6;
        let keeps = |least: f64, asked: f64| least >= asked - ROUNDING;
        self.limit_deg.is_none_or(|deg| keeps(deg, margins.limit_deg))
            && self.limit_mm.is_none_or(|mm| keeps(mm, margins.limit_mm))
            && keeps(self.travel_mm.min(self.plausible_travel_mm), margins.travel_mm)
            && keeps(self.clearance_mm, margins.clearance_mm)
            && keeps(self.singularity, margins.singularity)
    }
}

impl From<&Margins> for MarginLine {
    fn from(margins: &Margins) -> Self {
        Self {
            limit_deg: tidy(margins.limit_rad.to_degrees()),
            limit_mm: tidy(mm_from_m(margins.limit_m)),
            travel_mm: tidy(mm_from_m(margins.travel_m)),
            clearance_mm: tidy(mm_from_m(margins.clearance_m)),
            singularity: margins.singularity,
        }
    }
}

/// A plan that was looked at once more.
#[derive(Clone, Debug, Serialize)]
pub struct CheckDocument {
    /// The plan's file.
    pub plan: String,
    /// Name of the robot.
    pub robot: String,
    /// Rows of the plan.
    pub rows: usize,
    /// Those to measure.
    pub poses: usize,
    /// What has to be left.
    pub margins: MarginLine,
    /// What is left.
    pub least: Least,
    /// Whether that is enough.
    pub is_kept: bool,
}

impl CheckDocument {
    /// Of a plan by its name.
    pub fn new(plan: &str, robot: &Robot, rows: &[PlanRow], least: Least, margins: &Margins) -> Self {
        let margins = MarginLine::from(margins);
        Self {
            plan: plan.to_owned(),
            robot: robot.name.clone(),
            rows: rows.len(),
            poses: rows.iter().filter(|row| row.kind == RowKind::Measure).count(),
            is_kept: least.is_kept(&margins),
            margins,
            least,
        }
    }
}
