//! Why a collection stops before its end. What was recorded until then is kept, and the same command goes on from there.

use miette::Diagnostic;
use thiserror::Error;

use crate::board::{BoardError, PortError};
use crate::files::InputError;
use crate::robot_link::LinkError;
use crate::session::RecordError;

/// Why a collection stops before its end.
#[derive(Debug, Error, Diagnostic)]
pub enum CollectError {
    /// The board.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Board(#[from] BoardError),
    /// The board's port.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Port(#[from] PortError),
    /// The robot's controller.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Robot(#[from] LinkError),
    /// The session.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Record(#[from] RecordError),
    /// The session's poses.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Poses(#[from] InputError),
    /// Nothing comes from the board, or nothing that is to be believed.
    #[error("{port}: nothing to believe has come from the board for {seconds:.0} s; the robot was stopped")]
    #[diagnostic(help("`host-cal status {port}` shows how the board is. Run the same command again to go on."))]
    Silent {
        /// The port.
        port: String,
        /// For how long.
        seconds: f64,
    },
    /// The board has no robot.
    #[error("the board holds no parameters, so it cannot tell joint angles or lengths")]
    #[diagnostic(help("Tell it the robot first: host-cal apply PORT --robot robot.toml --uncalibrated"))]
    NoParameters,
    /// Encoders that do not know where they are.
    #[error("the board's encoders are not homed, so nothing tells where the robot is")]
    #[diagnostic(help("Drive the robot to a known posture and tell it: host-cal home PORT --q …"))]
    NotHomed,
    /// The board has another robot.
    #[error("the board converts counts as another robot does: {what}")]
    #[diagnostic(help("Tell it the robot of the plan: host-cal apply PORT --robot robot.toml --uncalibrated"))]
    OtherRobot {
        /// What differs.
        what: String,
    },
    /// The arm stands where the plan does not come by, and there is no way from there.
    #[error("the robot stands off the plan, and no clear way leads from there to its line {line}: {why}")]
    #[diagnostic(help("With the bar taken off, drive the robot near {target}, and run the same command again."))]
    OffThePlan {
        /// Line of plan.csv that should be next.
        line: usize,
        /// Why not.
        why: String,
        /// Its joint vector.
        target: String,
    },
    /// The controller and the encoders do not have the robot at the same place.
    #[error("the robot's controller has joint {joint} at {controller}, the board's encoders at {encoders}; nothing was moved")]
    #[diagnostic(help(
        "Is the board homed, has robot.toml the encoders' signs and the controller's zeros? See `host-cal pose` and docs/robots.md."
    ))]
    Disagree {
        /// Number of the joint, from 1.
        joint: usize,
        /// By the controller.
        controller: String,
        /// By the encoders.
        encoders: String,
    },
    /// The controller says that the robot has arrived, and the encoders that it is elsewhere.
    #[error(
        "line {line} of the plan: the controller says the robot is there, but by the board's encoders joint {joint} is at {found}, sent to {sent}"
    )]
    #[diagnostic(help(
        "Is the board homed, does robot.toml have the encoders' signs and the controller's conventions? Nothing was recorded here."
    ))]
    Elsewhere {
        /// Line of plan.csv.
        line: usize,
        /// Number of the joint, from 1.
        joint: usize,
        /// Where it was sent.
        sent: String,
        /// Where it is.
        found: String,
    },
    /// The robot goes another way than the straight one in joint space.
    #[error(
        "on the way to line {line} of the plan joint {joint} is {off} off the straight way in joint space; the robot was stopped"
    )]
    #[diagnostic(help(
        "The plan is clear of collisions only along joint-interpolated moves. Does the controller interpolate joints, and has it one convention with robot.toml?"
    ))]
    OffTheWay {
        /// Line of plan.csv.
        line: usize,
        /// Number of the joint, from 1.
        joint: usize,
        /// How far.
        off: String,
    },
    /// Only a person may let the robot move on, and nobody is there.
    #[error("the robot stands {place}: {what}; nobody is there to look at it, so nothing was released")]
    #[diagnostic(help("{remedy}. Then run the same command again, without --yes to be asked: what was measured is kept."))]
    NobodyToLook {
        /// `on the way to line 12 of the plan, at 10.00° …`.
        place: String,
        /// The controller's words.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
    /// The bar does not stay on.
    #[error("line {line} of the plan: the bar came off or beyond its travel, again; the robot was stopped")]
    #[diagnostic(help("Look at the magnets and at the bar's travel there. Run the same command again to go on."))]
    BarOff {
        /// Line of plan.csv.
        line: usize,
    },
    /// What is attached cannot be what was asked for.
    #[error("{connection}: {found}, expected {expected}")]
    #[diagnostic(help("{hint}"))]
    WrongConnection {
        /// `A:1 with the 460 mm bar`.
        connection: String,
        /// What the LVDT shows.
        found: String,
        /// What the model says.
        expected: String,
        /// What else it could be, and what to do.
        hint: String,
    },
    /// The bar that should be off is on.
    #[error("the bar should be off, but {why}; the robot stands")]
    #[diagnostic(help("Take the bar off before the robot moves on, and run the same command again."))]
    StillOn {
        /// What tells.
        why: String,
    },
    /// The arm is not where the run left it.
    #[error("the robot was moved away from the plan's way to line {line}, and no clear way leads back")]
    #[diagnostic(help("Drive it back near {target}, and run the same command again."))]
    Moved {
        /// Line of plan.csv.
        line: usize,
        /// Joint vector of the row where it was.
        target: String,
    },
    /// Row after row cannot be had.
    #[error("{count} rows in a row could not be measured, the last one line {line}: {why}")]
    #[diagnostic(help("Something is wrong for all of them. Run the same command again to go on."))]
    TooManyMissed {
        /// How many.
        count: usize,
        /// Line of plan.csv of the last one.
        line: usize,
        /// Why.
        why: String,
    },
    /// The controller will not go on, and there is no way around.
    #[error("line {line} of the plan cannot be reached, and no clear way leads past it: {why}")]
    #[diagnostic(help(
        "Clear the controller's fault, drive the robot back near where it stopped, and run the same command again."
    ))]
    Blocked {
        /// Line of plan.csv.
        line: usize,
        /// The controller's words.
        why: String,
    },
}
