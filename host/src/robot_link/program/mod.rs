//! Programs for controllers that take no moves on line: a list of joint vectors as a file of the controller's language.
//!
//! Every step, measured or on the way, is a joint-interpolated move with an exact stop: the way between rows was planned as straight
//! lines in the joints, and blending would leave it. At measured steps the robot stands for a while. Values are those of the
//! controller's joints, so robot.toml must have the controller's zeros and senses.
//!
//! | module | language | speed |
//! | --- | --- | --- |
//! | `val` | Unimation VAL II | percent, of an assumed full speed |
//! | `urscript` | Universal Robots | as asked |
//! | `krl` | KUKA | percent, of an assumed full speed |
//! | `rapid` | ABB | by the time of each move |
//! | `fanuc` | Fanuc TP, as ASCII | by the time of each move |

mod error;
mod fanuc;
mod krl;
mod rapid;
mod urscript;
mod val;

use std::fmt;

use ballbar::{JointKind, JointVector};

use super::JointSpeed;
use crate::units::ScreenUnit;

pub use error::ProgramError;

/// The longest that a robot may be told to stand, seconds. Fanuc's `WAIT` ends at 327.67.
const STAND_MAX_S: f64 = 300.0;
/// A move of a given time is faster in its middle than on average: half as much again in a cubic one, less in others.
const PEAK_SPEED: f64 = 1.5;
/// No move is given less time, seconds.
const MOVE_MIN_S: f64 = 0.1;

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
}

/// A file for the controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProgramFile {
    /// With its extension.
    pub name: String,
    /// ASCII.
    pub text: String,
}

/// What a language can hold.
struct Limits {
    joints_min: usize,
    joints_max: usize,
    /// Whether a linear joint can be among the first six; and among the others.
    robot_prismatic: bool,
    external_prismatic: bool,
    /// Characters of a name.
    name_max: usize,
    name_has_underscores: bool,
    steps_max: usize,
}

/// Writes a program as the files of a language. Where there are several, all are needed, and the first is the one to run.
///
/// # Errors
/// [`ProgramError`] when the language cannot hold it, or there is nothing to write.
pub fn write_program(dialect: Dialect, program: &Program) -> Result<Vec<ProgramFile>, ProgramError> {
    let (limits, write): (Limits, fn(&Program) -> Vec<ProgramFile>) = match dialect {
        Dialect::Val => (val::LIMITS, val::write),
        Dialect::UrScript => (urscript::LIMITS, urscript::write),
        Dialect::Krl => (krl::LIMITS, krl::write),
        Dialect::Rapid => (rapid::LIMITS, rapid::write),
        Dialect::FanucLs => (fanuc::LIMITS, fanuc::write),
    };
    limits.check(dialect, program)?;
    Ok(write(program))
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

impl Limits {
    fn check(&self, dialect: Dialect, program: &Program) -> Result<(), ProgramError> {
        let joints = program.kinds.len();
        if !(self.joints_min..=self.joints_max).contains(&joints) {
            let (at_least, at_most) = (self.joints_min, self.joints_max);
            return Err(ProgramError::Joints { dialect, found: joints, at_least, at_most });
        }
        let holds = |joint: usize| if joint < 6 { self.robot_prismatic } else { self.external_prismatic };
        let prismatic = |joint: &usize| program.kinds[*joint] == JointKind::Prismatic && !holds(*joint);
        if let Some(joint) = (0..joints).find(prismatic) {
            return Err(ProgramError::Prismatic { dialect, joint: joint + 1 });
        }
        let name = &program.name;
        let is_letter = |c: char| c.is_ascii_alphanumeric() || (c == '_' && self.name_has_underscores);
        let is_name =
            name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(is_letter) && name.len() <= self.name_max;
        if !is_name {
            let underscores = if self.name_has_underscores { ", digits and underscores" } else { " and digits" };
            return Err(ProgramError::Name { dialect, found: name.clone(), at_most: self.name_max, underscores });
        }
        let is_speed = |speed: f64| speed.is_finite() && speed > 0.0;
        if !is_speed(program.speed.revolute_rad_s) || !is_speed(program.speed.prismatic_m_s) {
            return Err(ProgramError::Speed);
        }
        if !(0.0..=STAND_MAX_S).contains(&program.stand_s) {
            return Err(ProgramError::Stand { found_s: program.stand_s, at_most_s: STAND_MAX_S });
        }
        if program.steps.is_empty() {
            return Err(ProgramError::NoSteps);
        }
        if program.steps.len() > self.steps_max {
            return Err(ProgramError::Steps { dialect, found: program.steps.len(), at_most: self.steps_max });
        }
        for (number, step) in (1..).zip(&program.steps) {
            // A million degrees or millimetres is more than any joint has, and room enough in every language's columns.
            if let Some(joint) = program.values(step).iter().position(|value| value.is_nan() || value.abs() > 1e6) {
                return Err(ProgramError::Value { step: number, joint: joint + 1 });
            }
        }
        Ok(())
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

    /// Time for the move to a step at the program's speed, seconds, such that no joint is faster in its middle; `None` for the first,
    /// whose way is not known.
    fn move_s(&self, index: usize) -> Option<f64> {
        let from = &self.steps.get(index.checked_sub(1)?)?.q;
        let duration_s = self.speed.duration_s(&self.kinds, from, &self.steps[index].q);
        // Rounded up to hundredths.
        Some(((PEAK_SPEED * duration_s).max(MOVE_MIN_S) * 100.0).ceil() / 100.0)
    }
}

/// The text's printable ASCII without what ends a comment in one of the languages, at most `width` characters.
fn printable(text: &str, width: usize) -> String {
    let kept = |c: char| c.is_ascii_alphanumeric() || " .,:+-=()/#_".contains(c);
    let text: String = text.chars().map(|c| if kept(c) { c } else { ' ' }).collect();
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    // ASCII, so that characters are bytes.
    text[..text.len().min(width)].trim_end().to_owned()
}
