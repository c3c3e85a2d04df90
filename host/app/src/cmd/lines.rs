//! Lines that several reports have in common.

use ballbar_calib::identify::{Finding, Identifiability, PairingResiduals, Residual};
use ballbar_calib::model::{Dataset, Rig};
use serde::Serialize;

use crate::terminal::table::{Columns, fixed};
use crate::units::mm_from_m;

/// Residuals of one pairing, for tables and JSON.
#[derive(Serialize)]
pub(super) struct PairingLine {
    pub(super) pairing: String,
    pub(super) poses: usize,
    pub(super) rms_mm: f64,
    pub(super) mean_mm: f64,
    pub(super) max_abs_mm: f64,
}

impl PairingLine {
    pub(super) fn new(rig: &Rig, residuals: &PairingResiduals) -> Self {
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
#[derive(Serialize)]
pub(super) struct ResidualLine {
    /// From 1, over all files.
    pub(super) row: usize,
    /// File and line.
    pub(super) place: String,
    pub(super) pairing: String,
    pub(super) residual_mm: f64,
}

/// The rows with the largest residuals, the worst first.
pub(super) fn largest(dataset: &Dataset, rig: &Rig, residuals: &[Residual], count: usize) -> Vec<ResidualLine> {
    let mut order: Vec<usize> = (0..residuals.len()).collect();
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

/// A table of the largest residuals.
pub(super) fn largest_text(lines: &[ResidualLine]) -> String {
    let mut table = Columns::new(&["row", "<at", "<pairing", "residual mm"]);
    for line in lines {
        table.row([line.row.to_string(), line.place.clone(), line.pairing.clone(), fixed(line.residual_mm, 4)]);
    }
    table.text()
}

/// A parameter that the poses do not identify.
#[derive(Serialize)]
pub(super) struct NotIdentified {
    pub(super) name: String,
    pub(super) kind: &'static str,
    pub(super) why: String,
}

impl NotIdentified {
    pub(super) fn all(found: &Identifiability) -> Vec<Self> {
        let line = |(parameter, finding): (ballbar::Parameter, &Finding)| Self {
            name: parameter.to_string(),
            kind: finding.kind(),
            why: finding.to_string(),
        };
        found.not_identified().map(line).collect()
    }
}
