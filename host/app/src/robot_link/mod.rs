//! Robot controllers: how `collect` moves a robot, whoever made it.
//!
//! A [`RobotLink`] is told a joint vector and asked how the move stands; it never waits, so that the board is heard while the robot
//! moves. What the controller says of a move and what the board's encoders say are two things: the caller compares them.
//!
//! | module | holds |
//! | --- | --- |
//! | [`urscript`] | Universal Robots: URScript to move, RTDE to listen, the dashboard to ask and, after a person has looked, to release |
//! | [`val`] | Unimation PUMAs with VAL or VAL II: what an operator types at its terminal |
//! | [`program`] | files for controllers that take no moves on line |

mod dashboard;
mod open;
mod patience;
pub mod program;
mod rtde;
pub mod sim;
mod speed;
mod tcp;
mod ur_course;
mod ur_script_port;
pub mod urscript;
pub mod val;
mod val_monitor;

use std::time::Duration;

use ballbar::JointVector;
use miette::Diagnostic;
use thiserror::Error;

use crate::deadline::StopFlag;
pub use open::{ControllerAt, OpenError, open};
pub use patience::Patience;
pub use speed::JointSpeed;

/// How a move stands, by the controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MoveState {
    /// The robot is on its way.
    Moving,
    /// The move is begun, and something that a person set holds it until that person lets it go on: a speed slider at 0, a paused
    /// program. What.
    Held(String),
    /// The robot is where it was sent.
    Reached,
    /// The controller did not begin the move: out of its limits, not understood. Its words.
    Refused(String),
    /// The move was begun and ended before its time: a protective stop, an envelope error, the emergency stop. The controller's words.
    Fault(String),
    /// Nothing was heard of the move for as long as it may take.
    TimedOut(Duration),
}

/// The connection to a controller does not work, or it speaks another language.
#[derive(Debug, Error, Diagnostic)]
pub enum LinkError {
    /// It cannot be reached.
    #[error("{address}: the robot's controller cannot be reached: {reason}")]
    #[diagnostic(help("Is the address right, is the controller on, does it allow remote control?"))]
    Unreachable {
        /// Port or network address.
        address: String,
        /// The operating system's reason.
        reason: String,
    },
    /// It was reached and is gone.
    #[error("{address}: the connection to the robot's controller is gone: {reason}")]
    #[diagnostic(help("The robot finishes or stops the move under way by itself. Run the same command again to go on."))]
    Lost {
        /// Port or network address.
        address: String,
        /// The operating system's reason.
        reason: String,
    },
    /// It answers, but not as such a controller does.
    #[error("{address}: the robot's controller says `{found}`, expected {expected}")]
    #[diagnostic(help("Is it the controller that --robot-link names, and in the right mode?"))]
    Unexpected {
        /// Port or network address.
        address: String,
        /// What it said.
        found: String,
        /// What such a controller says here.
        expected: &'static str,
    },
    /// The user wants to end, so that an answer was not waited for.
    #[error("ended by Ctrl-C or a signal")]
    Stopped,
}

/// What a person has to see to before the robot may move again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Intervention {
    /// What has happened, in the controller's words.
    pub what: String,
    /// What the person has to do before confirming: a sentence without its full stop.
    pub remedy: &'static str,
}

/// A robot's controller. Joint vectors are encoder outputs as in robot.toml, radians or metres.
pub trait RobotLink {
    /// Kind and address, for people and for the session: `urscript at 192.168.1.10`.
    fn name(&self) -> String;

    /// Begins a joint-interpolated move, all joints arriving together and none faster than `speed`. Returns at once; what comes of it
    /// is [`RobotLink::poll`]'s.
    ///
    /// # Errors
    /// [`LinkError`].
    fn start_move(&mut self, q: &JointVector<f64>, speed: &JointSpeed) -> Result<(), LinkError>;

    /// How the latest move stands. Waits a few milliseconds at most. Once it is over, it stays as it ended.
    ///
    /// # Errors
    /// [`LinkError`].
    fn poll(&mut self) -> Result<MoveState, LinkError>;

    /// Where the controller believes the robot to be; `None` where it does not say.
    ///
    /// # Errors
    /// [`LinkError`].
    fn joints(&mut self) -> Result<Option<JointVector<f64>>, LinkError>;

    /// Stops the robot on its path, as fast as the controller does that without harm.
    ///
    /// # Errors
    /// [`LinkError`].
    fn stop(&mut self) -> Result<(), LinkError>;

    /// Makes the controller ready for the next move after [`MoveState::Fault`] or [`MoveState::TimedOut`], as far as that may be done
    /// without a person. What the controller's safety has stopped stays stopped.
    ///
    /// # Errors
    /// [`LinkError`].
    fn recover(&mut self) -> Result<(), LinkError>;

    /// What a person has to see to before the robot may move; `None` when nothing, or when the controller does not tell.
    ///
    /// # Errors
    /// [`LinkError`].
    fn intervention(&mut self) -> Result<Option<Intervention>, LinkError> {
        Ok(None)
    }

    /// A person has seen to what the latest [`RobotLink::intervention`] told, and has confirmed it; to be called for no other reason. Has
    /// the controller release that stop, and none that came since, where it is done from afar. Whether it has, the next
    /// [`RobotLink::intervention`] tells.
    ///
    /// # Errors
    /// [`LinkError`].
    fn release(&mut self) -> Result<(), LinkError> {
        Ok(())
    }

    /// Takes in what the controller says without being asked, so that nothing waits unheard. To be called several times a second, also
    /// while somebody or something else is waited for. Waits a few milliseconds at most.
    ///
    /// # Errors
    /// [`LinkError`].
    fn listen(&mut self) -> Result<(), LinkError> {
        Ok(())
    }

    /// From here on no answer is waited for any longer once the flag is set, but for what stops the robot: [`LinkError::Stopped`] comes
    /// instead. A link that never waits has nothing to heed.
    fn heed(&mut self, _stop: &StopFlag) {}
}
