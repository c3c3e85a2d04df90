//! Telling a board where the joints stand: after every start its encoders know only how far they have moved.

use ballbar::wire::Command;
use ballbar::{JointKind, JointVector};
use ballbar_calib::model::{BeyondLimits, Robot};
use thiserror::Error;

use super::errors::BoardError;
use super::link::BoardLink;
use super::robot_on_board::RobotOnBoard;

/// A board whose robot is known and is to be homed.
pub struct Homing<'a> {
    link: &'a mut BoardLink,
    robot: RobotOnBoard,
}

/// What a board was told.
#[derive(Clone, Debug, PartialEq)]
pub struct Homed {
    /// Kinds of the joints.
    pub kinds: Vec<JointKind>,
    /// Where the encoders now stand.
    pub counts: Vec<i32>,
    /// Joints beyond their limits; `None` when those are not known.
    pub beyond_limits: Option<Vec<BeyondLimits>>,
}

/// Why a board was not homed. Nothing was changed on it, unless it is the board that failed.
#[derive(Debug, Error)]
pub enum HomeError {
    /// The board.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// It holds no robot.
    #[error("the board holds no parameters, so it does not know how its encoders count")]
    NoParameters,
    /// The limits are another robot's.
    #[error(transparent)]
    OtherRobot(#[from] OtherRobot),
    /// More values than joints, or fewer.
    #[error("{found} joint values for the board's {expected} joints")]
    Joints {
        /// Values given.
        found: usize,
        /// Joints of the board's robot.
        expected: usize,
    },
    /// A value is that far out, or no number.
    #[error("joint {joint}: {counts:.0} counts are more than the board can hold")]
    OutOfRange {
        /// Number of the joint, from 1.
        joint: usize,
        /// Its value in counts.
        counts: f64,
    },
}

/// A robot's file that is of another robot than the board's.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{robot} has {found} joints, the board's robot {expected}, or joints of other kinds")]
pub struct OtherRobot {
    /// The file.
    pub robot: String,
    /// Joints that it has.
    pub found: usize,
    /// Joints of the board's robot.
    pub expected: usize,
}

/// A robot has the joints of the board's.
///
/// # Errors
/// [`OtherRobot`].
pub fn check_kinds(robot: &Robot, on_board: &[JointKind]) -> Result<(), OtherRobot> {
    let kinds = robot.chain.joint_kinds();
    if kinds == on_board {
        return Ok(());
    }
    Err(OtherRobot { robot: robot.source.clone(), found: kinds.len(), expected: on_board.len() })
}

impl<'a> Homing<'a> {
    /// Asks the board which robot it has.
    ///
    /// # Errors
    /// [`HomeError::Board`], [`HomeError::NoParameters`].
    pub fn begin(link: &'a mut BoardLink) -> Result<Self, HomeError> {
        let (robot, _) = RobotOnBoard::read(link)?.ok_or(HomeError::NoParameters)?;
        Ok(Self { link, robot })
    }

    /// Kinds of the joints.
    pub fn kinds(&self) -> &[JointKind] {
        self.robot.kinds()
    }

    /// The joints stand at `q`, one value a joint, radians or metres. A value beyond the limits of the robot that is given is not refused:
    /// the arm may stand there.
    ///
    /// # Errors
    /// [`HomeError`].
    pub fn at(self, q: &[f64], limits: Option<&Robot>) -> Result<Homed, HomeError> {
        let kinds = self.robot.kinds();
        let mut vector = JointVector::zero();
        match vector.as_array_mut().get_mut(..kinds.len()) {
            Some(places) if q.len() == kinds.len() => places.copy_from_slice(q),
            _ => return Err(HomeError::Joints { found: q.len(), expected: kinds.len() }),
        }
        let beyond_limits = match limits {
            None => None,
            Some(robot) => {
                check_kinds(robot, kinds)?;
                Some(robot.beyond_limits(vector.as_array()).collect())
            }
        };
        let counts = whole_counts(&self.robot.encoders().counts(&vector)[..kinds.len()])?;
        for (joint, &counts) in counts.iter().enumerate() {
            self.link.act(Command::PresetEncoder { joint: joint as u8, counts })?;
        }
        Ok(Homed { kinds: kinds.to_vec(), counts, beyond_limits })
    }
}

fn whole_counts(counts: &[f64]) -> Result<Vec<i32>, HomeError> {
    let whole = |(i, &counts): (usize, &f64)| {
        let rounded = counts.round();
        let fits = (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&rounded);
        if fits { Ok(rounded as i32) } else { Err(HomeError::OutOfRange { joint: i + 1, counts }) }
    };
    counts.iter().enumerate().map(whole).collect()
}
