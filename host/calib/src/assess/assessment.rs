//! The answer, and its grounds in whole sentences.

use super::by_group::{GroupProofs, by_group};
use super::causes::{Cause, CauseKind, FittedRows, causes};
use super::evidence::Evidence;
use super::order::{Order, by_pairing, offset, trend};
use super::plausibility::large_changes_of;
use super::proof::{Proof, decisive, proofs};
use super::reach::narrow_joints;
use super::refusals::{Judged, Refusal, RmsLimit, judge};
use super::reservations::{Grounds, reservations, sentence};
use super::suspicion::{Suspicion, suspect, suspect_moved};
use crate::identify::{AndersonDarling, Offset, Residual, Trend, anderson_darling, residuals};
use crate::model::Robot;

/// What the result is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Answer {
    /// Lengths left out of the fit are predicted better than by the design, and nothing stands against it.
    Calibrated,
    /// The robot's file predicts the lengths as well as a fit to them does: its parameters stay as they are.
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

/// The answer and all that it rests on.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Assessment {
    /// What the result is called.
    pub answer: Answer,
    /// Why it is not something better, in whole sentences; none for [`Answer::Calibrated`]. For [`Answer::NotTrusted`] the last one
    /// says what may be wrong with the measurements, as far as that can be seen.
    pub reasons: Vec<String>,
    /// What speaks against the fit; none but for [`Answer::NotTrusted`].
    pub refusals: Vec<Refusal>,
    /// The mistake that would explain lengths that do not fit.
    pub suspicion: Option<Suspicion>,
    /// Why rows were left out, what explains the most of them first; none where none was.
    pub causes: Vec<Cause>,
    /// How large an RMS residual was believed.
    pub rms_limit: RmsLimit,
    /// What the fit has not seen: files and poses held out, its own poses left out in turn, then other lengths of fitted postures.
    pub proofs: Vec<Proof>,
    /// How well bars, sets, files, pairings and what was measured in one go are predicted by the others, as far as there are several of a kind.
    pub by_group: Vec<GroupProofs>,
    /// The order of measurement.
    pub order: Order,
    /// Residuals with the fit by pairing, in the order of `Dataset::pairings`.
    pub by_pairing: Vec<Vec<Residual>>,
    /// How they change from the first length to the last, apart from what each pairing is off by; `None` where the poses do not tell.
    pub trend: Option<Trend>,
    /// The pairing whose mean residual is the farthest from zero; `None` where the fit leaves no scatter to judge by.
    pub farthest_offset: Option<Offset>,
    /// Whether the whitened residuals look normal; `None` for too few.
    pub normality: Option<AndersonDarling>,
}

