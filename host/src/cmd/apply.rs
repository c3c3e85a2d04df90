//! `host-cal apply`: put a calibrated robot on the board, and prove that it computes with it.

use ballbar::wire::{Answer, Command, ParameterSet, WhichSet};
use clap::Args;
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome};
use super::port::PortArgs;
use super::report::{Report, print, progress, warn};
use crate::board::{
    BoardError, BoardLink, KinematicsDifference, NOMINAL_TRAVEL_M, RobotOnBoard, nominal_lvdt, parameter_set, verify_kinematics,
};
use crate::files::{CalibrationVerdict, Robot};
use crate::text::one_line;

/// Upload a calibrated robot to the board, and verify the board's kinematics against this program's
#[derive(Args)]
#[command(
    after_help = "Example:\n  host-cal apply /dev/ttyUSB0 --robot calibrated.toml\n\nThe parameters are verified on the board before they are stored. When anything fails, the board keeps those it had."
)]
pub(super) struct ApplyArgs {
    #[command(flatten)]
    port: PortArgs,
    /// robot.toml that `host-cal fit --out` has written
    #[arg(long)]
    robot: String,
    /// Upload a robot that was not calibrated, such as the design
    #[arg(long)]
    uncalibrated: bool,
    /// Joint vectors to compare the kinematics at
    #[arg(long, default_value_t = 1000, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    vectors: u64,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Error, Diagnostic)]
enum ApplyError {
    #[error("{0} has no [calibration]: it holds design parameters, not fitted ones")]
    #[diagnostic(help("Fit it first: host-cal fit … --out calibrated.toml. To upload it as it is: --uncalibrated"))]
    NotCalibrated(String),
    #[error("{0}: its [calibration] has no verdict, so that nothing says the fit was good")]
    #[diagnostic(help(
        "An older host-cal wrote it, or somebody changed it. Fit the design to the poses again: host-cal fit … --out calibrated.toml. To upload \
         it as it is: --uncalibrated"
    ))]
    NotJudged(String),
    #[error("{robot} has {joints} joints, but the board counts {encoders} encoders")]
    #[diagnostic(help("Nothing was changed on the board."))]
    TooManyJoints { robot: String, joints: usize, encoders: u8 },
    #[error("the {which} parameters read back from the board are not those that were sent")]
    #[diagnostic(help("{help}"))]
    ReadBack { which: &'static str, help: &'static str },
    #[error("the board's kinematics differ from this program's by {position_um:.3} µm and {axis_urad:.3} µrad")]
    #[diagnostic(help(
        "Nothing was stored; the board keeps the parameters that it had. Is its firmware sound? `host-cal status PORT`"
    ))]
    Kinematics { position_um: f64, axis_urad: f64 },
}

const KEPT: &str = "Nothing was stored; the board keeps the parameters that it had.";

/// What was stored, and how well the board computes with it.
#[derive(Serialize)]
pub(super) struct ApplyReport {
    port: String,
    robot: String,
    calibrated: bool,
    /// Of the fit that wrote the robot's file.
    #[serde(skip_serializing_if = "Option::is_none")]
    verdict: Option<CalibrationVerdict>,
    /// What weighs on it.
    reasons: Vec<String>,
    replaced: Option<String>,
    crc: String,
    /// Commits that this board has seen.
    sequence: u32,
    vectors: usize,
    pub(super) max_position_difference_um: f64,
    max_axis_difference_urad: f64,
    lvdt: &'static str,
}

impl ApplyArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let robot = Robot::open(&self.robot)?;
        if !self.uncalibrated {
            check_calibrated(&robot)?;
        }
        // All that can be wrong with the file is found before the board is spoken to.
        parameter_set(&robot, nominal_lvdt(NOMINAL_TRAVEL_M))?;
        let mut link = self.port.connect()?;
        let (joints, encoders) = (robot.chain.joints(), link.hello().encoders);
        if joints > usize::from(encoders) {
            return Err(ApplyError::TooManyJoints { robot: robot.source_name().to_owned(), joints, encoders }.into());
        }
        let report = upload(&mut link, &robot, self.vectors as usize)?;
        print(&report, self.output.json)?;
        Ok(Outcome::Good)
    }
}

/// A robot is put on the board when its fit was found to be good, with reservations or without.
fn check_calibrated(robot: &Robot) -> Result<(), ApplyError> {
    let name = || robot.source_name().to_owned();
    match (&robot.calibration, robot.verdict()) {
        (_, Some(CalibrationVerdict::Calibrated | CalibrationVerdict::Reserved)) => Ok(()),
        (Some(_), None) => Err(ApplyError::NotJudged(name())),
        (None, None) => Err(ApplyError::NotCalibrated(name())),
    }
}

