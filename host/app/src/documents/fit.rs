//! A fit in numbers and sentences.

use ballbar_calib::assess::{Answer, Assessment, Refusal};
use ballbar_calib::identify::{
    ConvergenceTest, Fit, FitRemark, FittedParameter, Outlier, OutlierTest, PairingResiduals, Status, WrongRow, explanation,
    remarks,
};
use ballbar_calib::model::{Dataset, Rig, Robot};
use serde::Serialize;

use super::lines::{HeldOutRows, NotIdentified, PairingLine, ResidualLine, largest};
use super::unknowns::UnknownsDocument;
use crate::units::{ScreenUnit, mm_from_m};

/// A fit, in the units of the screen.
#[derive(Clone, Debug, Serialize)]
pub struct FitDocument {
    /// Name of the robot.
    pub robot: String,
    /// How the solve ended, in a word.
    pub status: &'static str,
    /// The test that a converged solve met.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub test: Option<&'static str>,
    /// What that means.
    pub explanation: &'static str,
    /// Parameters that the poses can tell.
    pub rank: usize,
    /// Parameters of the robot.
    pub parameters_total: usize,
    /// The most that can be independent.
    pub independent_expected: usize,
    /// Parameters that were fitted.
    pub free_parameters: usize,
    /// Steps from the start to the end.
    pub iterations: usize,
    /// Poses that were fitted.
    pub poses: usize,
    /// RMS residual of the design.
    pub rms_initial_mm: f64,
    /// RMS residual of the fit.
    pub rms_mm: f64,
    /// The same after each step.
    pub rms_history_mm: Vec<f64>,
    /// Proof on poses left out, fold by fold.
    pub held_out: Option<FoldsLine>,
    /// Poses that were held out, which the fit has not seen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out_rows: Option<HeldOutRows>,
    /// Of the free columns, scaled; null when they are dependent.
    pub condition: f64,
    /// Estimated standard deviation of one length.
    pub sigma_mm: Option<f64>,
    /// How long the solve took.
    pub solve_ms: f64,
    /// Of residuals with the next ones measured; near 0 when they are independent.
    pub neighbour_correlation: Option<f64>,
    /// All parameters.
    pub parameters: Vec<ParameterLine>,
    /// Those that the poses do not tell.
    pub not_identified: Vec<NotIdentified>,
    /// Residuals by pairing.
    pub by_pairing: Vec<PairingChange>,
    /// Row numbers, from 1.
    pub outliers: Vec<usize>,
    /// The same rows, the worst first.
    pub outlier_details: Vec<OutlierLine>,
    /// Rows that were left out of the fit, because they contradict the others.
    pub left_out: Vec<LeftOutLine>,
    /// Why they were, as far as that can be seen; a clause each, what explains the most rows first.
    pub causes: Vec<String>,
    /// What the tolerances of the robot's file had to say; none where they were not asked.
    pub prior: Option<PriorLine>,
    /// The largest residuals.
    pub largest: Vec<ResidualLine>,
    /// Kinds of unknowns that were taken in, and that would explain what is left.
    pub unknowns: UnknownsDocument,
    /// What to know of the poses, a sentence each.
    pub remarks: Vec<String>,
    /// Rows that may be mistakes, a sentence each.
    pub warnings: Vec<String>,
    /// The file that was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub out: Option<String>,
    /// `calibrated`, `unchanged`, `reserved` or `not_trusted`.
    pub verdict: &'static str,
    /// Why it is no better.
    pub reasons: Vec<String>,
    /// The reasons in one, where the result is not to be kept; nothing was written then.
    pub objection: Option<String>,
    /// The verdict.
    #[serde(skip)]
    pub answer: Answer,
    /// Whether it is the limit of the RMS residual that is in the way.
    #[serde(skip)]
    pub can_be_raised: bool,
}

/// Residuals of poses by fits that had not seen them.
#[derive(Clone, Debug, Serialize)]
pub struct FoldsLine {
    /// How many fits.
    pub folds: usize,
    /// Root of the mean square.
    pub rms_mm: f64,
}

/// A parameter before and after, in the units of the screen.
#[derive(Clone, Debug, Serialize)]
pub struct ParameterLine {
    /// Its name.
    pub name: String,
    /// Unit of the values.
    pub unit: &'static str,
    /// Of the design.
    pub initial: f64,
    /// Of the fit.
    #[serde(rename = "final")]
    pub fitted: f64,
    /// From the one to the other.
    pub change: f64,
    /// Standard deviation of the fitted value.
    pub std: Option<f64>,
    /// Whether it was left as it was.
    pub held: bool,
    /// Why it was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
}

