//! `host-cal fit`: from measured poses to a calibrated robot.

use std::path::{Path, PathBuf};

use ballbar::Damping;
use ballbar_calib::assess::{Answer, Assessment, Evidence};
use ballbar_calib::identify::FitOptions;
use ballbar_calib::model::{Dataset, Rig};
use ballbar_calib::unknowns::Kind;
use clap::{Args, ValueEnum};
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::beliefs::BeliefArgs;
use super::hold::parse_hold;
use super::inputs::{ForceArgs, Measured, MeasuredArgs, OutputArgs, check_max_rms_mm};
use super::outcome::{CommandError, Outcome};
use super::report::{Report, largest_text, print, write_calibrated, write_file};
use super::unknowns::{RigIsKnown, UnknownArgs, unknowns_text};
use crate::documents::{FitDocument, Fitted, HeldOutRows, ParameterLine};
use crate::files::{FileKind, Output, Source, fitted_rig_toml, rig_source};
use crate::terminal::table::{Columns, fixed};
use crate::text::one_line;
use crate::units::m_from_mm;

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
    #[command(flatten)]
    beliefs: BeliefArgs,
    #[command(flatten)]
    unknowns: UnknownArgs,
    /// What damps the steps: the identity as in the paper, or the diagonal of the normal matrix
    #[arg(long, value_enum, default_value_t = DampingArg::Identity)]
    damping: DampingArg,
    /// The largest RMS residual that is believed [default: ten times the poses' sigma_mm, or 1 where they have none]
    #[arg(long, value_name = "MM", allow_hyphen_values = true)]
    max_rms_mm: Option<f64>,
    /// Write the calibrated robot to this file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write the rig as it was found to be to this file; with `--unknown rig`
    #[arg(long, value_name = "FILE")]
    out_rig: Option<PathBuf>,
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

/// What `fit` prints.
#[derive(Serialize)]
struct FitReport {
    #[serde(flatten)]
    document: FitDocument,
    /// The rig's file that was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    out_rig: Option<String>,
    #[serde(skip)]
    asked_out: Option<String>,
}

impl FitArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let hold = parse_hold(&self.hold)?;
        let damping = match self.damping {
            DampingArg::Identity => Damping::Identity,
            DampingArg::Diagonal => Damping::Diagonal,
        };
        check_max_rms_mm(self.max_rms_mm)?;
        if self.out_rig.is_some() && !self.unknowns.may_have(Kind::Rig) {
            return Err(RigIsKnown.into());
        }
        let measured = self.measured.read()?;
        let Measured { robot, rig, dataset, .. } = &measured;
        let (prior, loss) = (self.beliefs.prior(), self.beliefs.loss());
        let options = FitOptions { hold, prior, loss, damping, ..FitOptions::default() };
        let (fit, unknowns) = self.unknowns.fit(robot, rig, dataset, &options)?;
        let unseen: Vec<(String, &Dataset)> = measured.unseen().into_iter().collect();
        let evidence = Evidence { robot, rig, dataset, fit: &fit, unseen: &unseen, max_rms_m: self.max_rms_mm.map(m_from_mm) };
        let assessment = Assessment::new(&evidence);

        let held_out = measured.held_out.as_ref().map(|(rule, rows)| (rule.to_string(), rows));
        let fitted = Fitted {
            robot,
            rig,
            dataset,
            held_out: held_out.as_ref().map(|(rule, rows)| (rule.as_str(), *rows)),
            warnings: &measured.warnings,
            fit: &fit,
            assessment: &assessment,
            unknowns: &unknowns,
        };
        let mut report = FitReport { document: FitDocument::new(&fitted), out_rig: None, asked_out: None };
        if let Some(path) = &self.out {
            report.asked_out = Some(path.display().to_string());
            if write_calibrated(path, self.replace.force, &measured.robot_source, &evidence, &assessment)? {
                report.document.out = report.asked_out.clone();
            }
        }
        let is_worth_keeping = matches!(assessment.answer, Answer::Calibrated | Answer::Reserved);
        if let Some(path) = self.out_rig.as_ref().filter(|_| is_worth_keeping) {
            write_rig(path, self.replace.force, &rig_source(&measured.rig_name)?, &fit.rig(rig))?;
            report.out_rig = Some(path.display().to_string());
        }
        print(&report, self.output.json)?;
        Ok(if report.document.answer == Answer::NotTrusted { Outcome::Doubtful } else { Outcome::Good })
    }
}

impl Report for FitReport {
    fn text(&self) -> String {
        let document = &self.document;
        let mut text = headline(document);
        for remark in &document.remarks {
            text += &format!("\n{remark}\n");
        }
        text += &unknowns_text(&document.unknowns);
        text += "\n";
        let mut table = Columns::new(&["<parameter", "<unit", "initial", "final", "change", "std. dev.", "<"]);
        for parameter in &document.parameters {
            table.row(parameter_cells(parameter));
        }
        text += &table.text();
        text += "\nby pairing\n";
        text += &pairings_text(document);
        text += "\nlargest residuals (measured less computed)\n";
        text += &largest_text(&document.largest);
        text += &left_out_text(document);
        text += &outliers_text(document);
        text += &verdict_text(document);
        text + &match (&document.out, &self.asked_out) {
            (Some(out), _) => format!("\nwrote {}\n", one_line(out)),
            (None, Some(asked)) => format!("{} was not written\n", one_line(asked)),
            (None, None) => String::new(),
        } + &self.out_rig.as_ref().map_or(String::new(), |out| format!("wrote {}\n", one_line(out)))
    }
}

