//! What `host-cal plan` prints.

use ballbar_calib::identify::remarks;
use ballbar_calib::model::{Rig, Robot};
use ballbar_calib::plan::{Plan, Unfit};

use super::plan_margins::least_text;
use super::report::Report;
use crate::documents::{PlanDocument, QualityLine, Reason, ShellLine};
use crate::terminal::table::{Columns, fixed};
use crate::text::one_line;
use crate::units::{mm_from_m, tidy};

/// What is wrong with a plan.
pub(super) fn warnings(robot: &Robot, rig: &Rig, plan: &Plan, document: &PlanDocument) -> Vec<String> {
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
    if all_clear && !document.least.is_kept(&document.margins) {
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

impl Report for PlanDocument {
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
            table.row([shell.pairing.clone(), bar_mm, points, reached, measured, vias, minutes, main_reasons(shell)]);
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
        text += &least_text(&self.least, &self.margins);
        text += &format!(
            "\nexpected rank {} of {} parameters; {} can be independent; condition {:.1}\n",
            self.rank, self.parameters, self.independent_expected, self.condition
        );
        text += &quality_text(self);
        text += &match &self.out {
            Some(out) => format!("\nwritten to {}\n", one_line(out)),
            None => "\nnot written; --out FILE writes the rows, --json prints them\n".to_owned(),
        };
        text
    }
}

fn quality_text(plan: &PlanDocument) -> String {
    let sets: Vec<(&str, &QualityLine)> = match &plan.optimal {
        Some(optimal) => [
            ("D-optimal", Some(&optimal.chosen)),
            ("as many of the grid", optimal.grid_of_same_size.as_ref()),
            ("the whole grid", optimal.grid.as_ref()),
        ]
        .into_iter()
        .filter_map(|(name, quality)| Some((name, quality?)))
        .collect(),
        None => plan.quality.iter().map(|quality| ("this plan", quality)).collect(),
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
    let choice = plan.optimal.as_ref().map(|optimal| format!(", chosen from {}", optimal.pool)).unwrap_or_default();
    format!("\ninformation of the poses{choice}, each parameter in plausible deviations\n{}", table.text())
}

/// What hindered most, and how often something else did.
fn main_reasons(shell: &ShellLine) -> String {
    const SHOWN: usize = 2;
    let mut reasons: Vec<&Reason> = shell.not_reached.iter().collect();
    reasons.sort_by_key(|reason| std::cmp::Reverse(reason.points));
    let (main, others) = reasons.split_at(SHOWN.min(reasons.len()));
    let mut words: Vec<String> = main.iter().map(|reason| format!("{} {}", reason.why, reason.points)).collect();
    if !others.is_empty() {
        words.push(format!("other {}", others.iter().map(|reason| reason.points).sum::<usize>()));
    }
    words.join(", ")
}

/// `1 h 23 min`, or minutes alone.
fn hours(seconds: f64) -> String {
    let minutes = (seconds / 60.0).round() as u64;
    if minutes < 60 { format!("{minutes} min") } else { format!("{} h {} min", minutes / 60, minutes % 60) }
}
