//! What weighs on the numbers of a fit that is worth keeping, in whole sentences.

use super::by_group::{GroupProofs, unlike};
use super::causes::Cause;
use super::evidence::Evidence;
use super::plausibility::{Change, far_beyond_limits, large_changes_of};
use super::proof::{Proof, decisive};
use super::reach::narrow_joints;
use super::refusals::moved;
use ballbar::JointKind;

use crate::identify::{ALIKE, AndersonDarling, Fit, Offset, Part, Released, Trend};
use crate::units::{fixed, mm_from_m};

/// Lengths left out may be predicted by this factor worse than those fitted before it is said.
const MUCH_WORSE: f64 = 2.0;
/// Of normal residuals one set in a thousand looks less normal.
const SURELY_NOT: f64 = 1e-3;
/// More rows than this that had to be left out say something of those that were not.
const MANY_WRONG: f64 = 0.05;
/// Unknowns of which the lengths decide a smaller part lean on what was believed beforehand.
const MOSTLY_TOLD: f64 = 0.9;
/// Files of poses end at a nanometre: residuals below a micrometre are of simulations without noise, and compare with nothing.
const ROUNDING_M: f64 = 1e-6;

/// What was found of a fit that is worth keeping.
pub(super) struct Grounds<'a> {
    /// The parameters stay as they are.
    pub(super) is_unchanged: bool,
    pub(super) causes: &'a [Cause],
    pub(super) proofs: &'a [Proof],
    pub(super) by_group: &'a [GroupProofs],
    pub(super) trend: Option<Trend>,
    pub(super) farthest_offset: Option<Offset>,
    pub(super) normality: Option<AndersonDarling>,
}

/// All of them; none where nothing stands against the numbers.
pub(super) fn reservations(evidence: &Evidence<'_>, grounds: &Grounds<'_>) -> Vec<String> {
    let Evidence { robot, rig, dataset, fit, .. } = evidence;
    let is_unchanged = grounds.is_unchanged;
    let mut reserves = Vec::new();
    if is_unchanged {
        reserves.push(format!(
            "{} predicts these lengths as well as a fit to them does (RMS {} mm): what a fit would change is noise, and the parameters stay as \
             they are.",
            robot.source.as_str(),
            fixed(mm_from_m(fit.initial.rms_m), 3)
        ));
    }
    if let Some(calibration) = &robot.calibration {
        let when = &calibration.when;
        reserves.push(format!(
            "The robot's file was calibrated already ({when}): \"before\" is that calibration and no design, and if it was fitted to these \
             poses, neither number proves anything."
        ));
    }
    let (told, able) = (fit.uncertainty.spectrum.rank, fit.identifiability.spectrum.rank);
    let independent = fit.unknowns.independent();
    if able < independent {
        reserves.push(format!(
            "These poses tell {able} of the {independent} parameters that lengths can tell of this robot: where the others matter, \
             the tool may be as wrong as before."
        ));
    } else if told < independent {
        reserves.push(format!(
            "Of {independent} parameters that these poses tell, {told} were fitted: the others were held, right or wrong."
        ));
    }
    let free = fit.free_parameters();
    if able == independent && fit.uncertainty.told < MOSTLY_TOLD * free as f64 {
        reserves.push(format!(
            "The lengths decide {} of {free} parameters; for the rest the result leans on the tolerances of the robot's file.",
            fixed(fit.uncertainty.told, 1)
        ));
    }
    let (wrong, of) = (fit.wrong_rows.len(), dataset.rows.len());
    if wrong as f64 > MANY_WRONG * of as f64 {
        let causes: Vec<String> = grounds.causes.iter().map(Cause::to_string).collect();
        reserves
            .push(sentence(&format!("{wrong} of {of} lengths contradict the others and were left out: {}", causes.join("; "))));
    }
    match fit.outliers.as_slice() {
        [] => {}
        [only] => reserves.push(format!("1 length stands out and weighs on all numbers: {}.", dataset.place(only.row))),
        [worst, ..] => reserves.push(format!(
            "{} lengths stand out and weigh on all numbers, most of all {}.",
            fit.outliers.len(),
            dataset.place(worst.row)
        )),
    }
    if let Some(correlation) = fit.neighbour_correlation.filter(|&correlation| correlation > ALIKE) {
        reserves.push(format!(
            "Residuals follow one another in the order of measurement (correlation {correlation:.2}): something drifts, such as the zero \
             of the bar, or the robot does what the model does not hold; all deviations are too small."
        ));
    }
    if let Some(trend) = grounds.trend.filter(|trend| trend.is_significant()) {
        reserves.push(format!(
            "From the first length to the last the residuals change by {} mm, {:.1} standard errors: something drifts.",
            fixed(mm_from_m(trend.change_m), 3),
            trend.errors()
        ));
    }
    if let Some(offset) = grounds.farthest_offset.filter(|offset| offset.is_beyond_chance) {
        reserves.push(format!(
            "The lengths of {} are off by {} mm on average, more than chance gives: its chuck or sphere is not where the rig's file says, \
             or something drifted meanwhile.",
            rig.pairing_name(dataset.pairings()[offset.group]),
            fixed(mm_from_m(offset.mean_m), 3)
        ));
    }
    if let Some(normality) = grounds.normality.filter(|normality| normality.p_value < SURELY_NOT) {
        reserves.push(format!(
            "Residuals do not look like noise (Anderson-Darling, p = {:.1e}): the robot or the bar does something that the model does not \
             hold.",
            normality.p_value
        ));
    }
    for proof in grounds.proofs.iter().filter(|proof| !is_unchanged && !proof.speaks_for()) {
        reserves.push(format!(
            "On {}, {} postures are too few, or the difference too small, to say that the fit predicts better than the design.",
            proof.name,
            proof.posture_count()
        ));
    }
    if let Some(proof) = decisive(grounds.proofs) {
        let factor = proof.after_summary().rms_m / fit.fitted.rms_m.max(f64::MIN_POSITIVE);
        if factor > MUCH_WORSE && proof.after_summary().rms_m > ROUNDING_M && !is_unchanged {
            reserves.push(format!(
                "Lengths not seen are predicted {factor:.1} times worse than those fitted, on {}: the poses are few or alike for so many \
                 parameters. Trust the larger number.",
                proof.name
            ));
        }
    }
    reserves.extend(unlike(grounds.by_group));
    reserves.extend(noise(evidence));
    reserves.extend(shared_errors(evidence));
    reserves.extend(narrow_joints(robot, dataset));
    reserves.extend(fit.prior.iter().flat_map(|prior| &prior.released).map(released));
    let mut far = large_changes_of(&robot.chain, fit);
    far.retain(|change| !is_released(change, fit));
    if !far.is_empty() && !is_unchanged {
        reserves.push(format!(
            "{}: far more than designs are off. Does the robot stand, and is its tool, as its file says?",
            moved(&far)
        ));
    }
    if let Some(beyond) = far_beyond_limits(robot, dataset) {
        reserves.push(format!(
            "{} of {} poses have joints far beyond their limits, the first at {}, joint {}.",
            beyond.rows,
            dataset.rows.len(),
            dataset.place(beyond.first),
            beyond.joint
        ));
    }
    reserves
}

