//! `host-cal report`: a calibration as one page for people.

use std::path::{Path, PathBuf};

use ballbar_calib::assess::{Answer, Assessment, Evidence};
use ballbar_calib::identify::{FitOptions, remarks};
use ballbar_calib::model::Dataset;
use clap::Args;
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::beliefs::BeliefArgs;
use super::hold::parse_hold;
use super::inputs::{ForceArgs, Measured, MeasuredArgs, OutputArgs, check_max_rms_mm};
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print, write_files};
use super::unknowns::UnknownArgs;
use crate::files::{FileKind, Output, read_poses};
use crate::report::{Facts, Figure, Inputs, figures, html, parameters_table};
use crate::session::poses_of;
use crate::text::one_line;
use crate::units::{m_from_mm, mm_from_m};

/// Show a calibration as one page: is the robot calibrated, how good is it, how do we know
#[derive(Args)]
#[command(after_help = "Examples:
  host-cal report --robot design.toml --rig rig.toml poses.csv --validate other.csv --out report.html
  host-cal report today --hold-out bar=610 --out report.html --svg figures --csv figures

The page is one file without links: it opens in any browser, without a network, and prints.
Exit code 1 says that the page calls the result not to be trusted; with reservations it is 0.")]
pub(super) struct ReportArgs {
    #[command(flatten)]
    measured: MeasuredArgs,
    /// Poses that the fit is not to see, to judge it by (poses.csv, or a session); may be given again
    #[arg(long, value_name = "SESSION|POSES")]
    validate: Vec<PathBuf>,
    /// Parameters to leave at their design values, as `fit` takes them
    #[arg(long, default_value = "auto", value_name = "RULE|NAME,…")]
    hold: String,
    #[command(flatten)]
    beliefs: BeliefArgs,
    #[command(flatten)]
    unknowns: UnknownArgs,
    /// The largest RMS residual that is believed, as `fit` takes it
    #[arg(long, value_name = "MM", allow_hyphen_values = true)]
    max_rms_mm: Option<f64>,
    /// Write the page to this file
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Write the figures into this folder, one SVG file each
    #[arg(long, value_name = "DIR")]
    svg: Option<PathBuf>,
    /// Write the figures' numbers and the parameters into this folder, one CSV file each
    #[arg(long, value_name = "DIR")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    replace: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct PageReport {
    out: String,
    /// `calibrated`, `unchanged`, `reserved` or `not_trusted`.
    verdict: &'static str,
    #[serde(skip)]
    answer: Answer,
    /// Why it is no better.
    reasons: Vec<String>,
    poses: usize,
    rms_initial_mm: f64,
    rms_mm: f64,
    unseen: Vec<Unseen>,
    figures: Vec<&'static str>,
    not_drawn: Vec<NotDrawn>,
}

#[derive(Serialize)]
struct NotDrawn {
    name: &'static str,
    why: String,
}

#[derive(Serialize)]
struct Unseen {
    name: String,
    poses: usize,
    rms_initial_mm: f64,
    rms_mm: f64,
    max_abs_mm: f64,
    mean_mm: f64,
}

#[derive(Debug, Error, Diagnostic)]
#[error("{}: holds no pose", .0.display())]
#[diagnostic(help("Give --validate a file with measured poses."))]
struct EmptyError(PathBuf);

#[derive(Debug, Error, Diagnostic)]
#[error("{}: {seen} of its {of} poses are among the fitted ones, expected none", path.display())]
#[diagnostic(help("What the fit has seen proves nothing. Give --validate other poses, or keep some apart with --hold-out."))]
struct SeenError {
    path: PathBuf,
    seen: usize,
    of: usize,
}

