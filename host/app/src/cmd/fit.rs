//! `host-cal fit`: from measured poses to a calibrated robot.

use std::path::PathBuf;

use ballbar::Damping;
use ballbar_calib::assess::{Answer, Assessment, Evidence, Refusal};
use ballbar_calib::identify::{ALIKE, ConvergenceTest, Fit, FitOptions, FittedParameter, OutlierTest, Status, fit, remarks};
use ballbar_calib::model::{Dataset, Rig};
use clap::{Args, ValueEnum};
use serde::Serialize;

use super::hold::parse_hold;
use super::hold_out::HeldOutRows;
use super::inputs::{ForceArgs, Measured, MeasuredArgs, OutputArgs, check_max_rms_mm};
use super::lines::{NotIdentified, PairingLine, ResidualLine, largest, largest_text};
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print, write_calibrated};
use crate::remedies::Remedied;
use crate::terminal::table::{Columns, fixed};
use crate::text::one_line;
use crate::units::{ScreenUnit, m_from_mm, mm_from_m};

/// Identify the robot's parameters from measured poses
#[derive(Args)]
#[command(after_help = "Examples:
  host-cal fit --robot design.toml --rig rig.toml poses.csv --out calibrated.toml
  host-cal fit --robot puma560 --rig triangles poses.csv --hold paper --json

--hold takes a rule, parameter names, or both, separated by commas:
  auto    hold what these poses cannot tell (the default)
  paper   hold offset, z and alpha behind each joint, as the paper does
  none    hold nothing; redundant parameters then share their changes
  x1,...  hold just these, or these besides a rule: auto,scale3

The file is written only when the result can be believed: the fit reached a minimum, predicts poses
left out of it better than the design does by two standard errors, leaves an RMS that can be noise,
and changes nothing by more than robots differ from their designs. Otherwise the exit code is 1, and
what may be wrong with the poses is said. Where the robot's file is as good as a fit, its parameters
stay as they are, and are written.")]
pub(super) struct FitArgs {
    #[command(flatten)]
    measured: MeasuredArgs,
    /// Parameters to leave at their design values: auto, paper, none, and names
    #[arg(long, default_value = "auto", value_name = "RULE|NAME,…")]
    hold: String,
    /// What damps the steps: the identity as in the paper, or the diagonal of the normal matrix
    #[arg(long, value_enum, default_value_t = DampingArg::Identity)]
    damping: DampingArg,
    /// The largest RMS residual that is believed [default: ten times the poses' sigma_mm, or 1 where they have none]
    #[arg(long, value_name = "MM", allow_hyphen_values = true)]
    max_rms_mm: Option<f64>,
    /// Write the calibrated robot to this file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    replace: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Clone, Copy, ValueEnum)]
enum DampingArg {
    Identity,
    Diagonal,
}

/// What `fit --json` prints.
#[derive(Serialize)]
pub(super) struct FitReport {
    robot: String,
    status: &'static str,
    /// The test that a converged solve met.
    #[serde(skip_serializing_if = "Option::is_none")]
    test: Option<&'static str>,
    explanation: &'static str,
    rank: usize,
    parameters_total: usize,
    independent_expected: usize,
    free_parameters: usize,
    /// Steps from the start to the end.
    iterations: usize,
    poses: usize,
    rms_initial_mm: f64,
    rms_mm: f64,
    rms_history_mm: Vec<f64>,
    held_out: Option<HeldOut>,
    /// Poses of --hold-out, which the fit has not seen.
    #[serde(skip_serializing_if = "Option::is_none")]
    held_out_rows: Option<HeldOutRows>,
    /// Of the free columns, scaled; null when they are dependent.
    condition: f64,
    /// Estimated standard deviation of one length.
    sigma_mm: Option<f64>,
    solve_ms: f64,
    /// Of residuals with the next ones measured; near 0 when they are independent.
    neighbour_correlation: Option<f64>,
    parameters: Vec<ParameterLine>,
    not_identified: Vec<NotIdentified>,
    by_pairing: Vec<PairingChange>,
    /// Row numbers, from 1.
    outliers: Vec<usize>,
    outlier_details: Vec<OutlierLine>,
    largest: Vec<ResidualLine>,
    remarks: Vec<String>,
    warnings: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    out: Option<String>,
    /// `calibrated`, `unchanged`, `reserved` or `not_trusted`, as of `report`.
    verdict: &'static str,
    /// Why it is no better.
    reasons: Vec<String>,
    /// The reasons in one, where the result is not to be kept; nothing was written then.
    objection: Option<String>,
    #[serde(skip)]
    answer: Answer,
    #[serde(skip)]
    can_be_raised: bool,
    #[serde(skip)]
    asked_out: Option<String>,
}

#[derive(Serialize)]
struct HeldOut {
    folds: usize,
    rms_mm: f64,
}

#[derive(Serialize)]
struct ParameterLine {
    name: String,
    unit: &'static str,
    initial: f64,
    #[serde(rename = "final")]
    fitted: f64,
    change: f64,
    std: Option<f64>,
    held: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    why: Option<String>,
}

#[derive(Serialize)]
struct PairingChange {
    initial_rms_mm: f64,
    #[serde(flatten)]
    fitted: PairingLine,
}

#[derive(Serialize)]
struct OutlierLine {
    row: usize,
    place: String,
    residual_mm: f64,
    /// Robust standard deviations from the median.
    score: f64,
    /// `all` rows, or its `neighbours` in the order of measurement.
    beside: &'static str,
}

impl FitArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let hold = parse_hold(&self.hold)?;
        let damping = match self.damping {
            DampingArg::Identity => Damping::Identity,
            DampingArg::Diagonal => Damping::Diagonal,
        };
        check_max_rms_mm(self.max_rms_mm)?;
        let measured = self.measured.read()?;
        let Measured { robot, rig, dataset, .. } = &measured;
        let fit = fit(robot, dataset, &FitOptions { hold, damping }).map_err(Remedied)?;
        let unseen: Vec<(String, &Dataset)> = measured.unseen().into_iter().collect();
        let evidence = Evidence { robot, rig, dataset, fit: &fit, unseen: &unseen, max_rms_m: self.max_rms_mm.map(m_from_mm) };
        let assessment = Assessment::new(&evidence);

