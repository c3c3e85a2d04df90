//! What `host-cal plan` prints.

use std::path::Path;

use ballbar::JointKind;
use serde::Serialize;

use super::report::Report;
use super::table::{Columns, fixed};
use crate::files::{PlanRow, Rig, Robot, RowKind};
use crate::plan::{CheckFound, Comparison, Margins, Plan, PlanOptions, Quality, ShellSummary};
use crate::units::{mm_from_m, tidy};

/// A plan, in numbers.
#[derive(Serialize)]
pub(super) struct PlanReport {
    robot: String,
    inverse_kinematics: &'static str,
    bar_mm: Vec<f64>,
    shells: Vec<ShellLine>,
    points: usize,
    reached: usize,
    poses: usize,
    vias: usize,
    /// Of all joints as they go from row to row, poses standing still included; the bar's attaching is not.
    duration_s: f64,
    attachments: usize,
    margins: MarginLine,
    least: Least,
    rank: usize,
    parameters: usize,
    independent_expected: usize,
    condition: f64,
    quality: Option<QualityLine>,
    #[serde(skip_serializing_if = "Option::is_none")]
    optimal: Option<ComparisonLine>,
    planning_s: f64,
    seed: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    out: Option<String>,
    pub(super) warnings: Vec<String>,
}

#[derive(Serialize)]
struct ShellLine {
    pairing: String,
    bar_mm: f64,
    points: usize,
    reached: usize,
    measured: usize,
    vias: usize,
    duration_s: f64,
    not_reached: Vec<Reason>,
}

#[derive(Serialize)]
struct Reason {
    why: String,
    points: usize,
}

#[derive(Serialize)]
struct MarginLine {
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

#[derive(Serialize)]
struct QualityLine {
    poses: usize,
    parameters: usize,
    log10_determinant: f64,
    mean_sensitivity_mm: f64,
    condition: f64,
    smallest_singular_mm: f64,
    noise_amplification_index_mm: f64,
    amplification: f64,
}

#[derive(Serialize)]
struct ComparisonLine {
    pool: usize,
    chosen: QualityLine,
    grid_of_same_size: Option<QualityLine>,
    grid: Option<QualityLine>,
}

impl From<&Quality> for QualityLine {
    fn from(quality: &Quality) -> Self {
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
            amplification,
        }
    }
}

impl From<&Comparison> for ComparisonLine {
    fn from(comparison: &Comparison) -> Self {
        Self {
            pool: comparison.pool,
            chosen: (&comparison.chosen).into(),
            grid_of_same_size: comparison.grid_of_same_size.as_ref().map(QualityLine::from),
            grid: comparison.grid.as_ref().map(QualityLine::from),
        }
    }
}