/// Ended, where it is no question.
pub(super) fn sentence(text: &str) -> String {
    if text.ends_with('?') { text.to_owned() } else { format!("{text}.") }
}

/// Lengths that deviate otherwise than the poses state.
fn noise(evidence: &Evidence<'_>) -> Option<String> {
    let Evidence { dataset, fit, .. } = evidence;
    let (seen_m, stated_m) = (fit.uncertainty.sigma_m?, dataset.stated_sigma_m()?);
    let test = fit.uncertainty.noise_test(stated_m)?;
    let (factor, chi2, freedom) = (seen_m / stated_m, fixed(test.chi2, 0), fixed(test.freedom, 0));
    if test.is_more() {
        Some(format!(
            "Lengths scatter about the fit by {factor:.1} times the noise that the poses state (χ² of {chi2} for {freedom} degrees of freedom): \
             the model, the rig's coordinates or that noise is wrong."
        ))
    } else {
        test.is_less().then(|| {
            format!(
                "Lengths scatter about the fit by only {factor:.2} times the noise that the poses state (χ² of {chi2} for {freedom} degrees of \
                 freedom): that noise is wrong, or lengths are not as independent as they look."
            )
        })
    }
}

/// Errors of configurations that matter.
fn shared_errors(evidence: &Evidence<'_>) -> Option<String> {
    /// Deviations that are larger by less are as good as those of independent lengths.
    const MUCH: f64 = 1.25;
    let shared = evidence.fit.uncertainty.shared.filter(|shared| shared.are_certain() && shared.factor > MUCH)?;
    let kinds = evidence.robot.chain.joint_kinds();
    let size = if kinds.contains(&JointKind::Revolute) {
        format!("{}°", fixed(shared.joint.to_degrees(), 3))
    } else {
        format!("{} mm", fixed(mm_from_m(shared.joint), 3))
    };
    Some(format!(
        "Lengths of one configuration share an error, as joints make that stand {size} from where they say: parameters deviate {:.1} times more than by \
         independent lengths. More configurations help, more lengths in each do not.",
        shared.factor
    ))
}

/// A part that was fitted as if nothing had been known of it.
fn released(released: &Released) -> String {
    let Released { part, change, tolerance } = *released;
    let times = fixed(change.abs() / tolerance, 0);
    const OTHER: &str = "is this the design of another robot, or was a part changed?";
    let (millimetres, degrees) = (format!("{} mm", fixed(mm_from_m(change), 2)), fixed(change.to_degrees(), 2));
    let (size, cause) = match part {
        Part::Offset(_, JointKind::Revolute) => (format!("{:+.1}°", change.to_degrees()), "was its mastering lost?"),
        Part::Offset(_, JointKind::Prismatic) => (millimetres, "was its zero lost?"),
        Part::Displacement(1) => (millimetres, "does the robot stand where its file says?"),
        Part::Rotation(1) => (format!("{degrees}°"), "does the robot stand as its file says?"),
        Part::Displacement(_) => (millimetres, OTHER),
        Part::Rotation(_) => (format!("{degrees}°"), OTHER),
        Part::Scale(_) => (fixed(change, 5), "is its gear another one?"),
    };
    let part = part.to_string();
    let capital = part[..1].to_uppercase();
    format!("{capital}{} is off by {size}, {times} times its tolerance: {cause}", &part[1..])
}

/// Whether a change is one that was said of a part already.
fn is_released(change: &Change, fit: &Fit) -> bool {
    let parts = fit.prior.iter().flat_map(|prior| &prior.released);
    parts.into_iter().any(|released| released.part.to_string() == change.part)
}
