//! Is the board's robot the plan's?

use ballbar::Coupling;
use ballbar::wire::{Answer, Command};
use ballbar_calib::model::Robot;

use super::errors::CollectError;
use crate::board::{BoardError, BoardLink, RobotOnBoard};

/// A board that was asked for its robot, which is the plan's and knows where it is.
pub struct CheckedBoard {
    pub(super) link: BoardLink,
    pub(super) robot: RobotOnBoard,
    robot_frame: Vec<u8>,
}

impl CheckedBoard {
    /// Asks the board.
    ///
    /// # Errors
    /// [`CollectError::Board`], [`CollectError::NoParameters`], [`CollectError::OtherRobot`], [`CollectError::NotHomed`].
    pub fn read(mut link: BoardLink, plans: &Robot) -> Result<Self, CollectError> {
        let (robot, robot_frame) = RobotOnBoard::read(&mut link)?.ok_or(CollectError::NoParameters)?;
        let Answer::Status(status) = link.request(Command::Status)? else {
            return Err(BoardError::WrongAnswer { command: "status" }.into());
        };
        check_board(plans, &robot, robot.is_homed_by(&status))?;
        Ok(Self { link, robot, robot_frame })
    }

    /// The conversation with it.
    pub fn link(&self) -> &BoardLink {
        &self.link
    }

    /// The parameters that it uses.
    pub fn robot(&self) -> &RobotOnBoard {
        &self.robot
    }

    /// The frame in which it said so, for a log.
    pub fn robot_frame(&self) -> &[u8] {
        &self.robot_frame
    }
}

/// A board counts as the plan's robot does, and knows where it is.
///
/// # Errors
/// [`CollectError::OtherRobot`], [`CollectError::NotHomed`].
pub(super) fn check_board(robot: &Robot, board: &RobotOnBoard, is_homed: bool) -> Result<(), CollectError> {
    let other = |what: String| Err(CollectError::OtherRobot { what });
    let (found, expected) = (board.kinds(), robot.chain.joint_kinds());
    if found != expected {
        return other(format!("{} joints {found:?}, the plan's robot has {} joints {expected:?}", found.len(), expected.len()));
    }
    let encoders = board.set().encoders.iter().zip(&robot.encoders).enumerate();
    for (i, (on_board, facts)) in encoders {
        let expected = facts.encoder.map(|encoder| encoder.counts_per_unit as f32);
        let found = on_board.counts_per_unit;
        if let Some(expected) = expected.filter(|&expected| expected != found) {
            return other(format!("joint {} has {found} counts a radian or metre, in the plan's robot {expected}", i + 1));
        }
    }
    let couplings: Vec<_> = robot.encoders.iter().flat_map(|facts| &facts.couplings).collect();
    let is_same =
        |(a, b): (&Coupling<f32>, &&Coupling<f64>)| (a.joint, a.driven_by, a.ratio) == (b.joint, b.driven_by, b.ratio as f32);
    if board.set().couplings.len() != couplings.len() || !board.set().couplings.iter().zip(&couplings).all(is_same) {
        return other("its couplings between joints are others".into());
    }
    if !is_homed {
        return Err(CollectError::NotHomed);
    }
    Ok(())
}
