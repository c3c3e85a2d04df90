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
    #[diagnostic(help("Is it this robot's controller? Linear axes of most are external ones, after the sixth."))]
    Prismatic {
        /// The language.
        dialect: Dialect,
        /// From 1.
        joint: usize,
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
