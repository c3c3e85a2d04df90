//! `host-cal compensate`: commands for a controller that keeps its nominal model.

use std::path::PathBuf;

use ballbar::JointVector;
use ballbar_calib::kinematics::{Compensation, Compensator, FarTurn, link_angles};
use ballbar_calib::model::{Robot, Standing};
use clap::Args;
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::inputs::{ForceArgs, ListError, OutputArgs};
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print, warn, write_file};
use crate::files::{
    FileKind, Output, Source, Target, compensated_csv, joints_as_written, open_robot, pose_as_written, read_targets,
};
use crate::remedies::Remedied;
use crate::terminal::table::{Columns, fixed};
use crate::text::shown_path;
use crate::units::{ScreenUnit, mm_from_m, tidy};

/// Commands that bring a controller with its nominal model to the true targets
#[derive(Args)]
#[command(
    after_help = "Example:\n  host-cal compensate --robot calibrated.toml --nominal design.toml targets.csv --out commands.csv\n\nA target is a joint vector of the controller, and means the pose that the nominal model has there, or a pose, or a pose with joints that say on which branch. A command is a joint vector, and the pose that the controller believes to reach by it.\nExit code 1 says that some targets cannot be reached."
)]
pub(super) struct CompensateArgs {
    /// The calibrated robot.toml
    #[arg(long)]
    robot: String,
    /// robot.toml of the controller's own model, or a built-in
    #[arg(long)]
    nominal: String,
    /// Where the arm stands before the first target, if that is a pose: the branch nearest to it is taken; in degrees, or millimetres for
    /// a prismatic joint [default: the middle of the joints' ranges]
    #[arg(long, value_name = "Q,…", value_delimiter = ',', allow_hyphen_values = true)]
    start: Option<Vec<f64>>,
    /// Targets: q1_deg,…, or x_mm,y_mm,z_mm,alpha_deg,beta_deg,gamma_deg, or both
    targets: PathBuf,
    /// File of commands to write
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    replace: ForceArgs,
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
    largest_left_deg: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    out: Option<PathBuf>,
    warnings: Vec<String>,
}

#[derive(Serialize)]
struct CommandLine {
    /// Line of the target in its file.
    line: usize,
    /// Degrees, or millimetres of a prismatic joint.
    q: Vec<f64>,
    /// Where the controller would go by itself.
    nominal_q: Vec<f64>,
    /// The pose that the controller believes to reach by `q`.
    position_mm: [f64; 3],
    alpha_beta_gamma_deg: [f64; 3],
    before_mm: f64,
    before_deg: f64,
    left_mm: f64,
    left_deg: f64,
    /// Whether the nominal model's nearest solution for the pose is `q`.
    pose_leads_to_q: bool,
}

#[derive(Serialize)]
struct NotReached {
    line: usize,
    why: String,
}

