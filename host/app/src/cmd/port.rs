//! Arguments and habits that the commands with a board have in common.

use ballbar::{JointKind, StillnessCriteria};
use ballbar_calib::model::Robot;
use clap::Args;
use miette::Diagnostic;
use thiserror::Error;

use super::outcome::CommandError;
use crate::board::{BAUD, BoardLink};

/// Which board.
#[derive(Args)]
pub(super) struct PortArgs {
    /// Serial port of the board, as `host-cal ports` lists it: /dev/ttyUSB0, on macOS /dev/cu.usbserial-1, on Windows COM3
    pub(super) port: String,
    /// Bits a second
    #[arg(long, default_value_t = BAUD)]
    pub(super) baud: u32,
}

impl PortArgs {
    /// Opens the port and greets the board.
    pub(super) fn connect(&self) -> Result<BoardLink, CommandError> {
        Ok(BoardLink::connect(&self.port, self.baud)?)
    }
}

/// A robot's file that is of another robot than the board's.
#[derive(Debug, Error, Diagnostic)]
#[error("{robot} has {found} joints, the board's robot {expected}, or joints of other kinds")]
#[diagnostic(help("Give the robot that the board holds: `host-cal status PORT` names it."))]
pub(super) struct OtherRobot {
    robot: String,
    found: usize,
    expected: usize,
}

/// A robot has the joints of the board's.
pub(super) fn check_kinds(robot: &Robot, on_board: &[JointKind]) -> Result<(), OtherRobot> {
    let kinds = robot.chain.joint_kinds();
    if kinds == on_board {
        return Ok(());
    }
    Err(OtherRobot { robot: robot.source.as_str().to_owned(), found: kinds.len(), expected: on_board.len() })
}

/// When the arm stands still.
#[derive(Args)]
pub(super) struct StillnessArgs {
    /// How long the arm must stand still, 10 to 60000 milliseconds
    #[arg(long, default_value_t = 500, value_name = "MS", value_parser = clap::value_parser!(u32).range(10..=60_000))]
    hold_ms: u32,
    /// Band of the encoders within which the arm stands still, counts
    #[arg(long, default_value_t = StillnessCriteria::default().band_counts, value_name = "N")]
    band_counts: u16,
    /// Band of the LVDT within which the arm stands still, codes of 65,536
    #[arg(long, default_value_t = StillnessCriteria::default().band_codes, value_name = "N")]
    band_codes: u16,
}

impl StillnessArgs {
    pub(super) fn criteria(&self) -> StillnessCriteria {
        let hold_us = self.hold_ms.saturating_mul(1_000);
        StillnessCriteria { hold_us, band_counts: self.band_counts, band_codes: self.band_codes }
    }
}
