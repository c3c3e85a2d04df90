//! The margins that were asked for and those that fine steps show, and a plan that is only looked at.

use ballbar::JointKind;
use ballbar_calib::model::Robot;
use ballbar_calib::plan::{CheckFound, Margins, PlanRow, RowKind};
use serde::Serialize;

use super::report::Report;
use crate::terminal::table::{Columns, fixed};
use crate::units::{mm_from_m, tidy};

/// What has to be left.
#[derive(Serialize)]
pub(super) struct MarginLine {
    limit_deg: f64,
    limit_mm: f64,
    travel_mm: f64,
    clearance_mm: f64,
    singularity: f64,
}

/// Least margins that fine steps along the plan show.
#[derive(Serialize)]
pub(super) struct Least {
    steps: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    limit_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    limit_mm: Option<f64>,
    travel_mm: f64,
    plausible_robots: usize,
    plausible_travel_mm: f64,
    clearance_mm: f64,
    nearest: String,
    /// From 1: the row to which the way leads on which the clearance is least.
    nearest_row: usize,
    singularity: f64,
}

impl Least {
    /// In the units of the screen; limits of the kinds of joints that the robot has.
    pub(super) fn new(robot: &Robot, found: &CheckFound) -> Self {
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

    pub(super) fn text(&self, margins: &MarginLine) -> String {
        let mut table = Columns::new(&["<margin", "asked for", "least found", "<where"]);
        let mut line = |what: &str, asked: f64, least: f64, decimals: usize, place: String| {
            table.row([what.to_owned(), fixed(asked, decimals), fixed(least, decimals), place]);
        };
        if let Some(limit_deg) = self.limit_deg {
            line("to joint limits, deg", margins.limit_deg, limit_deg, 1, String::new());
        }
        if let Some(limit_mm) = self.limit_mm {
            line("to slide limits, mm", margins.limit_mm, limit_mm, 1, String::new());
        }
        line("to the ends of travel, mm", margins.travel_mm, self.travel_mm, 1, "nominal robot".to_owned());
        let robots = format!("worst of {} plausible robots", self.plausible_robots);
        line("to the ends of travel, mm", margins.travel_mm, self.plausible_travel_mm, 1, robots);
        let nearest = format!("{}, on the way to row {}", self.nearest, self.nearest_row);
        line("between solids, mm", margins.clearance_mm, self.clearance_mm, 1, nearest);
        line("from singularities", margins.singularity, self.singularity, 3, "measured poses".to_owned());
        table.text()
    }

    pub(super) fn is_kept(&self, margins: &MarginLine) -> bool {
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
#[derive(Serialize)]
pub(super) struct CheckReport {
    plan: String,
    robot: String,
    rows: usize,
    poses: usize,
    margins: MarginLine,
    least: Least,
    pub(super) is_kept: bool,
}

impl CheckReport {
    pub(super) fn new(plan: &str, robot: &Robot, rows: &[PlanRow], least: Least, margins: &Margins) -> Self {
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

impl Report for CheckReport {
    fn text(&self) -> String {
        let verdict = if self.is_kept { "All margins are kept." } else { "Margins are NOT kept." };
        format!(
            "{}: {} rows for {}, {} of them to measure; looked at in {} steps\n\n{}\n{verdict}\n",
            self.plan,
            self.rows,
            self.robot,
            self.poses,
            self.least.steps,
            self.least.text(&self.margins)
        )
    }
}
