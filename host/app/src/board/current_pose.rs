//! Where a board says that the tool is.

use ballbar::wire::{Answer, Command, CurrentPose};

use super::errors::BoardError;
use super::link::BoardLink;
use super::plausible::Implausible;
use super::robot_on_board::RobotOnBoard;

/// The tool's pose as the board computes it, and the robot by which it does.
///
/// # Errors
/// [`BoardError`], also when the board says of its robot one thing and then another.
pub fn current_pose(link: &mut BoardLink) -> Result<(CurrentPose, RobotOnBoard), BoardError> {
    let Answer::CurrentPose(pose) = link.request(Command::CurrentPose)? else {
        return Err(BoardError::WrongAnswer { command: "current pose" });
    };
    let robot = RobotOnBoard::read(link)?.map(|(robot, _)| robot);
    let robot = robot.ok_or(BoardError::WrongAnswer { command: "read parameters" })?;
    // The board has said twice how many joints its robot has.
    let (found, expected) = (pose.q.len(), robot.kinds().len());
    if found != expected {
        let reason = Implausible::WrongCount { what: "joint values", found, expected };
        return Err(BoardError::Implausible { command: "current pose", reason });
    }
    Ok((pose, robot))
}
