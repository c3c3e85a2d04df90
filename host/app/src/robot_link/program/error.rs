//! Why a program cannot be written.

use miette::Diagnostic;
use thiserror::Error;

use super::Dialect;

/// A language cannot hold a program, or there is none.
#[derive(Debug, Clone, PartialEq, Error, Diagnostic)]
pub enum ProgramError {
    /// There is nothing to do.
    #[error("the program has no steps")]
    #[diagnostic(help("Plan some poses first."))]
    NoSteps,
    /// The robot has another number of joints than the controller's robots.
    #[error("{dialect}: the robot has {found} joints, a program of this language {at_least} to {at_most}")]
    #[diagnostic(help("Is it this robot's controller?"))]
    Joints {
        /// The language.
        dialect: Dialect,
        /// The robot's.
        found: usize,
        /// The language's fewest.
        at_least: usize,
        /// The language's most.
        at_most: usize,
    },
    /// A linear joint where the language has degrees.
    #[error("{dialect}: joint {joint} is prismatic, and the language has degrees there")]
    #[diagnostic(help(
        "Is it this robot's controller? Linear axes of most are external ones: in front of the arm, or after its sixth."
    ))]
    Prismatic {
        /// The language.
        dialect: Dialect,
        /// From 1.
        joint: usize,
    },
    /// More external axes than the language has.
    #[error("{dialect}: the robot has {found} axes beside its arm, a program of this language {at_most} at most")]
    #[diagnostic(help("Prismatic joints in front of the arm, and joints after its sixth, are external axes."))]
    External {
        /// The language.
        dialect: Dialect,
        /// The robot's.
        found: usize,
        /// The language's.
        at_most: usize,
    },
    /// The name is none of the language.
    #[error("{dialect}: `{found}` cannot be a program's name")]
    #[diagnostic(help("Take a letter, then letters{underscores}, {at_most} characters in all."))]
    Name {
        /// The language.
        dialect: Dialect,
        /// The name.
        found: String,
        /// Characters.
        at_most: usize,
        /// What may follow, besides letters.
        underscores: &'static str,
    },
    /// No speed.
    #[error("a speed is not above zero")]
    #[diagnostic(help("Give a speed above zero."))]
    Speed,
    /// Percentages are whole, and one is faster than what was asked for.
    #[error("{dialect}: {asked:.3} {unit}/s is less than one percent of {full:.0} {unit}/s, the full speed")]
    #[diagnostic(help(
        "Give a higher speed, or with --robot-fastest-deg-s what the robot's fastest joint reaches by its data sheet."
    ))]
    Slow {
        /// The language.
        dialect: Dialect,
        /// Degrees or millimetres per second.
        asked: f64,
        /// Degrees or millimetres per second.
        full: f64,
        /// `deg` or `mm`.
        unit: &'static str,
    },
    /// The tool is none of the language.
    #[error("{dialect}: `{found}` is no tool, expected {expected}")]
    #[diagnostic(help("It is the controller's tool whose load is the plate with its spheres."))]
    Tool {
        /// The language.
        dialect: Dialect,
        /// What was given.
        found: String,
        /// What a tool is in this language.
        expected: &'static str,
    },
    /// How J3 is counted is not known.
    #[error("fanuc: how the controller counts J3 is not said")]
    #[diagnostic(help(
        "Give --fanuc-j23 -1, 0 or 1. Jog J2 alone by +10 degrees, so that the pendant's J3 stays, and look at joint 3 of `host-cal pose`: \
         it has turned by +10 degrees: -1; by -10: 1; it has not turned: 0."
    ))]
    J23Missing,
    /// The arm has no J2 and J3 that turn.
    #[error("fanuc: J3 + {found} · J2 of an arm whose second and third axis do not both turn")]
    #[diagnostic(help("Leave --fanuc-j23 out, or give 0."))]
    J23Needless {
        /// What was given.
        found: i8,
    },
    /// Not one of the three.
    #[error("fanuc: J3 cannot be counted with {found} times J2")]
    #[diagnostic(help("-1, 0 or 1."))]
    J23Value {
        /// What was given.
        found: i8,
    },
    /// The robot cannot stand for so long.
    #[error("the robot is to stand for {found_s} s, expected 0 to {at_most_s}")]
    #[diagnostic(help("A few seconds are enough for an arm to come to rest."))]
    Stand {
        /// Seconds.
        found_s: f64,
        /// Seconds.
        at_most_s: f64,
    },
    /// More steps than the language can name.
    #[error("{dialect}: {found} steps, a program of this language has {at_most} at most")]
    #[diagnostic(help("Plan fewer poses, or write several programs."))]
    Steps {
        /// The language.
        dialect: Dialect,
        /// The program's.
        found: usize,
        /// The language's.
        at_most: usize,
    },
    /// A joint value that no joint has.
    #[error("step {step}: joint {joint} has no value that a joint can have")]
    #[diagnostic(help("Is the plan damaged?"))]
    Value {
        /// From 1.
        step: usize,
        /// From 1.
        joint: usize,
    },
}
