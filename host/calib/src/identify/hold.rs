//! Which parameters a fit leaves alone.

use std::fmt;

use ballbar::Parameter;

use super::identifiability::{Finding, Identifiability};
use crate::unknowns::ChainBlock;

/// Which parameters stay at their design values: a rule, and parameters by name besides.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Hold {
    /// For all of them.
    pub rule: HoldRule,
    /// Besides.
    pub names: Vec<Parameter>,
}

/// By which most parameters are held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum HoldRule {
    /// Hold what the data do not identify.
    #[default]
    Auto,
    /// Hold what the paper holds.
    Paper,
    /// Hold nothing but the names.
    None,
}

impl Hold {
    /// The paper's rule.
    pub fn paper() -> Self {
        Self { rule: HoldRule::Paper, names: Vec::new() }
    }

    /// No parameter held.
    pub fn none() -> Self {
        Self { rule: HoldRule::None, names: Vec::new() }
    }

    /// Whether it says nothing that depends on how the robot's frames are written.
    pub fn is_of_any_frames(&self) -> bool {
        self.rule == HoldRule::Auto && self.names.is_empty()
    }

    /// Why each unknown is held; `None` for the free ones.
    pub fn reasons(&self, chain: &ChainBlock, found: &Identifiability) -> Vec<Option<Held>> {
        let reason = |(index, finding): (usize, &Finding)| match self.rule {
            _ if self.names.iter().any(|name| name.index() == index) => Some(Held::ByName),
            HoldRule::Auto if *finding != Finding::Identified => Some(Held::Finding(finding.clone())),
            HoldRule::Paper if chain.is_held_in_paper(index) => Some(Held::AsInPaper),
            HoldRule::Auto | HoldRule::Paper | HoldRule::None => None,
        };
        found.findings.iter().enumerate().map(reason).collect()
    }
}

/// Why a parameter stays at its design value.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Held {
    /// Its name was given.
    ByName,
    /// The paper holds it.
    AsInPaper,
    /// The poses do not identify it.
    Finding(Finding),
}

impl fmt::Display for Held {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ByName => f.write_str("by name"),
            Self::AsInPaper => f.write_str("as in the paper"),
            Self::Finding(finding) => finding.fmt(f),
        }
    }
}
