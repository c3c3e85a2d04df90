//! Which parameters a fit leaves alone.

use std::fmt;

use ballbar::Parameter;

use super::identifiability::{Finding, Identifiability};

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

    /// Why each unknown is held; `None` for the free ones. `independent` are the chain's parameters that a fit of all of them would free, of
    /// `parameters` in all.
    pub(super) fn reasons(&self, parameters: usize, independent: &[usize], found: &Identifiability) -> Vec<Option<Held>> {
        let reason = |(index, finding): (usize, &Finding)| match self.rule {
            _ if self.names.iter().any(|name| name.index() == index) => Some(Held::ByName),
            HoldRule::Auto if *finding != Finding::Identified => Some(Held::Finding(finding.clone())),
            HoldRule::Paper if index < parameters && !independent.contains(&index) => Some(Held::AsInPaper),
            HoldRule::Auto | HoldRule::Paper | HoldRule::None => None,
        };
        found.findings.iter().enumerate().map(reason).collect()
    }

    /// The same where tolerances say of the chain's parameters what the poses do not: only those are held that nothing could tell, and those
    /// that are known exactly.
    pub(super) fn reasons_beside_prior(
        &self,
        parameters: usize,
        independent: &[usize],
        exact: &[usize],
        found: &Identifiability,
    ) -> Vec<Option<Held>> {
        let reason = |(index, finding): (usize, &Finding)| match self.rule {
            _ if self.names.iter().any(|name| name.index() == index) => Some(Held::ByName),
            _ if exact.contains(&index) => Some(Held::Exact),
            HoldRule::None => None,
            _ if index < parameters => (!independent.contains(&index)).then(|| match (self.rule, finding) {
                (HoldRule::Paper, _) => Held::AsInPaper,
                (_, Finding::Redundant { .. }) => Held::Finding(finding.clone()),
                // What is told by chance in these poses stands in for what was chosen.
                _ => Held::Finding(Finding::Redundant { with: Vec::new() }),
            }),
            _ => (*finding != Finding::Identified).then(|| Held::Finding(finding.clone())),
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
    /// Its tolerance is zero.
    Exact,
    /// The poses do not identify it.
    Finding(Finding),
}

impl fmt::Display for Held {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ByName => f.write_str("by name"),
            Self::AsInPaper => f.write_str("as in the paper"),
            Self::Exact => f.write_str("known exactly"),
            Self::Finding(finding) => finding.fmt(f),
        }
    }
}
