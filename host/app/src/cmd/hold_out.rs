//! `--hold-out`: poses kept apart from a fit, to judge it by.

use std::fmt;
use std::str::FromStr;

use ballbar::Chain;
use ballbar_calib::identify::{ResidualSummary, residuals};
use ballbar_calib::model::{Dataset, PairingId, PoseRow, Rig, Robot};
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::inputs::parse_pairings;
use super::outcome::CommandError;
use crate::units::{m_from_mm, mm_from_m, tidy};

/// Conditions of which a row has to meet one to be held out.
#[derive(Clone, Debug)]
pub(super) struct HoldOut {
    text: String,
    conditions: Vec<Condition>,
}

#[derive(Clone, Debug)]
enum Condition {
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
                "bar" => value.parse().ok().filter(|&mm| mm > 0.0 && mm <= 1e6).map(|mm| Condition::Bar(m_from_mm(mm))),
                "pairing" if value.contains(':') => Some(Condition::Pairing(value.to_owned())),
                "set" if !value.is_empty() => Some(Condition::Set(value.to_owned())),
                _ => None,
            }
            .ok_or_else(expected)
        };
        let conditions = text.split(',').map(condition).collect::<Result<_, _>>()?;
        Ok(Self { text: text.to_owned(), conditions })
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
    pub(super) fn split(&self, dataset: Dataset, rig: &Rig) -> Result<(Dataset, Dataset), CommandError> {
        let mut pairings = Vec::new();
        for condition in &self.conditions {
            if let Condition::Pairing(text) = condition {
                pairings.extend(parse_pairings(text, rig)?);
            }
        }
        let known = known(&dataset, rig);
        let (held_out, others) = dataset.split(|row| self.holds_out(row, rig, &pairings));
        if held_out.rows.is_empty() {
            return Err(HoldOutError::Nothing { rule: self.text.clone(), known }.into());
        }
        if others.rows.is_empty() {
            return Err(HoldOutError::Everything { rule: self.text.clone(), known }.into());
        }
        Ok((held_out, others))
    }

    fn holds_out(&self, row: &PoseRow, rig: &Rig, pairings: &[PairingId]) -> bool {
        /// Lengths of bars are whole millimetres.
        const SAME_M: f64 = 1e-6;
        self.conditions.iter().any(|condition| match condition {
            Condition::Bar(wanted_m) => bar_m(row, rig).is_some_and(|bar_m| (bar_m - wanted_m).abs() < SAME_M),
            Condition::Pairing(_) => pairings.contains(&row.pairing),
            Condition::Set(set) => row.set.as_ref() == Some(set),
        })
    }
}

/// The bar that a row was measured with: as the file says, or the one of the rig within whose travel the length lies.
fn bar_m(row: &PoseRow, rig: &Rig) -> Option<f64> {
    let by_length = || {
        let bar = rig.bar.as_ref()?;
        let off = |mid_m: f64| (row.measurement.length_m - mid_m).abs();
        let nearest = bar.lengths_m.iter().copied().min_by(|&a, &b| off(a).total_cmp(&off(b)))?;
        (off(nearest) <= bar.travel_m / 2.0).then_some(nearest)
    };
    row.bar_m.or_else(by_length)
}

/// What could be held out, in words.
fn known(dataset: &Dataset, rig: &Rig) -> String {
    let list = |mut words: Vec<String>| {
        words.sort();
        words.dedup();
        words.join(", ")
    };
    let bars = dataset.rows.iter().filter_map(|row| bar_m(row, rig)).map(|m| tidy(mm_from_m(m)).to_string()).collect();
    let pairings = dataset.pairings().into_iter().map(|pairing| rig.pairing_name(pairing)).collect();
    let sets = dataset.rows.iter().filter_map(|row| row.set.clone()).collect();
    [("bars of ", list(bars), " mm"), ("pairings ", list(pairings), ""), ("sets ", list(sets), "")]
        .into_iter()
        .filter(|(_, words, _)| !words.is_empty())
        .map(|(before, words, after)| format!("{before}{words}{after}"))
        .collect::<Vec<_>>()
        .join("; ")
}

/// How well held-out poses are predicted, by the design and by the fit.
#[derive(Serialize)]
pub(super) struct HeldOutRows {
    rule: String,
    poses: usize,
    rms_initial_mm: f64,
    pub(super) rms_mm: f64,
    max_abs_mm: f64,
    mean_mm: f64,
}

impl HeldOutRows {
    pub(super) fn new(rule: &HoldOut, rows: &Dataset, design: &Robot, fitted: &Chain<f64>) -> Self {
        let summary = |chain| ResidualSummary::new(&residuals(chain, rows));
        let (initial, after) = (summary(&design.chain), summary(fitted));
        Self {
            rule: rule.to_string(),
            poses: after.count,
            rms_initial_mm: mm_from_m(initial.rms_m),
            rms_mm: mm_from_m(after.rms_m),
            max_abs_mm: mm_from_m(after.max_abs_m),
            mean_mm: mm_from_m(after.mean_m),
        }
    }

    pub(super) fn text(&self) -> String {
        format!(
            "held out ({}), {} poses: RMS {:.4} mm before, {:.4} mm after, mean {:.4} mm, largest {:.4} mm\n",
            self.rule, self.poses, self.rms_initial_mm, self.rms_mm, self.mean_mm, self.max_abs_mm
        )
    }
}