        let mut report = FitReport::new(&measured, &fit, &assessment);
        if let Some(path) = &self.out {
            report.asked_out = Some(path.display().to_string());
            if write_calibrated(path, self.replace.force, &measured.robot_source, &evidence, &assessment)? {
                report.out = report.asked_out.clone();
            }
        }
        print(&report, self.output.json)?;
        Ok(if report.answer == Answer::NotTrusted { Outcome::Doubtful } else { Outcome::Good })
    }
}

impl FitReport {
    fn new(measured: &Measured, fit: &Fit, assessment: &Assessment) -> Self {
        let Measured { robot, rig, dataset, held_out, warnings, .. } = measured;
        let held_out_rows = held_out.as_ref().map(|(rule, rows)| HeldOutRows::new(rule, rows, robot, &fit.solution.chain));
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
            explanation: fit.solution.status.explanation(),
            rank: fit.identifiability.spectrum.rank,
            parameters_total: fit.parameters.len(),
            independent_expected: robot.chain.independent_parameters(),
            free_parameters: fit.free_parameters(),
            iterations: fit.solution.steps(),
            poses: dataset.rows.len(),
            rms_initial_mm: mm_from_m(fit.initial.rms_m),
            rms_mm: mm_from_m(fit.fitted.rms_m),
            rms_history_mm: fit.solution.rms_history_m.iter().map(|&rms| mm_from_m(rms)).collect(),
            held_out: fit.cross_validation.map(|proof| HeldOut { folds: proof.folds, rms_mm: mm_from_m(proof.rms_m) }),
            condition: fit.uncertainty.spectrum.condition(),
            sigma_mm: fit.uncertainty.sigma_m.map(mm_from_m),
            solve_ms: fit.solve_time.as_secs_f64() * 1e3,
            neighbour_correlation: fit.neighbour_correlation,
            parameters: fit.parameters.iter().map(ParameterLine::new).collect(),
            not_identified: NotIdentified::all(&fit.identifiability),
            by_pairing: pairing_changes(rig, fit),
            outliers: outlier_details.iter().map(|outlier| outlier.row).collect(),
            outlier_details,
            largest: largest(dataset, rig, &fit.residuals, 5),
            remarks: remarks(&robot.chain, dataset, rig, &robot.limits)
                .into_iter()
                .chain(outlier_remark(dataset, fit))
                .chain(drift_remark(fit))
                .collect(),
            warnings: warnings.clone(),
            out: None,
            verdict: assessment.answer.name(),
            reasons: assessment.reasons.clone(),
            objection: (assessment.answer == Answer::NotTrusted).then(|| assessment.reasons.join(" ")),
            answer: assessment.answer,
            can_be_raised: assessment.refusals.iter().any(|refusal| matches!(refusal, Refusal::TooLarge { .. })),
            held_out_rows,
            asked_out: None,
        }
    }
}