impl ReportArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let hold = parse_hold(&self.hold)?;
        check_max_rms_mm(self.max_rms_mm)?;
        let measured = self.measured.read()?;
        let others = self.others(&measured)?;
        let page = Output { path: &self.out, kind: FileKind::Page, force: self.replace.force };
        page.check().map_err(CommandError::not_written)?;
        let (prior, loss) = (self.beliefs.prior(), self.beliefs.loss());
        let options = FitOptions { hold, prior, loss, ..FitOptions::default() };
        let (fit, _) = self.unknowns.fit(&measured.robot, &measured.rig, &measured.dataset, &options)?;

        let remarks = remarks(&measured.robot.chain, &measured.dataset, &measured.rig, &measured.robot.limits);
        let unseen: Vec<(String, &Dataset)> =
            others.iter().map(|(name, rows)| (name.clone(), rows)).chain(measured.unseen()).collect();
        let Measured { robot, rig, dataset, .. } = &measured;
        let max_rms_m = self.max_rms_mm.map(m_from_mm);
        let assessment = Assessment::new(&Evidence { robot, rig, dataset, fit: &fit, unseen: &unseen, max_rms_m });
        let facts = Facts::new(&Inputs {
            robot,
            rig,
            rig_name: &measured.rig_name,
            dataset,
            fit: &fit,
            assessment: &assessment,
            remarks: &remarks.into_iter().chain(measured.warnings.iter().cloned()).collect::<Vec<_>>(),
        });
        let figures = figures(&facts)?;

        let now = jiff::Timestamp::now();
        let when = now.round(jiff::Unit::Second).unwrap_or(now).to_string();
        let mut files = vec![(self.out.clone(), FileKind::Page, html(&facts, &figures, &when))];
        let drawn = || figures.iter().filter_map(|figure| Some((figure.name, figure.drawing.as_ref()?)));
        if let Some(folder) = &self.svg {
            files.extend(
                drawn().map(|(name, drawing)| (folder.join(format!("{name}.svg")), FileKind::Figure, drawing.svg.clone())),
            );
        }
        if let Some(folder) = &self.csv {
            let tables = drawn().map(|(name, drawing)| (name, drawing.data.csv()));
            let tables = tables.chain([("parameters", parameters_table(&facts).csv())]);
            files.extend(tables.map(|(name, csv)| (folder.join(format!("{name}.csv")), FileKind::FigureTable, csv)));
        }
        write_files(&files, self.replace.force)?;

        let report = PageReport::new(&self.out, &facts, &figures);
        print(&report, self.output.json)?;
        Ok(if report.answer == Answer::NotTrusted { Outcome::Doubtful } else { Outcome::Good })
    }

    /// The files of `--validate`, and what to call them.
    fn others(&self, measured: &Measured) -> Result<Vec<(String, Dataset)>, CommandError> {
        let read = |path: &PathBuf| {
            let rows = read_poses([poses_of(path)?.as_path()], &measured.robot, &measured.rig)?;
            match (rows.rows.len(), rows.shared_rows(&measured.dataset)) {
                (0, _) => Err(EmptyError(path.clone()).into()),
                (_, 0) => Ok((path.display().to_string(), rows)),
                (of, seen) => Err(SeenError { path: path.clone(), seen, of }.into()),
            }
        };
        self.validate.iter().map(read).collect()
    }
}

impl PageReport {
    fn new(out: &Path, facts: &Facts, figures: &[Figure]) -> Self {
        let Assessment { answer, reasons, proofs, .. } = &facts.assessment;
        let unseen = proofs.iter().map(|proof| {
            let after = proof.after_summary();
            Unseen {
                name: proof.name.clone(),
                poses: after.count,
                rms_initial_mm: mm_from_m(proof.before_summary().rms_m),
                rms_mm: mm_from_m(after.rms_m),
                max_abs_mm: mm_from_m(after.max_abs_m),
                mean_mm: mm_from_m(after.mean_m),
            }
        });
        let missing = figures.iter().filter(|figure| figure.drawing.is_none());
        Self {
            out: out.display().to_string(),
            verdict: answer.name(),
            answer: *answer,
            reasons: reasons.clone(),
            poses: facts.rows.len(),
            rms_initial_mm: mm_from_m(facts.before.rms_m),
            rms_mm: mm_from_m(facts.after.rms_m),
            unseen: unseen.collect(),
            figures: figures.iter().filter(|figure| figure.drawing.is_some()).map(|figure| figure.name).collect(),
            not_drawn: missing.map(|figure| NotDrawn { name: figure.name, why: figure.sentence.clone() }).collect(),
        }
    }
}

impl Report for PageReport {
    fn text(&self) -> String {
        let mut text = format!("{}\n", self.answer.words());
        for reason in &self.reasons {
            text += &format!("  {reason}\n");
        }
        text += &format!("RMS {:.4} mm before, {:.4} mm after on {} poses\n", self.rms_initial_mm, self.rms_mm, self.poses);
        for Unseen { name, poses, rms_initial_mm, rms_mm, .. } in &self.unseen {
            text += &format!("RMS {rms_initial_mm:.4} mm before, {rms_mm:.4} mm after on {}, {poses} poses\n", one_line(name));
        }
        for NotDrawn { name, why } in &self.not_drawn {
            text += &format!("{name}: {why}\n");
        }
        text + &format!("wrote {}\n", one_line(&self.out))
    }
}