/// Writes a rig's text with its ends where they were found to be.
fn write_rig(path: &Path, force: bool, source: &Source, rig: &Rig) -> Result<(), CommandError> {
    let edited = fitted_rig_toml(source, rig);
    let text = edited
        .map_err(|error| CommandError::output(RigNotEdited { name: source.name().to_owned(), reason: error.to_string() }))?;
    write_file(Output { path, kind: FileKind::Rig, force }, &text)
}

/// The rig's text, which is kept around the new numbers.
#[derive(Debug, Error, Diagnostic)]
#[error("{name}: the rig's text cannot be edited: {reason}")]
struct RigNotEdited {
    name: String,
    reason: String,
}

fn parameter_cells(line: &ParameterLine) -> [String; 7] {
    let digits = if line.unit == "mm" { 4 } else { 6 };
    let number = |value: f64| fixed(value, digits);
    let (fitted, change) =
        if line.held { (String::new(), String::new()) } else { (number(line.fitted), signed(line.change, digits)) };
    let std = match (line.held, line.std) {
        (true, _) => String::new(),
        (false, Some(std)) => number(std),
        (false, None) => "undetermined".to_owned(),
    };
    let held = line.why.as_ref().map(|why| format!("held: {why}")).unwrap_or_default();
    [line.name.clone(), line.unit.to_owned(), number(line.initial), fitted, change, std, held]
}

/// A change with its sign; none where it rounds to zero.
fn signed(change: f64, decimals: usize) -> String {
    let text = fixed(change, decimals);
    if change > 0.0 && text != fixed(0.0, decimals) { format!("+{text}") } else { text }
}

fn headline(document: &FitDocument) -> String {
    let status = document.status.replace('_', " ");
    let mut text = format!("{}, {} poses\n\n", document.robot, document.poses);
    let steps = if document.iterations == 1 { "step" } else { "steps" };
    text += &format!("{status} after {} {steps}: {}\n", document.iterations, document.explanation);
    text += &format!(
        "{} of {} parameters free; rank {}, at most {} can be independent; condition {}\n",
        document.free_parameters,
        document.parameters_total,
        document.rank,
        document.independent_expected,
        if document.condition.is_finite() {
            format!("{:.0}", document.condition)
        } else {
            "infinite (dependent parameters are free)".to_owned()
        }
    );
    text += &format!("RMS {:.4} mm before, {:.4} mm after", document.rms_initial_mm, document.rms_mm);
    if let Some(prior) = &document.prior {
        text += &format!(
            "; lengths decide {:.1} parameters, the tolerances of the robot's file (inside the arm times {:.2}) the rest",
            prior.told, prior.factor
        );
    }
    if let Some(held_out) = &document.held_out {
        text += &format!("; {:.4} mm on poses left out ({} folds)", held_out.rms_mm, held_out.folds);
    }
    text += "\n";
    text + &document.held_out_rows.as_ref().map_or(String::new(), held_out_text)
}

fn verdict_text(document: &FitDocument) -> String {
    let mut text = format!("\n{}\n", document.answer.words().to_uppercase());
    for reason in &document.reasons {
        text += &format!("  {reason}\n");
    }
    if document.can_be_raised {
        text += "  Where robot and bar are no better than that, --max-rms-mm raises the limit.\n";
    }
    text
}

fn pairings_text(document: &FitDocument) -> String {
    let mut table = Columns::new(&["<pairing", "poses", "RMS before mm", "RMS after mm", "mean mm", "largest mm"]);
    for line in &document.by_pairing {
        let fitted = &line.fitted;
        let numbers = [line.initial_rms_mm, fitted.rms_mm, fitted.mean_mm, fitted.max_abs_mm].map(|mm| fixed(mm, 4));
        table.row([fitted.pairing.clone(), fitted.poses.to_string()].into_iter().chain(numbers));
    }
    table.text()
}

fn left_out_text(document: &FitDocument) -> String {
    if document.left_out.is_empty() {
        return String::new();
    }
    let mut table = Columns::new(&["row", "<at", "residual mm", "std. devs"]);
    for line in &document.left_out {
        table.row([line.row.to_string(), line.place.clone(), fixed(line.residual_mm, 4), format!("{:+.0}", line.deviations)]);
    }
    let causes: String = document.causes.iter().map(|cause| format!("  {cause}\n")).collect();
    format!("\nleft out: these rows contradict the others\n{causes}{}", table.text())
}

fn outliers_text(document: &FitDocument) -> String {
    if document.outlier_details.is_empty() {
        return "\nno outliers\n".to_owned();
    }
    let mut table = Columns::new(&["row", "<at", "residual mm", "score", "<stands out from"]);
    for outlier in &document.outlier_details {
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

fn held_out_text(rows: &HeldOutRows) -> String {
    format!(
        "held out ({}), {} poses: RMS {:.4} mm before, {:.4} mm after, mean {:.4} mm, largest {:.4} mm\n",
        rows.rule, rows.poses, rows.rms_initial_mm, rows.rms_mm, rows.mean_mm, rows.max_abs_mm
    )
}