impl ParameterLine {
    fn new(parameter: &FittedParameter) -> Self {
        let unit = ScreenUnit::from(parameter.unit);
        let (initial, fitted) = (unit.from_si(parameter.initial), unit.from_si(parameter.fitted));
        Self {
            name: parameter.parameter.to_string(),
            unit: unit.name(),
            initial,
            fitted,
            change: unit.from_si(parameter.fitted - parameter.initial),
            std: parameter.std.map(|std| unit.from_si(std)),
            held: parameter.held.is_some(),
            why: parameter.held.as_ref().map(|held| held.to_string()),
        }
    }

    fn cells(&self) -> [String; 7] {
        let digits = if self.unit == "mm" { 4 } else { 6 };
        let number = |value: f64| fixed(value, digits);
        let (fitted, change) =
            if self.held { (String::new(), String::new()) } else { (number(self.fitted), signed(self.change, digits)) };
        let std = match (self.held, self.std) {
            (true, _) => String::new(),
            (false, Some(std)) => number(std),
            (false, None) => "undetermined".to_owned(),
        };
        let held = self.why.as_ref().map(|why| format!("held: {why}")).unwrap_or_default();
        [self.name.clone(), self.unit.to_owned(), number(self.initial), fitted, change, std, held]
    }
}

/// Rows that stand out weigh on all that is said before them.
fn outlier_remark(dataset: &Dataset, fit: &Fit) -> Option<String> {
    let worst = fit.outliers.first()?;
    Some(format!(
        "{} stand out (list at the end), the worst at {} with {:.3} mm. They weigh on all numbers here: look at them first.",
        if fit.outliers.len() == 1 { "1 row".to_owned() } else { format!("{} rows", fit.outliers.len()) },
        dataset.place(worst.row),
        mm_from_m(fit.residuals[worst.row].value_m)
    ))
}

/// What residuals that follow one another mean for the result.
fn drift_remark(fit: &Fit) -> Option<String> {
    let correlation = fit.neighbour_correlation.filter(|&correlation| correlation > ALIKE)?;
    Some(format!(
        "Residuals follow one another in the order of measurement (correlation {correlation:.2}): something drifts or jumps that the model \
         does not hold, such as the zero of the bar. Deviations below are too small then."
    ))
}

/// A change with its sign; none where it rounds to zero.
fn signed(change: f64, decimals: usize) -> String {
    let text = fixed(change, decimals);
    if change > 0.0 && text != fixed(0.0, decimals) { format!("+{text}") } else { text }
}

fn pairing_changes(rig: &Rig, fit: &Fit) -> Vec<PairingChange> {
    let pairs = fit.initial_by_pairing.iter().zip(&fit.fitted_by_pairing);
    let change = |(initial, fitted): (&ballbar_calib::identify::PairingResiduals, _)| PairingChange {
        initial_rms_mm: mm_from_m(initial.summary.rms_m),
        fitted: PairingLine::new(rig, fitted),
    };
    pairs.map(change).collect()
}