/// Residuals of one pairing, before and after.
#[derive(Clone, Debug, Serialize)]
pub struct PairingChange {
    /// RMS of the design.
    pub initial_rms_mm: f64,
    /// Of the fit.
    #[serde(flatten)]
    pub fitted: PairingLine,
}

/// A row that stands out.
#[derive(Clone, Debug, Serialize)]
pub struct OutlierLine {
    /// From 1, over all files.
    pub row: usize,
    /// File and line.
    pub place: String,
    /// Measured less computed.
    pub residual_mm: f64,
    /// Robust standard deviations from the median.
    pub score: f64,
    /// `all` rows, or its `neighbours` in the order of measurement.
    pub beside: &'static str,
}

/// A row that was left out.
#[derive(Clone, Debug, Serialize)]
pub struct LeftOutLine {
    /// From 1, over all files.
    pub row: usize,
    /// File and line.
    pub place: String,
    /// Measured less computed.
    pub residual_mm: f64,
    /// The same in standard deviations of a good row.
    pub deviations: f64,
}

/// What tolerances had to say.
#[derive(Clone, Debug, Serialize)]
pub struct PriorLine {
    /// By which those inside the arm were multiplied.
    pub factor: f64,
    /// Unknowns that the lengths decided, of those that are free.
    pub told: f64,
    /// Parts that were fitted as if nothing had been known of them.
    pub released: Vec<String>,
}

/// What a document of a fit is made of.
#[derive(Clone, Copy, Debug)]
pub struct Fitted<'a> {
    /// The design.
    pub robot: &'a Robot,
    /// The rig.
    pub rig: &'a Rig,
    /// Poses that were fitted.
    pub dataset: &'a Dataset,
    /// Poses that were not, and what they were held out by.
    pub held_out: Option<(&'a str, &'a Dataset)>,
    /// Rows that may be mistakes, in words.
    pub warnings: &'a [String],
    /// The fit.
    pub fit: &'a Fit,
    /// What is thought of it.
    pub assessment: &'a Assessment,
    /// What else may be unknown.
    pub unknowns: &'a UnknownsDocument,
}

impl FitDocument {
    /// Of a fit that was not written.
    pub fn new(fitted: &Fitted<'_>) -> Self {
        let Fitted { robot, rig, dataset, held_out, warnings, fit, assessment, unknowns } = *fitted;
        let held_out_rows = held_out.map(|(rule, rows)| HeldOutRows::new(rule, rows, robot, fit));
        let test = match fit.solution.status {
            Status::Converged(ConvergenceTest::Gradient) => Some("gradient"),
            Status::Converged(ConvergenceTest::Cost) => Some("cost"),
            Status::Converged(ConvergenceTest::Step) => Some("step"),
            _ => None,
        };
        let outlier_details = outlier_lines(dataset, fit);
        Self {
            robot: robot.name.clone(),
            status: fit.solution.status.name(),
            test,
            explanation: explanation(fit.solution.status),
            rank: fit.identifiability.spectrum.rank,
            parameters_total: fit.parameters.len(),
            independent_expected: fit.unknowns.independent(),
            free_parameters: fit.free_parameters(),
            iterations: fit.solution.steps(),
            poses: dataset.rows.len(),
            rms_initial_mm: mm_from_m(fit.initial.rms_m),
            rms_mm: mm_from_m(fit.fitted.rms_m),
            rms_history_mm: fit.solution.rms_history_m.iter().map(|&rms| mm_from_m(rms)).collect(),
            held_out: fit.cross_validation.map(|proof| FoldsLine { folds: proof.folds, rms_mm: mm_from_m(proof.rms_m) }),
            condition: fit.uncertainty.spectrum.condition(),
            sigma_mm: fit.uncertainty.sigma_m.map(mm_from_m),
            solve_ms: fit.solve_time.as_secs_f64() * 1e3,
            neighbour_correlation: fit.neighbour_correlation,
            parameters: fit.parameters.iter().map(ParameterLine::new).collect(),
            not_identified: NotIdentified::all(&fit.identifiability),
            by_pairing: pairing_changes(rig, fit),
            outliers: outlier_details.iter().map(|outlier| outlier.row).collect(),
            outlier_details,
            left_out: left_out_lines(dataset, fit),
            causes: assessment.causes.iter().map(|cause| cause.to_string()).collect(),
            prior: fit.prior.as_ref().map(|prior| PriorLine {
                factor: prior.factor,
                told: fit.uncertainty.told,
                released: prior.released.iter().map(|released| released.part.to_string()).collect(),
            }),
            largest: largest(dataset, rig, &fit.residuals, 5),
            unknowns: unknowns.clone(),
            remarks: remarks(&robot.chain, dataset, rig, &robot.limits)
                .into_iter()
                .chain(fit.remarks().iter().map(|remark| remark_text(remark, dataset)))
                .collect(),
            warnings: warnings.to_vec(),
            out: None,
            verdict: assessment.answer.name(),
            reasons: assessment.reasons.clone(),
            objection: (assessment.answer == Answer::NotTrusted).then(|| assessment.reasons.join(" ")),
            answer: assessment.answer,
            can_be_raised: assessment.refusals.iter().any(|refusal| matches!(refusal, Refusal::TooLarge { .. })),
            held_out_rows,
        }
    }
}

