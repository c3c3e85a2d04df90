//! What `host-cal plan` prints.

use std::path::Path;

use ballbar_calib::identify::remarks;
use ballbar_calib::model::{Rig, Robot};
use ballbar_calib::plan::{
    CheckFound, Comparison, Plan, PlanOptions, PlanRow, Quality, RowKind, RowMargins, ShellSummary, Unfit,
};
use serde::Serialize;

use super::plan_margins::{Least, MarginLine};
use super::report::Report;
use crate::terminal::table::{Columns, fixed};
use crate::text::one_line;
use crate::units::{ScreenUnit, mm_from_m, tidy};

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
    /// Empty when they went to a file.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    rows: Vec<RowLine>,
}

#[derive(Serialize)]
struct RowLine {
    kind: &'static str,
    chuck: String,
    sphere: String,
    bar_mm: f64,
    /// Degrees or millimetres.
    q: Vec<f64>,
    /// Of the bar, while it is attached.
    latitude_deg: Option<f64>,
    longitude_deg: Option<f64>,
    length_mm: Option<f64>,
    #[serde(flatten)]
    margins: Option<RowMarginLine>,
}

#[derive(Serialize)]
struct RowMarginLine {
    travel_margin_mm: Option<f64>,
    clearance_mm: f64,
    nearest: String,
    limit_margin_deg: Option<f64>,
    limit_margin_mm: Option<f64>,
    singularity: f64,
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
struct QualityLine {
    poses: usize,
    parameters: usize,
    log10_determinant: f64,
    mean_sensitivity_mm: f64,
    condition: f64,
    smallest_singular_mm: f64,
    noise_amplification_index_mm: f64,
    /// `None` where some parameters are not told: their errors would be missing in it.
    amplification: Option<f64>,
}

#[derive(Serialize)]
struct ComparisonLine {
    pool: usize,
    chosen: QualityLine,
    grid_of_same_size: Option<QualityLine>,
    grid: Option<QualityLine>,
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
        let reason = |(hindrance, points): &(ballbar_calib::plan::Hindrance, usize)| Reason {
            why: hindrance.to_string(),
            points: *points,
        };
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

    /// What hindered most, and how often something else did.
    fn main_reasons(&self) -> String {
        const SHOWN: usize = 2;
        let mut reasons: Vec<&Reason> = self.not_reached.iter().collect();
        reasons.sort_by_key(|reason| std::cmp::Reverse(reason.points));
        let (main, others) = reasons.split_at(SHOWN.min(reasons.len()));
        let mut words: Vec<String> = main.iter().map(|reason| format!("{} {}", reason.why, reason.points)).collect();
        if !others.is_empty() {
            words.push(format!("other {}", others.iter().map(|reason| reason.points).sum::<usize>()));
        }
        words.join(", ")
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
            quality: plan.quality.as_ref().map(|quality| QualityLine::new(quality, plan.expectation.independent)),
            optimal: plan.comparison.as_ref().map(|comparison| ComparisonLine::new(comparison, plan.expectation.independent)),
            planning_s,
            seed: options.seed,
            out: out.map(|path| path.display().to_string()),
            warnings: warnings(robot, rig, plan, &least, &margins),
            margins,
            least,
            rows: match out {
                Some(_) => Vec::new(),
                None => plan.rows.iter().map(|row| RowLine::new(robot, rig, row)).collect(),
            },
        }
    }
}

fn warnings(robot: &Robot, rig: &Rig, plan: &Plan, least: &Least, margins: &MarginLine) -> Vec<String> {
    let mut warnings = why_unfit(robot, rig, plan);
    let blocked = plan.shells.iter().filter(|shell| !shell.is_approach_clear);
    warnings.extend(blocked.map(|shell| {
        format!(
            "no clear way was found to the first pose of pairing {}, bar {} mm, with the bar off: bring the robot there by hand",
            rig.pairing_name(shell.pairing),
            tidy(mm_from_m(shell.bar_m))
        )
    }));
    let all_clear = plan.shells.iter().all(|shell| shell.is_approach_clear);
    if all_clear && !least.is_kept(margins) {
        warnings.push("fine steps along the plan show less than the margins asked for; see the table".to_owned());
    }
    warnings
}

/// Why a fit to the plan's poses could not be trusted, and what to plan instead.
fn why_unfit(robot: &Robot, rig: &Rig, plan: &Plan) -> Vec<String> {
    const MORE: &str = "ask for more poses with --per-pair, --bar or --pairings";
    let Some(unfit) = plan.unfit else { return Vec::new() };
    let mut why = vec![match unfit {
        Unfit::FewPoses { .. } | Unfit::Noise { .. } => format!("{unfit}; {MORE}"),
        Unfit::Rank { .. } => unfit.to_string(),
    }];
    if !matches!(unfit, Unfit::Noise { .. }) {
        why.extend(remarks(&robot.chain, &plan.as_dataset(rig), rig, &robot.limits));
    }
    why
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
        let mut table = Columns::new(&["<pairing", "bar mm", "tried", "reached", "measured", "vias", "min", "<not reached"]);
        for shell in &self.shells {
            let counts = [shell.points, shell.reached, shell.measured, shell.vias].map(|count| count.to_string());
            let [points, reached, measured, vias] = counts;
            let minutes = fixed(shell.duration_s / 60.0, 1);
            let bar_mm = shell.bar_mm.to_string();
            table.row([shell.pairing.clone(), bar_mm, points, reached, measured, vias, minutes, shell.main_reasons()]);
        }
        text += &table.text();
        text += &format!(
            "\n{} of {} points tried were reached; {} poses to measure, {} via points, the bar attached {} times\nexpected duration {} without attaching the bar; planned in {:.1} s\n\n",
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
        text += &match &self.out {
            Some(out) => format!("\nwritten to {}\n", one_line(out)),
            None => "\nnot written; --out FILE writes the rows, --json prints them\n".to_owned(),
        };
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
                quality.amplification.map_or_else(|| "-".to_owned(), |times| format!("{} x", fixed(times, 3))),
            ]);
        }
        let choice = self.optimal.as_ref().map(|optimal| format!(", chosen from {}", optimal.pool)).unwrap_or_default();
        format!("\ninformation of the poses{choice}, each parameter in plausible deviations\n{}", table.text())
    }
}

/// `1 h 23 min`, or minutes alone.
fn hours(seconds: f64) -> String {
    let minutes = (seconds / 60.0).round() as u64;
    if minutes < 60 { format!("{minutes} min") } else { format!("{} h {} min", minutes / 60, minutes % 60) }
}
