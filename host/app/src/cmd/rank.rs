//! `host-cal rank`: what a set of poses can identify.

use ballbar_calib::identify::{Identifiability, bound_by_pairings, remarks};
use ballbar_calib::kinematics::CanonicalFrames;
use ballbar_calib::model::Robot;
use clap::Args;
use serde::Serialize;

use super::inputs::{ListError, Measured, MeasuredArgs, OutputArgs};
use super::outcome::{CommandError, Outcome};
use super::pairings::parse_pairings;
use super::report::{Report, print};
use crate::documents::NotIdentified;
use crate::terminal::table::Columns;
use crate::units::mm_from_m;

/// How many parameters these poses can identify, and which they cannot
#[derive(Args)]
#[command(after_help = "Example:\n  host-cal rank --robot puma560 --rig triangles poses.csv --pairings A:1,B:2,C:3")]
pub(super) struct RankArgs {
    #[command(flatten)]
    measured: MeasuredArgs,
    /// Only poses of these pairings, chuck:sphere separated by commas
    #[arg(long, value_name = "A:1,B:2,…")]
    pairings: Option<String>,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct RankReport {
    robot: String,
    poses: usize,
    pairings: Vec<String>,
    rank: usize,
    parameters: usize,
    independent_expected: usize,
    /// The most that these chucks and spheres allow.
    bound_by_pairings: usize,
    /// What no linear change of the independent parameters explains of the lengths, RMS; weak parameters are judged by it.
    noise_mm: f64,
    /// Of the Jacobian with scaled columns, descending.
    singular_values: Vec<f64>,
    /// Last value that counts, first that does not.
    gap: Option<(f64, f64)>,
    not_identified: Vec<NotIdentified>,
    remarks: Vec<String>,
    warnings: Vec<String>,
}

impl RankArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let mut measured = self.measured.read()?;
        if let Some(list) = &self.pairings {
            let pairings = parse_pairings(list, &measured.rig)?;
            let had: Vec<String> =
                measured.dataset.pairings().iter().map(|&pairing| measured.rig.pairing_name(pairing)).collect();
            measured.dataset.rows.retain(|row| pairings.contains(&row.pairing));
            if measured.dataset.rows.is_empty() {
                return Err(ListError::NoPoseLeft(list.clone(), had.join(",")).into());
            }
        }
        print(&report(measured), self.output.json)?;
        Ok(Outcome::Good)
    }
}

fn report(measured: Measured) -> RankReport {
    let Measured { robot, rig, dataset, warnings, .. } = measured;
    // As `fit` judges: what the poses tell of a robot does not depend on how its frames are written.
    let frames = CanonicalFrames::new(&robot.chain);
    let (chain, terms) = (frames.chain().clone(), frames.terms(&robot.terms));
    let robot = Robot { chain, terms, ..robot };
    let found = Identifiability::of_robot(&robot, &dataset);
    RankReport {
        poses: dataset.rows.len(),
        pairings: dataset.pairings().into_iter().map(|pairing| rig.pairing_name(pairing)).collect(),
        rank: found.spectrum.rank,
        parameters: robot.chain.parameter_count(),
        independent_expected: robot.chain.independent_parameters(),
        bound_by_pairings: bound_by_pairings(&robot.chain, &dataset),
        noise_mm: mm_from_m(found.noise_m),
        gap: found.spectrum.gap(),
        not_identified: NotIdentified::all(&found),
        remarks: remarks(&robot.chain, &dataset, &rig, &robot.limits),
        singular_values: found.spectrum.singular_values,
        robot: robot.name,
        warnings,
    }
}

impl Report for RankReport {
    fn text(&self) -> String {
        let mut text = format!("{}, {} poses, pairings {}\n\n", self.robot, self.poses, self.pairings.join(" "));
        text += &format!(
            "rank {} of {} parameters; N = 5nr + 3np + 6 = {} can be independent, these pairings allow {}\n\n",
            self.rank, self.parameters, self.independent_expected, self.bound_by_pairings
        );
        text += &self.spectrum_text();
        text += "parameters are those of canonical frames, however the file's frames are written (docs/model.md)\n";
        text += &format!("\nnoise of these lengths, as far as no parameter explains it: {:.4} mm RMS\n", self.noise_mm);
        for remark in &self.remarks {
            text += &format!("\n{remark}\n");
        }
        text + &self.not_identified_text()
    }
}

impl RankReport {
    /// Values above the gap in full; those below are rounding and do not repeat, so only their largest is shown.
    fn spectrum_text(&self) -> String {
        const PER_LINE: usize = 9;
        let mut text = "singular values of the Jacobian with scaled columns\n".to_owned();
        for line in self.singular_values[..self.rank].chunks(PER_LINE) {
            let show = |&value: &f64| if value < 1e-3 { format!("{value:9.1e}") } else { format!("{value:9.4}") };
            let values: Vec<String> = line.iter().map(show).collect();
            text += &format!("  {}\n", values.join(" "));
        }
        if self.rank == 0 {
            return text + "  (every value is zero: no length depends on any parameter)\n";
        }
        text + &match self.gap {
            Some((last, first)) if first > 0.0 && first / last > 1e-8 => {
                format!(
                    "  -- a gap of only {:.0e} -- the other {} from {first:.1e} down\n",
                    last / first,
                    self.singular_values.len() - self.rank
                )
            }
            Some(_) => format!("  ---- gap ---- the other {} are zero up to rounding\n", self.singular_values.len() - self.rank),
            None => "  (no value is zero)\n".to_owned(),
        }
    }

    fn not_identified_text(&self) -> String {
        let (redundant, missed): (Vec<_>, Vec<_>) = self.not_identified.iter().partition(|one| one.kind == "redundant");
        let mut text = String::new();
        for (heading, group) in [
            ("not identified by these poses, though other measurements could", missed),
            ("redundant: no measurement at the tool can tell them from others", redundant),
        ] {
            if !group.is_empty() {
                let mut table = Columns::new(&["<parameter", "<why"]);
                for one in &group {
                    table.row([one.name.clone(), one.why.clone()]);
                }
                text += &format!("\n{heading} ({})\n{}", group.len(), table.text());
            }
        }
        text
    }
}
