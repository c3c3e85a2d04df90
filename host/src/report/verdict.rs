//! The answer of the first screen: what the result is called, with what reserve, and what it does not say.

use super::facts::Facts;
use super::proof::ProofKind;
use crate::units::{fixed, mm_from_m};

/// What the result is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Lengths left out of the fit are predicted better than by the design, and nothing stands against it.
    Calibrated,
    /// The design was at the minimum already.
    Unchanged,
    /// Better than the design, but something in the measurements weighs on the numbers.
    Reserved,
    /// Not to be used.
    NotTrusted,
}

impl Answer {
    /// For people.
    pub fn words(self) -> &'static str {
        match self {
            Self::Calibrated => "Calibrated",
            Self::Unchanged => "Nothing to correct",
            Self::Reserved => "Better than its design, with reservations",
            Self::NotTrusted => "Not to be trusted as it is",
        }
    }

    /// For machines: `calibrated`, `unchanged`, `reserved`, `not_trusted`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Calibrated => "calibrated",
            Self::Unchanged => "unchanged",
            Self::Reserved => "reserved",
            Self::NotTrusted => "not_trusted",
        }
    }
}

/// The answer and its grounds, in whole sentences.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// What the result is called.
    pub answer: Answer,
    /// Why not something better; none for [`Answer::Calibrated`].
    pub reasons: Vec<String>,
    /// What nobody may conclude from the page.
    pub not_said: Vec<String>,
}

/// Neighbours in the order of measurement that are alike beyond this correlation drift together.
pub(super) const ALIKE: f64 = 0.5;
/// Lengths left out may be predicted by this factor worse than those fitted before it is said.
const MUCH_WORSE: f64 = 2.0;
/// Of normal residuals one set in a thousand looks less normal.
const SURELY_NOT: f64 = 1e-3;
/// Files of poses end at a nanometre: residuals below a micrometre are of simulations without noise, and compare with nothing.
const ROUNDING_M: f64 = 1e-6;

impl Verdict {
    pub(super) fn new(facts: &Facts) -> Self {
        let against: Vec<String> = against(facts).collect();
        let reserves = reserves(facts);
        let (answer, reasons) = if !against.is_empty() {
            (Answer::NotTrusted, against)
        } else if facts.is_unchanged {
            (Answer::Unchanged, reserves)
        } else if reserves.is_empty() {
            (Answer::Calibrated, reserves)
        } else {
            (Answer::Reserved, reserves)
        };
        Self { answer, reasons, not_said: not_said(facts) }
    }
}

/// The fit's own objection, and proofs that speak against it.
fn against(facts: &Facts) -> impl Iterator<Item = String> + '_ {
    let objection = facts.objection.iter().map(|objection| sentence(objection));
    let proofs = facts.proofs.iter().filter(|proof| proof.speaks_against());
    objection.chain(proofs.map(|proof| format!("The design predicts better than the fit on {}.", proof.name)))
}

fn reserves(facts: &Facts) -> Vec<String> {
    let mut reserves = Vec::new();
    if let Some(when) = &facts.calibrated {
        reserves.push(format!(
            "The robot's file was calibrated already ({when}): \"before\" is that calibration and no design, and if it was fitted to these \
             poses, neither number proves anything."
        ));
    }
    let (told, independent, able) = (facts.told, facts.independent, facts.singular.rank);
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
    match facts.outliers.as_slice() {
        [] => {}
        [only] => reserves.push(format!("1 length stands out and weighs on all numbers: {}.", facts.rows[only.row].place)),
        [worst, ..] => reserves.push(format!(
            "{} lengths stand out and weigh on all numbers, most of all {}.",
            facts.outliers.len(),
            facts.rows[worst.row].place
        )),
    }
    if let Some(correlation) = facts.neighbour_correlation.filter(|&correlation| correlation > ALIKE) {
        reserves.push(format!(
            "Residuals follow one another in the order of measurement (correlation {correlation:.2}): something drifts, such as the zero \
             of the bar, or the robot does what the model does not hold; all deviations on this page are too small."
        ));
    }
    if let Some(trend) = facts.trend().filter(|trend| trend.is_significant()) {
        reserves.push(format!(
            "From the first length to the last the residuals change by {} mm, {:.1} standard errors: something drifts.",
            fixed(mm_from_m(trend.change_m), 3),
            trend.errors()
        ));
    }
    if let Some(offset) = facts.farthest_offset().filter(|offset| offset.is_beyond_chance) {
        reserves.push(format!(
            "The lengths of {} are off by {} mm on average, more than chance gives: its chuck or sphere is not where the rig's file says, \
             or something drifted meanwhile.",
            facts.pairings[offset.group].0,
            fixed(mm_from_m(offset.mean_m), 3)
        ));
    }
    if let Some(normality) = facts.normality.filter(|normality| normality.p_value < SURELY_NOT) {
        reserves.push(format!(
            "Residuals do not look like noise (Anderson-Darling, p = {:.1e}): the robot or the bar does something that the model does not \
             hold.",
            normality.p_value
        ));
    }
    for proof in facts.proofs.iter().filter(|proof| !facts.is_unchanged && !proof.speaks_against() && !proof.speaks_for()) {
        reserves.push(format!(
            "On {}, {} postures are too few, or the difference too small, to say that the fit predicts better than the design.",
            proof.name,
            proof.posture_count()
        ));
    }
    if let Some(proof) = facts.decisive_proof() {
        let factor = proof.after_summary().rms_m / facts.after.rms_m.max(f64::MIN_POSITIVE);
        if factor > MUCH_WORSE && proof.after_summary().rms_m > ROUNDING_M && !facts.is_unchanged {
            reserves.push(format!(
                "Lengths not seen are predicted {factor:.1} times worse than those fitted, on {}: the poses are few or alike for so many \
                 parameters. Trust the larger number.",
                proof.name
            ));
        }
    }
    reserves
}

fn not_said(facts: &Facts) -> Vec<String> {
    let mut not_said = Vec::new();
    if !facts.proofs.iter().any(|proof| proof.kind == ProofKind::Apart) {
        not_said.push(
            "That other lengths were tried: the proof is by parts of the same poses, left out in turn. Poses of another day or bar \
             (--validate) are a better one."
                .to_owned(),
        );
    }
    not_said.push(
        "That lengths and places are true: an error common to all lengths (the bar's zero and scale) or of the coordinates in the \
         rig's file goes into the parameters and shows in no residual."
            .to_owned(),
    );
    not_said.push(
        "How the robot does under another load or temperature, how well it repeats, and for how long the result holds."
            .to_owned(),
    );
    not_said
}

fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|first| first.to_uppercase().to_string()).unwrap_or_default();
    let end = if text.ends_with('.') { "" } else { "." };
    format!("{first}{}{end}", letters.as_str())
}
