//! Programs for controllers that take no moves on line: a list of joint vectors as a file of the controller's language.
//!
//! Every step, measured or on the way, is a joint-interpolated move with an exact stop: the way between rows was planned as straight
//! lines in the joints, and blending would leave it. At measured steps the robot stands for a while. Values are those of the
//! controller's joints, so robot.toml must have the controller's zeros and senses.
//!
//! A program moves only from where it begins. It tells the operator how the bar has to be and waits for the key that goes on; then
//! it compares the joints with its first step, and ends with a message where one of them is off by more than
//! [`START_TOLERANCE_DEG`] or [`START_TOLERANCE_MM`]. At its end it says what to do with the bar.
//!
//! The programs of a plan can all be in a controller at once: whatever has a name outside of its program has the program's name in it.
//!
//! | module | language | speed |
//! | --- | --- | --- |
//! | `val` | Unimation VAL II | percent of the fastest joint's |
//! | `urscript` | Universal Robots | as asked |
//! | `krl` | KUKA | percent of the fastest joint's |
//! | `rapid` | ABB | by the time of each move |
//! | `fanuc` | Fanuc TP, as ASCII | percent of the fastest joint's |

mod axes;
mod error;
mod fanuc;
mod krl;
mod limits;
mod rapid;
mod urscript;
mod val;
mod words;

use std::fmt;

use ballbar::{JointKind, JointVector};

use super::JointSpeed;
use super::speed::percent;
use crate::units::ScreenUnit;
use axes::AxisValue;
use limits::Limits;
use words::printable;

pub use error::ProgramError;

/// A program moves when no revolute joint is farther from its first step, degrees: what somebody hits with the teach pendant, and
/// what `collect` takes for the same place.
pub const START_TOLERANCE_DEG: f64 = 0.5;
/// The same of prismatic joints, millimetres.
pub const START_TOLERANCE_MM: f64 = 1.0;
/// What the operator is told otherwise.
const NOT_AT_START: &str = "NOT AT THE FIRST POSE: nothing is moved";
/// A move of a given time is faster in its middle than on average: half as much again in a cubic one, less in others.
const PEAK_SPEED: f64 = 1.5;
/// No move is given less time, seconds.
const MOVE_MIN_S: f64 = 0.1;
/// Nor is the first one, which is within the tolerance.
const FIRST_MOVE_MIN_S: f64 = 2.0;
/// Assumed full speed of an axis that slides, metres per second.
const FULL_SPEED_M_S: f64 = 2.5;

/// A controller's language.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dialect {
    /// Unimation VAL II.
    Val,
    /// Universal Robots.
    UrScript,
    /// KUKA.
    Krl,
    /// ABB.
    Rapid,
    /// Fanuc.
    FanucLs,
}

/// One joint vector to go to.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgramStep {
    /// Encoder outputs as in robot.toml, radians or metres.
    pub q: JointVector<f64>,
    /// Whether the robot stands here to be measured; otherwise it is on its way.
    pub is_measured: bool,
    /// For people; what a language cannot hold is left out.
    pub comment: String,
}

/// What the robot is to do.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// Becomes the program's name and the files'.
    pub name: String,
    /// Of the robot's joints, from the base.
    pub kinds: Vec<JointKind>,
    /// In their order.
    pub steps: Vec<ProgramStep>,
    /// No joint is faster.
    pub speed: JointSpeed,
    /// How long the robot stands at a measured step, seconds.
    pub stand_s: f64,
    /// What the operator sees to before the robot moves: whether the bar is on or off.
    pub before: String,
    /// What the operator is told at the end.
    pub after: String,
    /// Of the controller.
    pub setup: ControllerSetup,
}

/// How a controller is set up, as far as its programs depend on it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ControllerSetup {
    /// The controller's tool whose load is the plate with its spheres: a number (KRL, Fanuc) or a name (RAPID). Without one, tool 1
    /// or `tool0`.
    pub tool: Option<String>,
    /// What the robot's fastest revolute joint reaches at 100 percent, radians per second (VAL, KRL, Fanuc). Without it, as much as
    /// the fastest arms that the language drives.
    pub fastest_rad_s: Option<f64>,
    /// Fanuc: the controller's J3 is q3 + `j23` · q2; -1, 0 or 1.
    pub j23: Option<i8>,
}

/// A file for the controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProgramFile {
    /// With its extension.
    pub name: String,
    /// ASCII.
    pub text: String,
}

