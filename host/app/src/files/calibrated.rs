//! What a robot's file says of the fit that its parameters come from.

use ballbar::Chain;
use ballbar_calib::assess::{Answer, Assessment, Evidence};
use ballbar_calib::model::{Calibration, CalibrationVerdict};
use ballbar_calib::units::mm_from_m;

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
