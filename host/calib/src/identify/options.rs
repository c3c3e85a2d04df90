//! What a fit is asked for.

use ballbar::{Damping, Parameter};
use thiserror::Error;

use super::hold::Hold;
use crate::unknowns::AnyBlock;

/// What to find out beside the chain, what to hold, what to believe, and how to step.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FitOptions {
    /// Parameters that stay at their design values.
    pub hold: Hold,
    /// What is believed of the others.
    pub prior: PriorRule,
    /// What becomes of rows that contradict the others.
    pub loss: Loss,
    /// λI or λ·diag.
    pub damping: Damping,
    /// What is not known beside the chain ([`crate::unknowns::Kind::block`]).
    pub unknowns: Vec<AnyBlock>,
}

/// What is believed of a chain before anything is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum PriorRule {
    /// What its tolerances say.
    #[default]
    Tolerances,
    /// Nothing: lengths alone decide, and what they do not tell is held.
    None,
}

/// What becomes of rows that contradict the others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Loss {
    /// They are left out, by Tukey's biweight and studentised residuals.
    #[default]
    Tukey,
    /// They are fitted with the others.
    None,
}

impl FitOptions {
    /// The paper's least squares: nothing believed, and all rows fitted.
    pub fn plain() -> Self {
        Self { prior: PriorRule::None, loss: Loss::None, ..Self::default() }
    }
}

/// Why there is no fit.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FitError {
    /// A fit without redundancy would meet every length and prove nothing.
    #[error("{rows} poses for {free} free parameters, expected more poses than free parameters")]
    NoRedundancy {
        /// Poses given.
        rows: usize,
        /// Parameters that would be free.
        free: usize,
    },
    /// A parameter is to be held that this robot does not have.
    #[error("the robot has no parameter `{0}`")]
    NoSuchParameter(Parameter),
}