/// Writes a program as the files of a language. Where there are several, all are needed, and the first is the one to run.
///
/// # Errors
/// [`ProgramError`] when the language cannot hold it, or there is nothing to write.
pub fn write_program(dialect: Dialect, program: &Program) -> Result<Vec<ProgramFile>, ProgramError> {
    type Write = fn(&Program) -> Result<Vec<ProgramFile>, ProgramError>;
    let (limits, write): (Limits, Write) = match dialect {
        Dialect::Val => (val::LIMITS, val::write),
        Dialect::UrScript => (urscript::LIMITS, urscript::write),
        Dialect::Krl => (krl::LIMITS, krl::write),
        Dialect::Rapid => (rapid::LIMITS, rapid::write),
        Dialect::FanucLs => (fanuc::LIMITS, fanuc::write),
    };
    limits.check(dialect, program)?;
    write(program)
}

impl Dialect {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Val, Self::UrScript, Self::Krl, Self::Rapid, Self::FanucLs];

    /// As on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Val => "val",
            Self::UrScript => "urscript",
            Self::Krl => "krl",
            Self::Rapid => "rapid",
            Self::FanucLs => "fanuc",
        }
    }
}

impl fmt::Display for Dialect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Program {
    /// A step's joint values, degrees or millimetres.
    fn values(&self, step: &ProgramStep) -> Vec<f64> {
        let screen = |(kind, q): (&JointKind, &f64)| ScreenUnit::from(*kind).from_si(*q);
        self.kinds.iter().zip(step.q.as_array()).map(screen).collect()
    }

    /// What stands above a step: its number, what it is for, and its comment, at most `width` characters.
    fn heading(&self, index: usize, width: usize) -> String {
        let step = &self.steps[index];
        let what = if step.is_measured { "measured" } else { "via" };
        printable(&format!("{} {what} {}", index + 1, step.comment), width)
    }

    /// What stands above everything.
    fn title(&self) -> String {
        let measured = self.steps.iter().filter(|step| step.is_measured).count();
        format!("ball-bar: {measured} poses measured, {} on the way", self.steps.len() - measured)
    }

    /// A step's values by the controller's axes: the arm's, then the external ones.
    fn axis_values(&self, step: &ProgramStep) -> Vec<AxisValue> {
        let axes = axes::axes(&self.kinds);
        let mut values: Vec<AxisValue> = axes
            .into_iter()
            .zip(&self.kinds)
            .zip(self.values(step))
            .map(|((axis, kind), value)| AxisValue { axis, kind: *kind, value })
            .collect();
        values.sort_by_key(|value| value.axis);
        values
    }

    /// Time for the move to a step at the program's speed, seconds, such that no joint is faster in its middle. To the first step the
    /// joints are off by the tolerance at most.
    fn move_s(&self, index: usize) -> f64 {
        let (duration_s, least_s) = match index.checked_sub(1) {
            Some(before) => (self.speed.duration_s(&self.kinds, &self.steps[before].q, &self.steps[index].q), MOVE_MIN_S),
            None => {
                let alone_s = |kind: &JointKind| tolerance(*kind) / self.screen_speed(*kind);
                (self.kinds.iter().map(alone_s).fold(0.0, f64::max), FIRST_MOVE_MIN_S)
            }
        };
        // Rounded up to hundredths.
        ((PEAK_SPEED * duration_s).max(least_s) * 100.0 - 1e-6).ceil() / 100.0
    }

    /// Degrees or millimetres per second.
    fn screen_speed(&self, kind: JointKind) -> f64 {
        let si = match kind {
            JointKind::Revolute => self.speed.revolute_rad_s,
            JointKind::Prismatic => self.speed.prismatic_m_s,
        };
        ScreenUnit::from(kind).from_si(si)
    }

    /// Whole percent of the full speed of joints of a kind, of which `assumed_deg_s` is that of the fastest revolute ones unless the
    /// setup says what it is.
    fn percent(&self, dialect: Dialect, kind: JointKind, assumed_deg_s: f64) -> Result<u8, ProgramError> {
        let full = match kind {
            JointKind::Revolute => self.setup.fastest_rad_s.map_or(assumed_deg_s, f64::to_degrees),
            JointKind::Prismatic => ScreenUnit::Millimetre.from_si(FULL_SPEED_M_S),
        };
        let asked = self.screen_speed(kind);
        // What degrees lose on their way through radians does not cost a percent.
        if asked < 0.01 * full * (1.0 - 1e-9) {
            return Err(ProgramError::Slow { dialect, asked, full, unit: ScreenUnit::from(kind).name() });
        }
        Ok(percent(asked, full))
    }
}

/// How far a joint of a kind may be from the first step, degrees or millimetres.
fn tolerance(kind: JointKind) -> f64 {
    match kind {
        JointKind::Revolute => START_TOLERANCE_DEG,
        JointKind::Prismatic => START_TOLERANCE_MM,
    }
}