impl ShellLine {
    fn new(rig: &Rig, shell: &ShellSummary) -> Self {
        let reason =
            |(hindrance, points): &(crate::plan::Hindrance, usize)| Reason { why: hindrance.to_string(), points: *points };
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

    fn text(&self, margins: &MarginLine) -> String {
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

    fn is_kept(&self, margins: &MarginLine) -> bool {
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

impl PlanReport {
    pub(super) fn new(
        robot: &Robot,
        rig: &Rig,
        options: &PlanOptions,
        plan: &Plan,
        found: &CheckFound,
        planning_s: f64,
        out: Option<&Path>,
    ) -> Self {
        let sum = |of: fn(&ShellSummary) -> usize| plan.shells.iter().map(of).sum();
        let margins = MarginLine::from(&options.margins);
        let least = Least::new(robot, found);
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
            quality: plan.quality.as_ref().map(QualityLine::from),
            optimal: plan.comparison.as_ref().map(ComparisonLine::from),
            planning_s,
            seed: options.seed,
            out: out.map(|path| path.display().to_string()),
            warnings: warnings(rig, plan, &least, &margins),
            margins,
            least,
        }
    }
}

fn warnings(rig: &Rig, plan: &Plan, least: &Least, margins: &MarginLine) -> Vec<String> {
    let mut warnings = Vec::new();
    let blocked = plan.shells.iter().filter(|shell| !shell.is_approach_clear);
    warnings.extend(blocked.map(|shell| {
        format!(
            "no clear way was found to the first pose of pairing {}, bar {} mm, with the bar off: bring the robot there by hand",
            rig.pairing_name(shell.pairing),
            tidy(mm_from_m(shell.bar_m))
        )
    }));
    if warnings.is_empty() && !least.is_kept(margins) {
        warnings.push("fine steps along the plan show less than the margins asked for; see the table".to_owned());
    }
    warnings
}

impl Report for PlanReport {
    fn text(&self) -> String {
        let bars: Vec<String> = self.bar_mm.iter().map(f64::to_string).collect();
        let mut text = format!(
            "{}, bar {} mm; inverse kinematics {}\n\n",
            self.robot,
            bars.join(" and "),
            match self.inverse_kinematics {
                "numeric" => "from many starts",
                _ => "in closed form",
            }
        );
        let mut table =
            Columns::new(&["<pairing", "bar mm", "points", "reached", "measured", "vias", "min", "<not reached because"]);
        for shell in &self.shells {
            let why: Vec<String> = shell.not_reached.iter().map(|reason| format!("{} {}", reason.why, reason.points)).collect();
            let counts = [shell.points, shell.reached, shell.measured, shell.vias].map(|count| count.to_string());
            let [points, reached, measured, vias] = counts;
            let minutes = fixed(shell.duration_s / 60.0, 1);
            let bar_mm = shell.bar_mm.to_string();
            table.row([shell.pairing.clone(), bar_mm, points, reached, measured, vias, minutes, why.join(", ")]);
        }
        text += &table.text();
        text += &format!(
            "\n{} of {} points reached; {} poses to measure, {} via points, the bar attached {} times\nexpected duration {} without attaching the bar; planned in {:.1} s\n\n",
            self.reached,
            self.points,
            self.poses,
            self.vias,
            self.attachments,
            hours(self.duration_s),
            self.planning_s
        );
        text += &self.least.text(&self.margins);
        text += &format!(
            "\nexpected rank {} of {} parameters; {} can be independent; condition {:.1}\n",
            self.rank, self.parameters, self.independent_expected, self.condition
        );
        text += &self.quality_text();
        if let Some(out) = &self.out {
            text += &format!("\nwritten to {out}\n");
        }
        text
    }
}

impl PlanReport {
    fn quality_text(&self) -> String {
        let sets: Vec<(&str, &QualityLine)> = match &self.optimal {
            Some(optimal) => [
                ("D-optimal", Some(&optimal.chosen)),
                ("as many of the grid", optimal.grid_of_same_size.as_ref()),
                ("the whole grid", optimal.grid.as_ref()),
            ]
            .into_iter()
            .filter_map(|(name, quality)| Some((name, quality?)))
            .collect(),
            None => self.quality.iter().map(|quality| ("this plan", quality)).collect(),
        };
        let mut table =
            Columns::new(&["<poses", "", "log10 det", "condition", "smallest sv mm", "noise index mm", "noise at the tool"]);
        for (name, quality) in sets {
            table.row([
                name.to_owned(),
                quality.poses.to_string(),
                fixed(quality.log10_determinant, 2),
                fixed(quality.condition, 0),
                fixed(quality.smallest_singular_mm, 3),
                fixed(quality.noise_amplification_index_mm, 5),
                format!("{} x", fixed(quality.amplification, 3)),
            ]);
        }
        let choice = self.optimal.as_ref().map(|optimal| format!(", chosen from {}", optimal.pool)).unwrap_or_default();
        format!("\ninformation of the poses{choice}, each parameter in plausible deviations\n{}", table.text())
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

/// `1 h 23 min`, or minutes alone.
fn hours(seconds: f64) -> String {
    let minutes = (seconds / 60.0).round() as u64;
    if minutes < 60 { format!("{minutes} min") } else { format!("{} h {} min", minutes / 60, minutes % 60) }
}
