//! `host-cal fit`: from measured poses to a calibrated robot.

use std::path::PathBuf;

use ballbar::Damping;
use clap::{Args, ValueEnum};
use serde::Serialize;

use super::hold_out::HeldOutRows;
use super::inputs::{ForceArgs, Measured, MeasuredArgs, OutputArgs};
use super::lines::{NotIdentified, PairingLine, ResidualLine, largest, largest_text};
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print, write_calibrated};
use super::table::{Columns, fixed};
use crate::files::{Dataset, Rig};
use crate::identify::{
    ConvergenceTest, Fit, FitOptions, FittedParameter, Hold, OutlierTest, Status, fit, plausible_error, remarks,
};
use crate::text::one_line;
use crate::units::{ScreenUnit, mm_from_m};

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

The file is written only when the fit reached a minimum and predicts poses left out of it better
than the design does; otherwise the exit code is 1.")]
pub(super) struct FitArgs {
    #[command(flatten)]
    measured: MeasuredArgs,
    /// Parameters to leave at their design values: auto, paper, none, and names
    #[arg(long, default_value = "auto", value_name = "RULE|NAME,…")]
    hold: String,
    /// What damps the steps: the identity as in the paper, or the diagonal of the normal matrix
    #[arg(long, value_enum, default_value_t = DampingArg::Identity)]
    damping: DampingArg,
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
    /// Why the result is not to be kept; nothing was written then.
    pub(super) objection: Option<String>,
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
        let hold: Hold = self.hold.parse()?;
        let damping = match self.damping {
            DampingArg::Identity => Damping::Identity,
            DampingArg::Diagonal => Damping::Diagonal,
        };
        let measured = self.measured.read()?;
        let fit = fit(&measured.robot, &measured.dataset, &FitOptions { hold, damping })?;

        let mut report = FitReport::new(&measured, &fit);
        if let Some(path) = &self.out {
            report.asked_out = Some(path.display().to_string());
            if report.objection.is_none() {
                write_calibrated(path, self.replace.force, &measured.robot, &measured.dataset, &fit)?;
                report.out = report.asked_out.clone();
            }
        }
        print(&report, self.output.json)?;
        Ok(if report.objection.is_none() { Outcome::Good } else { Outcome::Doubtful })
    }
}

impl FitReport {
    pub(super) fn new(measured: &Measured, fit: &Fit) -> Self {
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
            iterations: fit.solution.iterations,
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
                .chain(runaway_remark(fit))
                .chain(drift_remark(fit))
                .collect(),
            warnings: warnings.clone(),
            out: None,
            objection: fit
                .objection()
                .map(|objection| objection.to_string())
                .or_else(|| held_out_rows.as_ref().and_then(HeldOutRows::objection)),
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

/// Parameters that went where no robot's are.
pub(super) fn runaway_remark(fit: &Fit) -> Option<String> {
    const IMPLAUSIBLY_FAR: f64 = 20.0;
    let far = |parameter: &&FittedParameter| {
        (parameter.fitted - parameter.initial).abs() > IMPLAUSIBLY_FAR * plausible_error(parameter.unit)
    };
    let names: Vec<String> = fit.parameters.iter().filter(far).map(|parameter| parameter.parameter.to_string()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "{} moved by more than {IMPLAUSIBLY_FAR} times what a design may be off: these poses do not tell them, and no such robot \
             exists. Hold them, or let --hold auto choose.",
            names.join(", ")
        )
    })
}

/// What residuals that follow one another mean for the result.
fn drift_remark(fit: &Fit) -> Option<String> {
    const ALIKE: f64 = 0.5;
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
    let change = |(initial, fitted): (&crate::identify::PairingResiduals, _)| PairingChange {
        initial_rms_mm: mm_from_m(initial.summary.rms_m),
        fitted: PairingLine::new(rig, fitted),
    };
    pairs.map(change).collect()
}

fn outlier_lines(dataset: &Dataset, fit: &Fit) -> Vec<OutlierLine> {
    let line = |outlier: &crate::identify::Outlier| OutlierLine {
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
        if let Some(objection) = &self.objection {
            text += &format!("\nNOT TO BE TRUSTED AS IT IS: {objection}\n");
        }
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
