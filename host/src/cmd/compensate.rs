//! `host-cal compensate`: joint commands for a controller that keeps its nominal model.

use std::path::PathBuf;

use ballbar::JointVector;
use clap::Args;
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print, warn, write_file};
use super::table::{Columns, fixed};
use crate::files::{Robot, Source, compensated_csv, read_targets};
use crate::kinematics::{Compensation, Compensator};
use crate::units::{ScreenUnit, mm_from_m};

/// Joint commands that bring a controller with its nominal model to the true targets
#[derive(Args)]
#[command(
    after_help = "Example:\n  host-cal compensate --robot calibrated.toml --nominal design.toml targets.csv --out commands.csv\n\nA target is a joint vector of the controller, and means the pose that the nominal model has there, or the pose beside it.\nExit code 1 says that some targets cannot be reached."
)]
pub(super) struct CompensateArgs {
    /// The calibrated robot.toml
    #[arg(long)]
    robot: String,
    /// robot.toml of the controller's own model, or a built-in
    #[arg(long)]
    nominal: String,
    /// Targets: q1_deg,… and for poses also x_mm,y_mm,z_mm,alpha_deg,beta_deg,gamma_deg
    targets: PathBuf,
    /// File of commands to write
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Error, Diagnostic)]
#[error("{0} and {1} have different joints")]
#[diagnostic(help("The nominal robot is the design of the calibrated one, with the same joints in the same order."))]
struct DifferentJoints(String, String);

#[derive(Serialize)]
struct CompensateReport {
    targets: usize,
    commands: Vec<CommandLine>,
    /// Targets without a command.
    not_reached: Vec<NotReached>,
    largest_before_mm: f64,
    largest_left_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    out: Option<PathBuf>,
}

#[derive(Serialize)]
struct CommandLine {
    /// Line of the target in its file.
    line: usize,
    /// Degrees, or millimetres of a prismatic joint.
    q: Vec<f64>,
    before_mm: f64,
    before_deg: f64,
    left_mm: f64,
    left_deg: f64,
}

#[derive(Serialize)]
struct NotReached {
    line: usize,
    why: &'static str,
}

impl CompensateArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let (robot, nominal) = (Robot::open(&self.robot)?, Robot::open(&self.nominal)?);
        if robot.chain.joint_kinds() != nominal.chain.joint_kinds() {
            return Err(DifferentJoints(self.robot.clone(), self.nominal.clone()).into());
        }
        if robot.calibration.is_none() {
            warn("the robot has no [calibration]: its file says nothing of having been fitted");
        }
        let targets = read_targets(&Source::read(&self.targets)?, &nominal)?;
        let compensator = Compensator::new(&robot, &nominal);
        let (mut done, mut not_reached) = (Vec::new(), Vec::new());
        for target in &targets {
            match compensator.compensate(target, |q| as_written(&robot, q)) {
                None => not_reached
                    .push(NotReached { line: target.line, why: "the calibrated robot does not get there on this branch" }),
                Some(found) if !is_within_limits(&robot, &found.q) => {
                    not_reached.push(NotReached { line: target.line, why: "a joint would go beyond its limits" });
                }
                Some(found) => done.push((target.line, found)),
            }
        }
        for missed in &not_reached {
            warn(&format!("{}:{}: {}", self.targets.display(), missed.line, missed.why));
        }
        if let Some(path) = &self.out {
            write_file(path, &compensated_csv(&robot, &done))?;
        }
        let report = self.report(&robot, &done, not_reached);
        print(&report, self.output.json)?;
        Ok(if report.not_reached.is_empty() { Outcome::Good } else { Outcome::Doubtful })
    }

    fn report(&self, robot: &Robot, done: &[(usize, Compensation)], not_reached: Vec<NotReached>) -> CompensateReport {
        let kinds = robot.chain.joint_kinds();
        let line = |(line, found): &(usize, Compensation)| CommandLine {
            line: *line,
            q: kinds.iter().zip(found.q.as_array()).map(|(&kind, &q)| ScreenUnit::from(kind).from_si(q)).collect(),
            before_mm: mm_from_m(found.before.0),
            before_deg: found.before.1.to_degrees(),
            left_mm: mm_from_m(found.left.0),
            left_deg: found.left.1.to_degrees(),
        };
        let commands: Vec<CommandLine> = done.iter().map(line).collect();
        let largest = |of: fn(&CommandLine) -> f64| commands.iter().map(of).fold(0.0, f64::max);
        CompensateReport {
            targets: commands.len() + not_reached.len(),
            largest_before_mm: largest(|line| line.before_mm),
            largest_left_mm: largest(|line| line.left_mm),
            commands,
            not_reached,
            out: self.out.clone(),
        }
    }
}

/// Joints as a file has them: to the nanodegree and the nanometre.
fn as_written(robot: &Robot, mut q: JointVector<f64>) -> JointVector<f64> {
    const PER_UNIT: f64 = 1e9;
    for (value, &kind) in q.as_array_mut().iter_mut().zip(robot.chain.joint_kinds()) {
        let unit = ScreenUnit::from(kind);
        *value = unit.to_si((unit.from_si(*value) * PER_UNIT).round() / PER_UNIT);
    }
    q
}

fn is_within_limits(robot: &Robot, q: &JointVector<f64>) -> bool {
    robot.limits.iter().zip(q.as_array()).all(|(limits, &q)| limits.contain(q))
}

impl Report for CompensateReport {
    fn text(&self) -> String {
        const SHOWN: usize = 20;
        let mut table = Columns::new(&["line", "<q (deg or mm)", "before mm", "left mm", "left deg"]);
        for line in self.commands.iter().take(SHOWN) {
            let q = line.q.iter().map(|&q| fixed(q, 4)).collect::<Vec<_>>().join(" ");
            table.row([
                line.line.to_string(),
                q,
                fixed(line.before_mm, 4),
                format!("{:.1e}", line.left_mm),
                format!("{:.1e}", line.left_deg),
            ]);
        }
        let mut text = table.text();
        if self.commands.len() > SHOWN {
            text += &format!("  and {} more\n", self.commands.len() - SHOWN);
        }
        text += &format!("{} of {} targets have a command\n", self.commands.len(), self.targets);
        text += &format!(
            "largest error by the calibrated robot: {} mm before, {:.1e} mm left\n",
            fixed(self.largest_before_mm, 4),
            self.largest_left_mm
        );
        if let Some(out) = &self.out {
            text += &format!("written to {}\n", out.display());
        }
        text
    }
}
