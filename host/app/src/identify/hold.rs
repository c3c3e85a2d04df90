//! Which parameters a fit leaves alone.

use std::fmt;
use std::str::FromStr;

use ballbar::{Chain, Parameter};
use miette::Diagnostic;
use thiserror::Error;

use super::identifiability::{Finding, Identifiability};

/// `--hold`: a rule, and parameters held by name besides.
#[derive(Clone, Debug, PartialEq)]
pub struct Hold {
    rule: Rule,
    names: Vec<Parameter>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Rule {
    /// Hold what the data do not identify.
    Auto,
    /// Hold what the paper holds.
    Paper,
    /// Hold nothing but the names.
    None,
}

impl Default for Hold {
    fn default() -> Self {
        Self { rule: Rule::Auto, names: Vec::new() }
    }
}

/// Why a `--hold` cannot be used.
#[derive(Clone, Debug, PartialEq, Error, Diagnostic)]
pub enum HoldError {
    /// Neither a rule nor a parameter.
    #[error("`{0}` is neither `auto`, `paper`, `none` nor a parameter")]
    #[diagnostic(help(
        "Parameters are x, y, z, alpha, beta, gamma, offset or scale and a link number, as in `--hold auto,scale3`."
    ))]
    Unknown(String),
    /// Two rules.
    #[error("`{0}` stands beside another rule (`auto`, `paper` or `none`)")]
    #[diagnostic(help("Give one rule, and as many parameter names as you like: `--hold paper,x1`."))]
    TwoRules(String),
    /// A parameter that this robot does not have.
    #[error("the robot has no parameter `{0}`")]
    #[diagnostic(help("A robot of J joints has x1 … gamma1, offset1, scale1 up to gamma(J+1)."))]
    NotOfThisRobot(Parameter),
}

impl FromStr for Hold {
    type Err = HoldError;

    /// `auto`, `paper`, `none`, parameter names, or a rule and names, separated by commas. Names alone hold just these.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mut rule = None;
        let mut names = Vec::new();
        for word in text.split(',').map(str::trim) {
            let next = match word {
                "auto" => Rule::Auto,
                "paper" => Rule::Paper,
                "none" => Rule::None,
                name => {
                    names.push(name.parse().map_err(|_| HoldError::Unknown(name.to_owned()))?);
                    continue;
                }
            };
            if rule.replace(next).is_some() {
                return Err(HoldError::TwoRules(word.to_owned()));
            }
        }
        Ok(Self { rule: rule.unwrap_or(Rule::None), names })
    }
}

impl Hold {
    /// The paper's rule.
    pub fn paper() -> Self {
        Self { rule: Rule::Paper, names: Vec::new() }
    }

    /// No parameter held.
    pub fn none() -> Self {
        Self { rule: Rule::None, names: Vec::new() }
    }

    /// Parameters held by name.
    ///
    /// # Errors
    /// [`HoldError::NotOfThisRobot`] for a name beyond the chain's parameters.
    pub fn names_of(&self, chain: &Chain<f64>) -> Result<&[Parameter], HoldError> {
        match self.names.iter().find(|name| name.index() >= chain.parameter_count()) {
            Some(&name) => Err(HoldError::NotOfThisRobot(name)),
            None => Ok(&self.names),
        }
    }

    /// Why each parameter is held; `None` for the free ones.
    pub fn reasons(&self, chain: &Chain<f64>, found: &Identifiability) -> Vec<Option<Held>> {
        let reason = |(index, finding): (usize, &Finding)| {
            let parameter = Parameter::from_index(index);
            match self.rule {
                _ if self.names.contains(&parameter) => Some(Held::ByName),
                Rule::Auto if *finding != Finding::Identified => Some(Held::Finding(finding.clone())),
                Rule::Paper if chain.is_conventionally_held(parameter) => Some(Held::AsInPaper),
                Rule::Auto | Rule::Paper | Rule::None => None,
            }
        };
        found.findings.iter().enumerate().map(reason).collect()
    }
}

/// Why a parameter stays at its design value.
#[derive(Clone, Debug, PartialEq)]
pub enum Held {
    /// `--hold` names it.
    ByName,
    /// `--hold paper`, and the paper holds it.
    AsInPaper,
    /// `--hold auto`, and the poses do not identify it.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_and_names_combine() {
        let scale3 = "scale3".parse::<Parameter>().unwrap();
        assert_eq!("auto".parse(), Ok(Hold::default()));
        assert_eq!("paper, scale3".parse(), Ok(Hold { rule: Rule::Paper, names: vec![scale3] }));
        assert_eq!("scale3".parse(), Ok(Hold { rule: Rule::None, names: vec![scale3] }));
        assert_eq!("auto,none".parse::<Hold>(), Err(HoldError::TwoRules("none".into())));
        assert_eq!("sclae3".parse::<Hold>(), Err(HoldError::Unknown("sclae3".into())));
        assert_eq!("".parse::<Hold>(), Err(HoldError::Unknown(String::new())));
    }
}