impl CompensateArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let (robot, nominal) = (open_robot(&self.robot)?, open_robot(&self.nominal)?);
        if robot.chain.joint_kinds() != nominal.chain.joint_kinds() {
            return Err(DifferentJoints(self.robot.clone(), self.nominal.clone()).into());
        }
        let compensator = Compensator::new(&robot, &nominal).map_err(Remedied)?;
        let start = self.start(&nominal, &compensator)?;
        let targets = read_targets(&Source::read_rows(&self.targets)?, &nominal)?;
        let kinds = robot.chain.joint_kinds();
        let goals = targets.iter().map(|target| &target.goal);
        let found = compensator.compensate_all(goals, start, |q| joints_as_written(kinds, q), pose_as_written);
        let (mut done, mut not_reached) = (Vec::new(), Vec::new());
        for (&Target { line, .. }, found) in targets.iter().zip(found) {
            match found {
                Ok(found) => done.push((line, found)),
                Err(why) => not_reached.push(NotReached { line, why: why.to_string() }),
            }
        }
        let warnings = self.warnings(&robot, &done, &not_reached);
        warnings.iter().for_each(|warning| warn(warning));
        if let Some(path) = &self.out {
            write_file(Output { path, kind: FileKind::Commands, force: self.replace.force }, &compensated_csv(&robot, &done))?;
        }
        let report = self.report(&robot, &done, not_reached, warnings);
        print(&report, self.output.json)?;
        Ok(if report.not_reached.is_empty() { Outcome::Good } else { Outcome::Doubtful })
    }

    fn start(&self, robot: &Robot, compensator: &Compensator) -> Result<JointVector<f64>, CommandError> {
        let Some(start) = &self.start else { return Ok(compensator.middle()) };
        let kinds = robot.chain.joint_kinds();
        let wrong_count = || ListError::JointValues { flag: "--start", found: start.len(), expected: kinds.len() };
        if start.len() != kinds.len() {
            return Err(wrong_count().into());
        }
        if let Some(value) = start.iter().find(|value| !value.is_finite()) {
            return Err(ListError::Number { flag: "--start", found: value.to_string(), expected: "finite numbers" }.into());
        }
        let q: Vec<f64> = start.iter().zip(kinds).map(|(&q, &kind)| ScreenUnit::from(kind).to_si(q)).collect();
        robot.chain.joint_vector(&q).map_err(|_| wrong_count().into())
    }

    fn warnings(&self, robot: &Robot, done: &[(usize, Compensation)], not_reached: &[NotReached]) -> Vec<String> {
        let place = |line: usize| format!("{}:{line}", self.targets.display());
        let mut warnings = Vec::new();
        warnings.extend(standing_warning(robot));
        warnings.extend(not_reached.iter().map(|missed| format!("{}: {}", place(missed.line), missed.why)));
        for (line, found) in done {
            if let Some(FarTurn { joint, kind, way }) = found.far_turn(robot.chain.joint_kinds()) {
                let unit = ScreenUnit::from(kind);
                warnings.push(format!(
                    "{}: joint {joint} goes {:.1} {} from where the controller's model has it: the arm is nearly singular there, \
                     or on another branch",
                    place(*line),
                    unit.from_si(way),
                    unit.name()
                ));
            }
        }
        let elsewhere: Vec<usize> = done.iter().filter(|(_, found)| !found.pose_leads_to_q).map(|(line, _)| *line).collect();
        if let Some(first) = elsewhere.first() {
            warnings.push(format!(
                "{}: of {} commands, this one the first, the pose has other joints near where the controller's model has it: command the \
                 joints, since `left` holds for them alone",
                place(*first),
                elsewhere.len()
            ));
        }
        warnings
    }

    fn report(
        &self,
        robot: &Robot,
        done: &[(usize, Compensation)],
        not_reached: Vec<NotReached>,
        warnings: Vec<String>,
    ) -> CompensateReport {
        let kinds = robot.chain.joint_kinds();
        let on_screen = |q: &JointVector<f64>| {
            kinds.iter().zip(q.as_array()).map(|(&kind, &q)| tidy(ScreenUnit::from(kind).from_si(q))).collect::<Vec<f64>>()
        };
        let line = |(line, found): &(usize, Compensation)| CommandLine {
            line: *line,
            q: on_screen(&found.q),
            nominal_q: on_screen(&found.nominal_q),
            position_mm: found.nominal_base_from_tool.translation_m.map(mm_from_m).into(),
            alpha_beta_gamma_deg: link_angles(&found.nominal_base_from_tool.rotation).map(f64::to_degrees),
            before_mm: mm_from_m(found.before.0),
            before_deg: found.before.1.to_degrees(),
            left_mm: mm_from_m(found.left.0),
            left_deg: found.left.1.to_degrees(),
            pose_leads_to_q: found.pose_leads_to_q,
        };
        let commands: Vec<CommandLine> = done.iter().map(line).collect();
        let largest = |of: fn(&CommandLine) -> f64| commands.iter().map(of).fold(0.0, f64::max);
        CompensateReport {
            targets: commands.len() + not_reached.len(),
            largest_before_mm: largest(|line| line.before_mm),
            largest_left_mm: largest(|line| line.left_mm),
            largest_left_deg: largest(|line| line.left_deg),
            commands,
            not_reached,
            out: self.out.clone(),
            warnings,
        }
    }
}

/// What its file says of the robot, where that is not that it is calibrated.
fn standing_warning(robot: &Robot) -> Option<String> {
    match robot.standing() {
        Standing::Calibrated => None,
        Standing::Reserved => {
            let reasons = robot.calibration.as_ref().map_or_else(String::new, |calibration| calibration.reasons.join(" "));
            Some(format!("the robot is calibrated with reservations: {reasons}"))
        }
        Standing::NotJudged => Some("the robot's [calibration] has no verdict: nothing says that the fit was good".to_owned()),
        Standing::Design => Some("the robot has no [calibration]: its file says nothing of having been fitted".to_owned()),
    }
}

impl Report for CompensateReport {
    fn text(&self) -> String {
        const SHOWN: usize = 20;
        let mut text = String::new();
        if !self.commands.is_empty() {
            let mut table = Columns::new(&["line", "<joints to command, deg or mm", "before mm", "left mm", "left deg"]);
            for line in self.commands.iter().take(SHOWN) {
                let q = line.q.iter().map(|&q| fixed(q, 4)).collect::<Vec<_>>().join(" ");
                let left = [line.left_mm, line.left_deg].map(|left| fixed(left, 6));
                table.row([line.line.to_string(), q, fixed(line.before_mm, 4)].into_iter().chain(left));
            }
            text += &table.text();
        }
        if self.commands.len() > SHOWN {
            text += &format!("  and {} more\n", self.commands.len() - SHOWN);
        }
        text += &format!("{} of {} targets have a command\n", self.commands.len(), self.targets);
        if !self.commands.is_empty() {
            let [before, left] = [(self.largest_before_mm, 4), (self.largest_left_mm, 6)].map(|(mm, digits)| fixed(mm, digits));
            text += &format!("largest error by the calibrated robot: {before} mm before, {left} mm left\n");
        }
        if let Some(out) = &self.out {
            text += &format!("written to {}\n", shown_path(out));
        }
        text
    }
}