/// Stages, verifies, stores, reads back.
pub(super) fn upload(link: &mut BoardLink, robot: &Robot, vectors: usize) -> Result<ApplyReport, CommandError> {
    // A program that was killed may have left a stream running, and storing would stall it.
    link.act(Command::StopStream)?;
    let old = match RobotOnBoard::read(link) {
        Ok(old) => old.map(|(old, _)| old),
        Err(BoardError::Implausible { reason, .. }) => {
            warn(&format!("what the board holds is replaced unseen: {reason}"));
            None
        }
        Err(error) => return Err(error.into()),
    };
    let lvdt = match &old {
        Some(old) => old.set().lvdt,
        None => {
            warn("the board has no LVDT curve yet: a nominal one goes with the robot. Measure the real one: host-cal lvdt PORT");
            nominal_lvdt(NOMINAL_TRAVEL_M)
        }
    };
    let set = parameter_set(robot, lvdt)?;
    let committed = stage_and_verify(link, robot, &set, vectors)
        .and_then(|(crc, difference)| Ok(link.act(Command::Commit { crc }).map(|()| (crc, difference))?));
    if committed.is_err() {
        // What is staged is not in use; without it a later commit cannot store it by mistake.
        let _ = link.act(Command::Discard);
    }
    let (crc, difference) = committed?;
    if !is_on_board(link, WhichSet::Active, &set)? {
        let help = "They were stored, and the flash gives back something else: do not trust the board. Try again.";
        return Err(ApplyError::ReadBack { which: "stored", help }.into());
    }
    let sequence = match link.request(Command::Status)? {
        Answer::Status(status) => status.active.map_or(0, |active| active.sequence),
        _ => return Err(BoardError::WrongAnswer { command: "status" }.into()),
    };
    Ok(ApplyReport {
        port: link.port_name().to_owned(),
        robot: robot.name.clone(),
        calibrated: robot.verdict().is_some(),
        verdict: robot.verdict(),
        reasons: robot.calibration.as_ref().map_or_else(Vec::new, |calibration| calibration.reasons.clone()),
        replaced: old.as_ref().map(|old| old.set().name.as_str().to_owned()),
        crc: format!("{crc:08x}"),
        sequence,
        vectors: difference.vectors,
        max_position_difference_um: difference.position_m * 1e6,
        max_axis_difference_urad: difference.axis_rad * 1e6,
        lvdt: if old.is_some() { "kept" } else { "nominal" },
    })
}

fn stage_and_verify(
    link: &mut BoardLink,
    robot: &Robot,
    set: &ParameterSet,
    vectors: usize,
) -> Result<(u32, KinematicsDifference), CommandError> {
    let Answer::Staged { crc } = link.request(Command::WriteParameters(set.clone()))? else {
        return Err(BoardError::WrongAnswer { command: "write parameters" }.into());
    };
    if !is_on_board(link, WhichSet::Staged, set)? {
        return Err(ApplyError::ReadBack { which: "staged", help: KEPT }.into());
    }
    let bar = progress(vectors as u64, "verifying kinematics");
    let difference = verify_kinematics(link, robot, WhichSet::Staged, vectors, || bar.inc(1))?;
    bar.finish_and_clear();
    if !difference.is_small() {
        let KinematicsDifference { position_m, axis_rad, .. } = difference;
        return Err(ApplyError::Kinematics { position_um: position_m * 1e6, axis_urad: axis_rad * 1e6 }.into());
    }
    Ok((crc, difference))
}

/// Bit for bit, which `==` on floats is not.
fn is_on_board(link: &mut BoardLink, which: WhichSet, set: &ParameterSet) -> Result<bool, CommandError> {
    match link.request(Command::ReadParameters(which))? {
        Answer::Parameters(found) => Ok(bytes_of(&found) == bytes_of(set)),
        _ => Err(BoardError::WrongAnswer { command: "read parameters" }.into()),
    }
}

fn bytes_of(set: &ParameterSet) -> Vec<u8> {
    let mut buffer = [0; ballbar::wire::MAX_PAYLOAD];
    postcard::to_slice(set, &mut buffer).map(|bytes| bytes.to_vec()).unwrap_or_default()
}

impl Report for ApplyReport {
    fn text(&self) -> String {
        let what = if self.calibrated { "calibrated" } else { "UNCALIBRATED" };
        let reasons: String = self.reasons.iter().map(|reason| format!("with a reservation: {reason}\n")).collect();
        let before = self.replaced.as_ref().map_or("nothing".into(), |name| format!("`{}`", one_line(name)));
        format!(
            "{}: {what} robot `{}` stored (CRC {}, commit {}) in place of {before}\n{reasons}read back bit for bit; LVDT curve {}\n\
             {} joint vectors: the board's poses differ from this program's by at most {:.3} µm and {:.3} µrad\n",
            one_line(&self.port),
            one_line(&self.robot),
            self.crc,
            self.sequence,
            self.lvdt,
            self.vectors,
            self.max_position_difference_um,
            self.max_axis_difference_urad
        )
    }
}