fn outlier_lines(dataset: &Dataset, fit: &Fit) -> Vec<OutlierLine> {
    let line = |outlier: &ballbar_calib::identify::Outlier| OutlierLine {
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

impl Report for FitReport {
    fn text(&self) -> String {
        let mut text = self.headline();
        for remark in &self.remarks {
            text += &format!("\n{remark}\n");
        }
        text += "\n";
        let mut table = Columns::new(&["<parameter", "<unit", "initial", "final", "change", "std. dev.", "<"]);
        for parameter in &self.parameters {
            table.row(parameter.cells());
        }
        text += &table.text();
        text += "\nby pairing\n";
        text += &self.pairings_text();
        text += "\nlargest residuals (measured less computed)\n";
        text += &largest_text(&self.largest);
        text += &self.outliers_text();
        text += &self.verdict_text();
        text + &match (&self.out, &self.asked_out) {
            (Some(out), _) => format!("\nwrote {}\n", one_line(out)),
            (None, Some(asked)) => format!("{} was not written\n", one_line(asked)),
            (None, None) => String::new(),
        }
    }
}

impl FitReport {
    fn headline(&self) -> String {
        let status = self.status.replace('_', " ");
        let mut text = format!("{}, {} poses\n\n", self.robot, self.poses);
        let steps = if self.iterations == 1 { "step" } else { "steps" };
        text += &format!("{status} after {} {steps}: {}\n", self.iterations, self.explanation);
        text += &format!(
            "{} of {} parameters free; rank {}, at most {} can be independent; condition {}\n",
            self.free_parameters,
            self.parameters_total,
            self.rank,
            self.independent_expected,
            if self.condition.is_finite() {
                format!("{:.0}", self.condition)
            } else {
                "infinite (dependent parameters are free)".to_owned()
            }
        );
        text += &format!("RMS {:.4} mm before, {:.4} mm after", self.rms_initial_mm, self.rms_mm);
        if let Some(held_out) = &self.held_out {
            text += &format!("; {:.4} mm on poses left out ({} folds)", held_out.rms_mm, held_out.folds);
        }
        text += "\n";
        text + &self.held_out_rows.as_ref().map_or(String::new(), HeldOutRows::text)
    }

    fn verdict_text(&self) -> String {
        let mut text = format!("\n{}\n", self.answer.words().to_uppercase());
        for reason in &self.reasons {
            text += &format!("  {reason}\n");
        }
        if self.can_be_raised {
            text += "  Where robot and bar are no better than that, --max-rms-mm raises the limit.\n";
        }
        text
    }

    fn pairings_text(&self) -> String {
        let mut table = Columns::new(&["<pairing", "poses", "RMS before mm", "RMS after mm", "mean mm", "largest mm"]);
        for line in &self.by_pairing {
            let fitted = &line.fitted;
            let numbers = [line.initial_rms_mm, fitted.rms_mm, fitted.mean_mm, fitted.max_abs_mm].map(|mm| fixed(mm, 4));
            table.row([fitted.pairing.clone(), fitted.poses.to_string()].into_iter().chain(numbers));
        }
        table.text()
    }

    fn outliers_text(&self) -> String {
        if self.outlier_details.is_empty() {
            return "\nno outliers\n".to_owned();
        }
        let mut table = Columns::new(&["row", "<at", "residual mm", "score", "<stands out from"]);
        for outlier in &self.outlier_details {
            let beside = if outlier.beside == "all" { "all rows" } else { "the rows measured around it" };
            table.row([
                outlier.row.to_string(),
                outlier.place.clone(),
                fixed(outlier.residual_mm, 4),
                format!("{:+.1}", outlier.score),
                beside.to_owned(),
            ]);
        }
        format!("\noutliers: look at these rows, measure them again or leave them out\n{}", table.text())
    }
}
