//! `host-cal apply`: put a calibrated robot on the board, and prove that it computes with it.

mod previous;

use ballbar::Chain;
use ballbar::wire::{Answer, Command, ParameterSet, WhichSet};
use ballbar_calib::model::{CalibrationVerdict, JointLimits, Robot, Standing};
use clap::Args;
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome};
use super::port::PortArgs;
use super::report::{Report, print, warn};
use crate::board::{
    BoardError, BoardLink, KinematicsDifference, NOMINAL_TRAVEL_M, RobotOnBoard, nominal_lvdt, parameter_set,
    rounding_of_kinematics, verify_kinematics,
};
use crate::files::open_robot;
use crate::terminal::progress;
use crate::text::one_line;

/// Upload a calibrated robot to the board, and verify the board's kinematics against this program's
#[derive(Args)]
#[command(
    after_help = "Examples:\n  host-cal apply /dev/ttyUSB0 --robot calibrated.toml\n  host-cal apply /dev/ttyUSB0 --previous\n\nThe parameters are verified on the board before they are stored. When anything fails, the board keeps those it had."
)]
pub(super) struct ApplyArgs {
    #[command(flatten)]
    port: PortArgs,
    /// robot.toml that `host-cal fit --out` has written
    #[arg(long, required_unless_present = "previous")]
    robot: Option<String>,
    /// Upload a robot that was not calibrated, such as the design
    #[arg(long)]
    uncalibrated: bool,
    /// Bring back the parameters that the last commit replaced, LVDT curve and all; once more, and it is undone
    #[arg(long, conflicts_with_all = ["robot", "uncalibrated"])]
    previous: bool,
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
    #[error(
        "{robot}: in single precision, as the board computes, poses are off by up to {position_um:.3} µm and {axis_urad:.3} µrad"
    )]
    #[diagnostic(help(
        "Nothing was changed on the board. Large lengths that cancel cost digits: describe the robot by frames near the arm."
    ))]
    Coarse { robot: String, position_um: f64, axis_urad: f64 },
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
    replaced_calibrated: Option<bool>,
    replaced_crc: Option<String>,
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
        let Some(robot) = &self.robot else {
            let report = previous::bring_back(&mut self.port.connect()?, self.vectors as usize)?;
            print(&report, self.output.json)?;
            return Ok(Outcome::Good);
        };
        let robot = open_robot(robot)?;
        if !self.uncalibrated {
            check_calibrated(&robot)?;
        }
        // All that can be wrong with the file is found before the board is spoken to.
        check_rounding(&robot, &parameter_set(&robot, nominal_lvdt(NOMINAL_TRAVEL_M))?, self.vectors as usize)?;
        let mut link = self.port.connect()?;
        let (joints, encoders) = (robot.chain.joints(), link.hello().encoders);
        if joints > usize::from(encoders) {
            return Err(ApplyError::TooManyJoints { robot: robot.source.as_str().to_owned(), joints, encoders }.into());
        }
        let report = upload(&mut link, &robot, self.vectors as usize)?;
        print(&report, self.output.json)?;
        Ok(Outcome::Good)
    }
}

/// A robot is put on the board when its fit was found to be good, with reservations or without.
fn check_calibrated(robot: &Robot) -> Result<(), ApplyError> {
    let name = || robot.source.as_str().to_owned();
    match robot.standing() {
        Standing::Calibrated | Standing::Reserved => Ok(()),
        Standing::NotJudged => Err(ApplyError::NotJudged(name())),
        Standing::Design => Err(ApplyError::NotCalibrated(name())),
    }
}

/// Whether the board's arithmetic is good enough for the robot: if not, no board is at fault.
fn check_rounding(robot: &Robot, set: &ParameterSet, vectors: usize) -> Result<(), ApplyError> {
    let Ok(compiled) = set.compile() else { return Ok(()) };
    let rounding = rounding_of_kinematics(&robot.chain, &robot.limits, &compiled, vectors);
    if rounding.is_small() {
        return Ok(());
    }
    let KinematicsDifference { position_m, axis_rad, .. } = rounding;
    let (position_um, axis_urad) = (position_m * 1e6, axis_rad * 1e6);
    Err(ApplyError::Coarse { robot: robot.source.as_str().to_owned(), position_um, axis_urad })
}

/// What the board uses; nothing where that is not to be believed.
fn in_use(link: &mut BoardLink) -> Result<Option<RobotOnBoard>, CommandError> {
    match RobotOnBoard::read(link) {
        Ok(old) => Ok(old.map(|(old, _)| old)),
        Err(BoardError::Implausible { reason, .. }) => {
            warn(&format!("what the board holds is replaced unseen: {reason}"));
            Ok(None)
        }
        Err(error) => Err(error.into()),
    }
}

