//! Lines that several documents have in common.

use ballbar_calib::identify::{Finding, Fit, Identifiability, PairingResiduals, Residual, ResidualSummary, residuals};
use ballbar_calib::model::{Dataset, Rig, Robot};
use serde::Serialize;

use crate::units::mm_from_m;

/// Residuals of one pairing, for tables and JSON.
#[derive(Clone, Debug, Serialize)]
pub struct PairingLine {
    /// `chuck:sphere`.
    pub pairing: String,
    /// How many.
    pub poses: usize,
    /// Root of their mean square.
    pub rms_mm: f64,
    /// Their mean.
    pub mean_mm: f64,
    /// The largest.
    pub max_abs_mm: f64,
}

impl PairingLine {
    /// In the units of the screen.
    pub fn new(rig: &Rig, residuals: &PairingResiduals) -> Self {
        let PairingResiduals { pairing, summary } = residuals;
        Self {
            pairing: rig.pairing_name(*pairing),
            poses: summary.count,
            rms_mm: mm_from_m(summary.rms_m),
            mean_mm: mm_from_m(summary.mean_m),
            max_abs_mm: mm_from_m(summary.max_abs_m),
        }
    }
}

/// One row's residual.
#[derive(Clone, Debug, Serialize)]
pub struct ResidualLine {
    /// From 1, over all files.
    pub row: usize,
    /// File and line.
    pub place: String,
    /// `chuck:sphere`.
    pub pairing: String,
    /// Measured less computed.
    pub residual_mm: f64,
}

/// The rows with the largest residuals, the worst first.
pub fn largest(dataset: &Dataset, rig: &Rig, residuals: &[Residual], count: usize) -> Vec<ResidualLine> {
    // Those that were left out of a fit are told of elsewhere.
    let mut order: Vec<usize> = (0..residuals.len()).filter(|&row| residuals[row].weight > 0.0).collect();
    let size = |row: usize| residuals[row].value_m.abs();
    order.sort_by(|&a, &b| size(b).total_cmp(&size(a)));
    let line = |&row: &usize| ResidualLine {
        row: dataset.rows[row].number,
        place: dataset.place(row),
        pairing: rig.pairing_name(dataset.rows[row].pairing),
        residual_mm: mm_from_m(residuals[row].value_m),
    };
    order.iter().take(count).map(line).collect()
}

/// A parameter that the poses do not identify.
#[derive(Clone, Debug, Serialize)]
pub struct NotIdentified {
    /// Its name.
    pub name: String,
    /// Why, in a word.
    pub kind: &'static str,
    /// Why, in a sentence.
    pub why: String,
}

impl NotIdentified {
    /// All of them.
    pub fn all(found: &Identifiability) -> Vec<Self> {
        let line =
            |(name, finding): (&str, &Finding)| Self { name: name.to_owned(), kind: finding.kind(), why: finding.to_string() };
        found.not_identified().map(line).collect()
    }
}

/// How well held-out poses are predicted, by the design and by the fit.
#[derive(Clone, Debug, Serialize)]
pub struct HeldOutRows {
    /// What they were held out by.
    pub rule: String,
    /// How many.
    pub poses: usize,
    /// RMS residual of the design.
    pub rms_initial_mm: f64,
    /// RMS residual of the fit.
    pub rms_mm: f64,
    /// The fit's largest.
    pub max_abs_mm: f64,
    /// The fit's mean.
    pub mean_mm: f64,
}

impl HeldOutRows {
    /// With a rule in words, of a design and a fit.
    pub fn new(rule: &str, rows: &Dataset, design: &Robot, fit: &Fit) -> Self {
        let initial = ResidualSummary::new(&residuals(&design.kinematics(), rows));
        let after = ResidualSummary::new(&fit.residuals_of(rows));
        Self {
            rule: rule.to_owned(),
            poses: after.count,
            rms_initial_mm: mm_from_m(initial.rms_m),
            rms_mm: mm_from_m(after.rms_m),
            max_abs_mm: mm_from_m(after.max_abs_m),
            mean_mm: mm_from_m(after.mean_m),
        }
    }
}