impl ParameterLine {
    fn new(parameter: &FittedParameter) -> Self {
        let unit = ScreenUnit::from(parameter.unit);
        let (initial, fitted) = (unit.from_si(parameter.initial), unit.from_si(parameter.fitted));
        Self {
            name: parameter.name.clone(),
            unit: unit.name(),
            initial,
            fitted,
            change: unit.from_si(parameter.fitted - parameter.initial),
            std: parameter.std.map(|std| unit.from_si(std)),
            held: parameter.held.is_some(),
            why: parameter.held.as_ref().map(|held| held.to_string()),
        }
    }
}

fn remark_text(remark: &FitRemark, dataset: &Dataset) -> String {
    match *remark {
        FitRemark::LeftOut { count, worst_row, worst_m } => format!(
            "{} left out (list at the end), the worst at {} with {:.3} mm: {} the others.",
            if count == 1 { "1 row was".to_owned() } else { format!("{count} rows were") },
            dataset.place(worst_row),
            mm_from_m(worst_m),
            if count == 1 { "it contradicts" } else { "they contradict" }
        ),
        FitRemark::Outliers { count, worst_row, worst_m } => format!(
            "{} stand out (list at the end), the worst at {} with {:.3} mm. They weigh on all numbers here: look at them first.",
            if count == 1 { "1 row".to_owned() } else { format!("{count} rows") },
            dataset.place(worst_row),
            mm_from_m(worst_m)
        ),
        FitRemark::Drift { correlation } => format!(
            "Residuals follow one another in the order of measurement (correlation {correlation:.2}): something drifts or jumps that the model \
             does not hold, such as the zero of the bar. Deviations below are too small then."
        ),
    }
}

fn pairing_changes(rig: &Rig, fit: &Fit) -> Vec<PairingChange> {
    let pairs = fit.initial_by_pairing.iter().zip(&fit.fitted_by_pairing);
    let change = |(initial, fitted): (&PairingResiduals, _)| PairingChange {
        initial_rms_mm: mm_from_m(initial.summary.rms_m),
        fitted: PairingLine::new(rig, fitted),
    };
    pairs.map(change).collect()
}

fn left_out_lines(dataset: &Dataset, fit: &Fit) -> Vec<LeftOutLine> {
    let line = |wrong: &WrongRow| LeftOutLine {
        row: dataset.rows[wrong.row].number,
        place: dataset.place(wrong.row),
        residual_mm: mm_from_m(wrong.residual_m),
        deviations: wrong.deviations,
    };
    fit.wrong_rows.iter().map(line).collect()
}

fn outlier_lines(dataset: &Dataset, fit: &Fit) -> Vec<OutlierLine> {
    let line = |outlier: &Outlier| OutlierLine {
        row: dataset.rows[outlier.row].number,
        place: dataset.place(outlier.row),
        residual_mm: mm_from_m(fit.residuals[outlier.row].value_m),
        score: outlier.score,
        beside: match outlier.test {
            OutlierTest::All => "all",
            OutlierTest::Neighbours => "neighbours",
        },
    };
    fit.outliers.iter().map(line).collect()
}
