//! `host-cal report`: a calibration as one page for people.

use std::path::{Path, PathBuf};

use clap::Args;
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::fit::FitReport;
use super::inputs::{Measured, MeasuredArgs, OutputArgs};
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print, write_file};
use crate::files::{Dataset, check_writable};
use crate::identify::{FitOptions, Hold, fit};
use crate::report::{Facts, Figure, Inputs, figures, html};
use crate::units::mm_from_m;

/// Show a calibration as one page: is the robot calibrated, how good is it, how do we know
#[derive(Args)]
#[command(after_help = "Examples:
  host-cal report --robot design.toml --rig rig.toml poses.csv --validate other.csv --out report.html
  host-cal report today --hold-out bar=610 --out report.html --svg figures --csv figures

The page is one file without links: it opens in any browser, without a network, and prints.
Exit code 1 says that the page calls the result not to be trusted.")]
pub(super) struct ReportArgs {
    #[command(flatten)]
    measured: MeasuredArgs,
    /// Poses that the fit is not to see, to judge it by (poses.csv); may be given again
    #[arg(long, value_name = "POSES")]
    validate: Vec<PathBuf>,
    /// Parameters to leave at their design values, as `fit` takes them
    #[arg(long, default_value = "auto", value_name = "RULE|NAME,…")]
    hold: String,
    /// Write the page to this file
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Write the figures into this folder, one SVG file each
    #[arg(long, value_name = "DIR")]
    svg: Option<PathBuf>,
    /// Write the figures' numbers into this folder, one CSV file each
    #[arg(long, value_name = "DIR")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct PageReport {
    out: String,
    calibrated: bool,
    /// Why it is not to be trusted.
    doubt: Option<String>,
    poses: usize,
    rms_initial_mm: f64,
    rms_mm: f64,
    unseen: Vec<Unseen>,
    figures: Vec<&'static str>,
}

#[derive(Serialize)]
struct Unseen {
    name: String,
    poses: usize,
    rms_initial_mm: f64,
    rms_mm: f64,
}

#[derive(Debug, Error, Diagnostic)]
#[error("{}: cannot be made: {error}", folder.display())]
#[diagnostic(help("Give a folder that is there, or that can be made."))]
struct FolderError {
    folder: PathBuf,
    error: std::io::Error,
}

#[derive(Debug, Error, Diagnostic)]
#[error("{}: holds no pose", .0.display())]
#[diagnostic(help("Give --validate a file with measured poses."))]
struct EmptyError(PathBuf);

impl ReportArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let hold: Hold = self.hold.parse()?;
        check_writable(&self.out).map_err(CommandError::output)?;
        let measured = self.measured.read()?;
        let others = self.others(&measured)?;
        let fit = fit(&measured.robot, &measured.dataset, &FitOptions { hold, ..FitOptions::default() })?;

        let told = FitReport::new(&measured, &fit);
        let held_out = measured.held_out.iter().map(|(rule, rows)| (format!("poses held out ({rule})"), rows));
        let unseen: Vec<(String, &Dataset)> = others.iter().map(|(name, rows)| (name.clone(), rows)).chain(held_out).collect();
        let facts = Facts::new(&Inputs {
            robot: &measured.robot,
            rig: &measured.rig,
            dataset: &measured.dataset,
            fit: &fit,
            unseen: &unseen,
            objection: told.objection.as_deref(),
            remarks: &[told.remarks, measured.warnings].concat(),
        });
        let figures = figures(&facts)?;

        let now = jiff::Timestamp::now();
        let when = now.round(jiff::Unit::Second).unwrap_or(now).to_string();
        write_file(&self.out, &html(&facts, &figures, &when))?;
        write_each(self.svg.as_deref(), &figures, "svg", |figure| figure.svg.clone())?;
        write_each(self.csv.as_deref(), &figures, "csv", |figure| figure.data.csv())?;

        let report = PageReport::new(&self.out, &facts, &figures);
        print(&report, self.output.json)?;
        Ok(if report.calibrated { Outcome::Good } else { Outcome::Doubtful })
    }

    /// The files of `--validate`, and what to call them.
    fn others(&self, measured: &Measured) -> Result<Vec<(String, Dataset)>, CommandError> {
        let read = |path: &PathBuf| {
            let rows = Dataset::read([path.as_path()], &measured.robot, &measured.rig)?;
            if rows.rows.is_empty() { Err(EmptyError(path.clone()).into()) } else { Ok((path.display().to_string(), rows)) }
        };
        self.validate.iter().map(read).collect()
    }
}

/// One file a figure.
fn write_each(
    folder: Option<&Path>,
    figures: &[Figure],
    end: &str,
    text: impl Fn(&Figure) -> String,
) -> Result<(), CommandError> {
    let Some(folder) = folder else { return Ok(()) };
    let failed = |error| CommandError::output(FolderError { folder: folder.to_owned(), error });
    std::fs::create_dir_all(folder).map_err(failed)?;
    figures.iter().try_for_each(|figure| write_file(&folder.join(format!("{}.{end}", figure.name)), &text(figure)))
}

impl PageReport {
    fn new(out: &Path, facts: &Facts, figures: &[Figure]) -> Self {
        let doubt = facts.doubt();
        let unseen = facts.proofs.iter().map(|proof| Unseen {
            name: proof.name.clone(),
            poses: proof.after.len(),
            rms_initial_mm: mm_from_m(proof.before_summary().rms_m),
            rms_mm: mm_from_m(proof.after_summary().rms_m),
        });
        Self {
            out: out.display().to_string(),
            calibrated: doubt.is_none(),
            doubt,
            poses: facts.rows.len(),
            rms_initial_mm: mm_from_m(facts.before.rms_m),
            rms_mm: mm_from_m(facts.after.rms_m),
            unseen: unseen.collect(),
            figures: figures.iter().map(|figure| figure.name).collect(),
        }
    }
}

impl Report for PageReport {
    fn text(&self) -> String {
        let mut text = format!("RMS {:.4} mm before, {:.4} mm after on {} poses\n", self.rms_initial_mm, self.rms_mm, self.poses);
        for Unseen { name, poses, rms_initial_mm, rms_mm } in &self.unseen {
            text += &format!("RMS {rms_initial_mm:.4} mm before, {rms_mm:.4} mm after on {name}, {poses} poses\n");
        }
        if let Some(doubt) = &self.doubt {
            text += &format!("NOT TO BE TRUSTED AS IT IS: {doubt}\n");
        }
        text + &format!("wrote {}\n", self.out)
    }
}