/// Puts a robot's file in place of what is in use.
pub(super) fn upload(link: &mut BoardLink, robot: &Robot, vectors: usize) -> Result<ApplyReport, CommandError> {
    // A program that was killed may have left a stream running, and storing would stall it.
    link.act(Command::StopStream)?;
    let old = in_use(link)?;
    let (lvdt, lvdt_from) = match &old {
        Some(old) => (old.set().lvdt, "kept"),
        None => {
            warn("the board has no LVDT curve yet: a nominal one goes with the robot. Measure the real one: host-cal lvdt PORT");
            (nominal_lvdt(NOMINAL_TRAVEL_M), "nominal")
        }
    };
    let set = parameter_set(robot, lvdt)?;
    let stored = store(link, &set, &robot.chain, &robot.limits, vectors)?;
    let report = ApplyReport::new(link, &set, old.as_ref().map(RobotOnBoard::set), &stored, lvdt_from);
    let reasons = robot.calibration.as_ref().map_or_else(Vec::new, |calibration| calibration.reasons.clone());
    // The board keeps the beginning of a long name, and nothing of how the fit was judged but whether it was good.
    Ok(ApplyReport { robot: robot.name.clone(), verdict: robot.verdict(), reasons, ..report })
}

/// How a set was stored.
struct Stored {
    crc: u32,
    sequence: u32,
    difference: KinematicsDifference,
}

/// Stages, verifies, stores, reads back. The board is to compute what `chain` does within `limits`.
fn store(
    link: &mut BoardLink,
    set: &ParameterSet,
    chain: &Chain<f64>,
    limits: &[JointLimits],
    vectors: usize,
) -> Result<Stored, CommandError> {
    let committed = stage_and_verify(link, set, chain, limits, vectors)
        .and_then(|(crc, difference)| Ok(link.act(Command::Commit { crc }).map(|()| (crc, difference))?));
    if committed.is_err() {
        // What is staged is not in use; without it a later commit cannot store it by mistake.
        let _ = link.act(Command::Discard);
    }
    let (crc, difference) = committed?;
    if !is_on_board(link, WhichSet::Active, set)? {
        let help = "They were stored, and the flash gives back something else: do not trust the board. Try again.";
        return Err(ApplyError::ReadBack { which: "stored", help }.into());
    }
    let sequence = match link.request(Command::Status)? {
        Answer::Status(status) => status.active.map_or(0, |active| active.sequence),
        _ => return Err(BoardError::WrongAnswer { command: "status" }.into()),
    };
    Ok(Stored { crc, sequence, difference })
}

fn stage_and_verify(
    link: &mut BoardLink,
    set: &ParameterSet,
    chain: &Chain<f64>,
    limits: &[JointLimits],
    vectors: usize,
) -> Result<(u32, KinematicsDifference), CommandError> {
    let Answer::Staged { crc } = link.request(Command::WriteParameters(set.clone()))? else {
        return Err(BoardError::WrongAnswer { command: "write parameters" }.into());
    };
    if !is_on_board(link, WhichSet::Staged, set)? {
        return Err(ApplyError::ReadBack { which: "staged", help: KEPT }.into());
    }
    let bar = progress(vectors as u64, "verifying kinematics");
    let difference = verify_kinematics(link, chain, limits, WhichSet::Staged, vectors, || bar.inc(1))?;
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

impl ApplyReport {
    fn new(link: &BoardLink, set: &ParameterSet, replaced: Option<&ParameterSet>, stored: &Stored, lvdt: &'static str) -> Self {
        let hex = |crc: u32| format!("{crc:08x}");
        Self {
            port: link.port_name().to_owned(),
            robot: set.name.as_str().to_owned(),
            calibrated: set.is_calibrated,
            verdict: None,
            reasons: Vec::new(),
            replaced: replaced.map(|old| old.name.as_str().to_owned()),
            replaced_calibrated: replaced.map(|old| old.is_calibrated),
            replaced_crc: replaced.map(|old| hex(ballbar::crc32(&bytes_of(old)))),
            crc: hex(stored.crc),
            sequence: stored.sequence,
            vectors: stored.difference.vectors,
            max_position_difference_um: stored.difference.position_m * 1e6,
            max_axis_difference_urad: stored.difference.axis_rad * 1e6,
            lvdt,
        }
    }
}

impl Report for ApplyReport {
    fn text(&self) -> String {
        let what = |calibrated: bool| if calibrated { "calibrated" } else { "UNCALIBRATED" };
        let reasons: String = self.reasons.iter().map(|reason| format!("with a reservation: {reason}\n")).collect();
        let before = match (&self.replaced, self.replaced_calibrated, &self.replaced_crc) {
            (Some(name), Some(calibrated), Some(crc)) => format!("{} `{}` (CRC {crc})", what(calibrated), one_line(name)),
            _ => "nothing".into(),
        };
        format!(
            "{}: {} robot `{}` stored (CRC {}, commit {}) in place of {before}\n{reasons}read back bit for bit; LVDT curve {}\n\
             {} joint vectors: the board's poses differ from this program's by at most {:.3} µm and {:.3} µrad\n",
            one_line(&self.port),
            what(self.calibrated),
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
