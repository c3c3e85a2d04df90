//! `--hold-out`: poses kept apart from a fit, to judge it by.

use std::fmt;
use std::str::FromStr;

use ballbar_calib::model::{self, Choice, Condition, Dataset, HeldOut, Rig};
use miette::Diagnostic;
use thiserror::Error;

use super::outcome::CommandError;
use super::pairings::parse_pairings;
use crate::units::{m_from_mm, mm_from_m, tidy};

/// Conditions of which a row has to meet one to be held out.
#[derive(Clone, Debug)]
pub(super) struct HoldOut {
    text: String,
    words: Vec<Word>,
}

/// A condition before the rig is known, whose pairings have names.
#[derive(Clone, Debug)]
enum Word {
    Bar(f64),
    Pairing(String),
    Set(String),
}

#[derive(Debug, Error, Diagnostic)]
pub(super) enum HoldOutError {
    #[error("--hold-out {rule}: no pose is of it")]
    #[diagnostic(help("The poses have {known}."))]
    Nothing { rule: String, known: String },
    #[error("--hold-out {rule}: every pose is of it, and none is left")]
    #[diagnostic(help("The poses have {known}."))]
    Everything { rule: String, known: String },
}

impl FromStr for HoldOut {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let condition = |word: &str| {
            let (key, value) = word.split_once('=').ok_or_else(expected)?;
            let value = value.trim();
            match key.trim() {
                "bar" => value.parse().ok().filter(|&mm| mm > 0.0 && mm <= 1e6).map(|mm| Word::Bar(m_from_mm(mm))),
                "pairing" if value.contains(':') => Some(Word::Pairing(value.to_owned())),
                "set" if !value.is_empty() => Some(Word::Set(value.to_owned())),
                _ => None,
            }
            .ok_or_else(expected)
        };
        let words = text.split(',').map(condition).collect::<Result<_, _>>()?;
        Ok(Self { text: text.to_owned(), words })
    }
}

fn expected() -> String {
    "expected bar=MM, pairing=CHUCK:SPHERE or set=NAME, several separated by commas".into()
}

impl fmt::Display for HoldOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl HoldOut {
    /// The rows that are held out, and the others; neither is empty.
    pub(super) fn split(&self, dataset: Dataset, rig: &Rig) -> Result<HeldOut, CommandError> {
        let mut conditions = Vec::new();
        for word in &self.words {
            match word {
                Word::Bar(bar_m) => conditions.push(Condition::Bar(*bar_m)),
                Word::Pairing(text) => conditions.extend(parse_pairings(text, rig)?.into_iter().map(Condition::Pairing)),
                Word::Set(set) => conditions.push(Condition::Set(set.clone())),
            }
        }
        let rule = || self.text.clone();
        dataset.hold_out(rig, &conditions).map_err(|error| match error {
            model::HoldOutError::Nothing(choice) => HoldOutError::Nothing { rule: rule(), known: in_words(&choice, rig) }.into(),
            model::HoldOutError::Everything(choice) => {
                HoldOutError::Everything { rule: rule(), known: in_words(&choice, rig) }.into()
            }
        })
    }
}

/// What could be held out.
fn in_words(choice: &Choice, rig: &Rig) -> String {
    let list = |mut words: Vec<String>| {
        words.sort();
        words.dedup();
        words.join(", ")
    };
    let bars = choice.bars_m.iter().map(|&m| tidy(mm_from_m(m)).to_string()).collect();
    let pairings = choice.pairings.iter().map(|&pairing| rig.pairing_name(pairing)).collect();
    [("bars of ", list(bars), " mm"), ("pairings ", list(pairings), ""), ("sets ", list(choice.sets.clone()), "")]
        .into_iter()
        .filter(|(_, words, _)| !words.is_empty())
        .map(|(before, words, after)| format!("{before}{words}{after}"))
        .collect::<Vec<_>>()
        .join("; ")
}
