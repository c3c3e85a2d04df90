//! What a robot's file says of the fit that its parameters come from.

use std::path::Path;

use ballbar::Chain;
use ballbar_calib::assess::{Answer, Assessment, Evidence};
use ballbar_calib::model::{Calibration, CalibrationVerdict};
use ballbar_calib::units::mm_from_m;
use miette::Diagnostic;
use thiserror::Error;

use super::kind::FileKind;
use super::robot::calibrated_toml;
use super::source::Source;
use super::write::{Output, WriteError};

/// Why a calibrated robot's file was not written.
#[derive(Debug, Error, Diagnostic)]
pub enum CalibratedError {
    /// The design's text, which is kept around the new numbers.
    #[error("{name}: the robot's text cannot be edited: {reason}")]
    Edit {
        /// The design's file.
        name: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The file.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Write(#[from] WriteError),
}

/// Writes the text of a design with what is worth keeping of a fit and a `[calibration]` table; whether there was anything.
///
/// # Errors
/// [`CalibratedError`].
pub fn write_calibrated(
    path: &Path,
    force: bool,
    design: &Source,
    evidence: &Evidence<'_>,
    assessment: &Assessment,
) -> Result<bool, CalibratedError> {
    let Some((chain, calibration)) = calibration(evidence, assessment) else { return Ok(false) };
    let is_unchanged = assessment.answer == Answer::Unchanged;
    let terms = if is_unchanged { evidence.robot.terms } else { evidence.fit.robot(evidence.robot).terms };
    let edited = calibrated_toml(design, chain, &terms, &calibration);
    let text = edited.map_err(|error| CalibratedError::Edit { name: design.name().to_owned(), reason: error.to_string() })?;
    Output { path, kind: FileKind::Robot, force }.write(&text)?;
    Ok(true)
}

/// The parameters worth keeping, and what a robot's file says of them, dated now; `None` where the result is not to be used.
pub fn calibration<'a>(evidence: &Evidence<'a>, assessment: &Assessment) -> Option<(&'a Chain<f64>, Calibration)> {
    let Evidence { robot, dataset, fit, .. } = *evidence;
    let verdict = match assessment.answer {
        Answer::NotTrusted => return None,
        Answer::Calibrated => CalibrationVerdict::Calibrated,
        Answer::Reserved | Answer::Unchanged => CalibrationVerdict::Reserved,
    };
    let is_unchanged = assessment.answer == Answer::Unchanged;
    let (chain, kept) = if is_unchanged { (&robot.chain, fit.initial) } else { (&fit.solution.chain, fit.fitted) };
    let now = jiff::Timestamp::now();
    let calibration = Calibration {
        when: now.round(jiff::Unit::Second).unwrap_or(now).to_string(),
        by: concat!("host-cal ", env!("CARGO_PKG_VERSION")).to_owned(),
        verdict: Some(verdict),
        reasons: assessment.reasons.clone(),
        from_robot: robot.source.clone(),
        from_poses: dataset.files.clone(),
        poses: dataset.rows.len(),
        free_parameters: if is_unchanged { 0 } else { fit.free_parameters() },
        rms_initial_mm: mm_from_m(fit.initial.rms_m),
        rms_mm: mm_from_m(kept.rms_m),
        held_out_rms_mm: fit.cross_validation.filter(|_| !is_unchanged).map(|proof| mm_from_m(proof.rms_m)),
    };
    Some((chain, calibration))
}