impl Assessment {
    /// Judges a fit. [`Answer::Calibrated`] and [`Answer::Reserved`] can be used, [`Answer::Unchanged`] says to keep what there is.
    ///
    /// ```
    /// use ballbar_calib::assess::{Answer, Assessment, Evidence};
    /// use ballbar_calib::designs;
    /// use ballbar_calib::identify::{FitOptions, fit};
    /// use ballbar_calib::model::Dataset;
    /// use ballbar_calib::simulate::Shells;
    ///
    /// let (design, rig) = (designs::puma560(), designs::triangles());
    /// let mut truth = design.clone();
    /// truth.chain.parameters_mut()[16] += 0.002; // x3
    /// let pairings = rig.all_pairings();
    /// let shells = Shells {
    ///     planned_with: &design, truth: &truth, rig: &rig, pairings: &pairings, bar_m: 0.46, per_pairing: 20, sigma_m: 50e-6, seed: 1,
    /// };
    /// let poses = Dataset::new("simulated", shells.simulate(|| ())?.into_iter().map(|pose| pose.row).collect())?;
    /// let fit = fit(&design, &poses, &FitOptions::default())?;
    ///
    /// let assessment = Assessment::new(&Evidence::new(&design, &rig, &poses, &fit));
    /// assert_eq!(assessment.answer, Answer::Calibrated, "{:?}", assessment.reasons);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Panics
    /// When the evidence does not belong together: a fit to other rows, or rows of another rig.
    pub fn new(evidence: &Evidence<'_>) -> Self {
        let Evidence { robot, dataset, fit, .. } = evidence;
        let order = Order::new(&dataset.rows.iter().map(|row| row.t_s).collect::<Vec<_>>());
        let placed = by_pairing(evidence, &order);
        let counting = fit.residuals.iter().filter(|residual| residual.weight > 0.0);
        let whitened_m: Vec<f64> = counting.map(|residual| residual.whitened_m()).collect();
        let rms_limit = RmsLimit::new(dataset, evidence.max_rms_m);
        let before = fit.counted(residuals(&robot.kinematics(), dataset));
        let mut assessment = Self {
            answer: Answer::NotTrusted,
            reasons: Vec::new(),
            refusals: Vec::new(),
            suspicion: None,
            causes: causes_of(evidence),
            rms_limit,
            by_group: by_group(evidence, &before),
            proofs: proofs(evidence, before),
            trend: trend(evidence, &placed),
            farthest_offset: offset(evidence, &placed),
            by_pairing: placed.into_iter().map(|group| group.into_iter().map(|(_, residual)| residual).collect()).collect(),
            normality: anderson_darling(&whitened_m),
            order,
        };
        let (judged, mistake) = match judge(evidence, rms_limit, &assessment.proofs, &assessment.by_group) {
            Judged::Better => match suspect_moved(evidence) {
                Some(mistake) => {
                    let changes = large_changes_of(&robot.chain, fit);
                    (Judged::Refused(vec![Refusal::Mistaken(changes)]), Some(mistake))
                }
                None => (Judged::Better, None),
            },
            other => (other, None),
        };
        match judged {
            Judged::Refused(refusals) => {
                assessment.suspicion = mistake.or_else(|| suspect(evidence, &refusals));
                assessment.reasons.extend(refusals.iter().map(Refusal::to_string));
                let first = assessment.suspicion.as_ref().map(Suspicion::to_string);
                let cause = first.or_else(|| assessment.likeliest_cause());
                assessment.reasons.extend(cause.or_else(|| narrow_joints(robot, dataset)));
                assessment.refusals = refusals;
            }
            Judged::NothingToCorrect => {
                assessment.answer = Answer::Unchanged;
                assessment.reasons = reservations(evidence, &assessment.grounds());
            }
            Judged::Better => {
                assessment.reasons = reservations(evidence, &assessment.grounds());
                assessment.answer = if assessment.reasons.is_empty() { Answer::Calibrated } else { Answer::Reserved };
            }
        }
        assessment
    }

    /// What made the most rows wrong, in a whole sentence.
    fn likeliest_cause(&self) -> Option<String> {
        let cause = self.causes.iter().find(|cause| cause.kind != CauseKind::Unknown)?;
        Some(sentence(&format!("Look at this first: {cause}")))
    }

    fn grounds(&self) -> Grounds<'_> {
        let Self { causes, proofs, by_group, trend, farthest_offset, normality, .. } = self;
        let is_unchanged = self.answer == Answer::Unchanged;
        let (trend, farthest_offset, normality) = (*trend, *farthest_offset, *normality);
        Grounds { is_unchanged, causes, proofs, by_group, trend, farthest_offset, normality }
    }

    /// The proof that says the least good of the fit: the one to go by.
    pub fn decisive_proof(&self) -> Option<&Proof> {
        decisive(&self.proofs)
    }
}

/// The causes of rows that a fit has left out.
fn causes_of(evidence: &Evidence<'_>) -> Vec<Cause> {
    let Evidence { robot, rig, dataset, fit, .. } = *evidence;
    let Some(sigma_m) = fit.uncertainty.sigma_m.filter(|&sigma_m| sigma_m > 0.0 && !fit.wrong_rows.is_empty()) else {
        return Vec::new();
    };
    let found = Robot { chain: fit.solution.chain.clone(), terms: fit.terms(robot), ..robot.clone() };
    let weights = dataset.rows.iter().map(|row| row.measurement.weight);
    let residuals: Vec<Residual> =
        fit.residuals.iter().zip(weights).map(|(residual, weight)| Residual { weight, ..*residual }).collect();
    let rig = fit.rig(rig);
    causes(&FittedRows { robot: &found, rig: &rig, dataset, residuals: &residuals, sigma_m }, &fit.wrong_rows)
}
