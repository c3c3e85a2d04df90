//! The words of `--hold`.

use ballbar_calib::identify::{Hold, HoldRule};
use miette::Diagnostic;
use thiserror::Error;

/// Why a `--hold` cannot be used.
#[derive(Clone, Debug, PartialEq, Error, Diagnostic)]
pub(super) enum HoldError {
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
}

/// `auto`, `paper`, `none`, parameter names, or a rule and names, separated by commas. Names alone hold just these.
pub(super) fn parse_hold(text: &str) -> Result<Hold, HoldError> {
    let mut rule = None;
    let mut names = Vec::new();
    for word in text.split(',').map(str::trim) {
        let next = match word {
            "auto" => HoldRule::Auto,
            "paper" => HoldRule::Paper,
            "none" => HoldRule::None,
            name => {
                names.push(name.parse().map_err(|_| HoldError::Unknown(name.to_owned()))?);
                continue;
            }
        };
        if rule.replace(next).is_some() {
            return Err(HoldError::TwoRules(word.to_owned()));
        }
    }
    Ok(Hold { rule: rule.unwrap_or(HoldRule::None), names })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ballbar::Parameter;

    #[test]
    fn rules_and_names_combine() {
        let scale3 = "scale3".parse::<Parameter>().unwrap();
        assert_eq!(parse_hold("auto"), Ok(Hold::default()));
        assert_eq!(parse_hold("paper, scale3"), Ok(Hold { rule: HoldRule::Paper, names: vec![scale3] }));
        assert_eq!(parse_hold("scale3"), Ok(Hold { rule: HoldRule::None, names: vec![scale3] }));
        assert_eq!(parse_hold("auto,none"), Err(HoldError::TwoRules("none".into())));
        assert_eq!(parse_hold("sclae3"), Err(HoldError::Unknown("sclae3".into())));
        assert_eq!(parse_hold(""), Err(HoldError::Unknown(String::new())));
    }
}
