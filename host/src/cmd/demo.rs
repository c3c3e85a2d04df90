//! `host-cal demo`: a calibration from nothing to proof, without hardware.

use std::path::{Path, PathBuf};

use clap::Args;
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print, progress, write_calibrated, write_file};
use super::table::Columns;
use crate::files::{Dataset, RIGS, ROBOTS, Rig, Robot, Source, write_poses};
use crate::identify::{Fit, FitOptions, ResidualSummary, fit, residuals};
use crate::simulate::{Shells, tool_error};
use crate::units::{m_from_mm, mm_from_m};

/// See a whole calibration without hardware: simulate, fit, prove
#[derive(Args)]
#[command(
    after_help = "Example:\n  host-cal demo --out my-demo\n\nThe files it leaves are what the other commands read; what it prints last are commands to try on them."
)]
pub(super) struct DemoArgs {
    /// Folder for the files
    #[arg(long, default_value = "ballbar-demo", value_name = "DIR")]
    out: PathBuf,
    /// Another seed gives other poses and other noise
    #[arg(long, default_value_t = 7)]
    seed: u64,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct DemoReport {
    poses: usize,
    sigma_mm: f64,
    status: &'static str,
    free_parameters: usize,
    rms_initial_mm: f64,
    rms_mm: f64,
    other_shells: Change,
    tool: Change,
    tool_max: Change,
    files: Vec<String>,
    #[serde(skip)]
    folder: String,
}

/// A number with the design parameters and with the fitted ones.
#[derive(Serialize)]
struct Change {
    before_mm: f64,
    after_mm: f64,
}

#[derive(Debug, Error, Diagnostic)]
#[error("{}: cannot be made: {error}", folder.display())]
#[diagnostic(help("Give another folder with --out."))]
struct FolderError {
    folder: PathBuf,
    error: std::io::Error,
}

#[derive(Debug, Error, Diagnostic)]
#[error("{}: holds files that are not the demo's", folder.display())]
#[diagnostic(help("Give an empty or a new folder with --out."))]
struct ForeignFolderError {
    folder: PathBuf,
}

/// What the demo printed, left among its files; by it the demo knows its own folder again.
const SUMMARY_NAME: &str = "demo.txt";
const SIGMA_MM: f64 = 0.084;
const FITTED_BAR_MM: f64 = 460.0;
const OTHER_BAR_MM: f64 = 610.0;
const POSES_PER_PAIRING: usize = 90;
const WORKSPACE_POSES: usize = 5_000;

impl DemoArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let (design, truth, rig) = (Robot::open("puma560")?, Robot::open("puma560-optimised")?, Rig::open("triangles")?);
        self.prepare_folder()?;

        let fitted_csv = self.simulate("simulating 46 cm shells", FITTED_BAR_MM, self.seed, &design, &truth, &rig)?;
        let other_csv =
            self.simulate("simulating 61 cm shells", OTHER_BAR_MM, self.seed.wrapping_add(1), &design, &truth, &rig)?;
        let (fitted_name, other_name) = ("poses-460.csv", "poses-610.csv");
        let mut fitted_poses = Dataset::default();
        fitted_poses.append(&Source::new(fitted_name, &fitted_csv), &design, &rig)?;
        let mut other_poses = Dataset::default();
        other_poses.append(&Source::new(other_name, &other_csv), &design, &rig)?;

        let fit = fit(&design, &fitted_poses, &FitOptions::default())?;
        let files = [
            ("design.toml", Source::named_or_read("puma560", &ROBOTS, "robot")?.text().to_owned()),
            ("rig.toml", Source::named_or_read("triangles", &RIGS, "rig")?.text().to_owned()),
            (fitted_name, fitted_csv),
            (other_name, other_csv),
        ];
        for (name, text) in &files {
            write_file(&self.out.join(name), text)?;
        }
        let calibrated_name = "calibrated.toml";
        write_calibrated(&self.out.join(calibrated_name), &design, &fitted_poses, &fit)?;
        let names = files.iter().map(|(name, _)| *name).chain([calibrated_name]);
        let names = names.chain([SUMMARY_NAME]).map(|name| self.out.join(name).display().to_string()).collect();
        let report = DemoReport::new(&design, &truth, &fit, &other_poses, names, &self.out);
        write_file(&self.out.join(SUMMARY_NAME), &report.text())?;
        print(&report, self.output.json)?;
        Ok(if fit.objection().is_none() { Outcome::Good } else { Outcome::Doubtful })
    }

    /// Makes the folder; one that holds other things than an earlier demo's is left alone.
    fn prepare_folder(&self) -> Result<(), CommandError> {
        let failed = |error| CommandError::output(FolderError { folder: self.out.clone(), error });
        std::fs::create_dir_all(&self.out).map_err(failed)?;
        let is_empty = std::fs::read_dir(&self.out).map_err(failed)?.next().is_none();
        if !is_empty && !self.out.join(SUMMARY_NAME).is_file() {
            return Err(ForeignFolderError { folder: self.out.clone() }.into());
        }
        write_file(&self.out.join(SUMMARY_NAME), "")
    }

    /// Poses of all pairings as the text of a file: what goes on is what a reader of the file would get.
    fn simulate(
        &self,
        what: &'static str,
        bar_mm: f64,
        seed: u64,
        design: &Robot,
        truth: &Robot,
        rig: &Rig,
    ) -> Result<String, CommandError> {
        let pairings = rig.all_pairings();
        let shells = Shells {
            planned_with: design,
            truth,
            rig,
            pairings: &pairings,
            bar_m: m_from_mm(bar_mm),
            per_pairing: POSES_PER_PAIRING,
            sigma_m: m_from_mm(SIGMA_MM),
            seed,
        };
        let bar = progress((pairings.len() * POSES_PER_PAIRING) as u64, what);
        let poses = shells.simulate(|| bar.inc(1))?;
        bar.finish_and_clear();
        let rows: Vec<_> = poses.into_iter().map(|pose| pose.row).collect();
        Ok(write_poses(truth, rig, &rows))
    }
}

impl DemoReport {
    fn new(design: &Robot, truth: &Robot, fit: &Fit, other: &Dataset, files: Vec<String>, folder: &Path) -> Self {
        let fitted = &fit.solution.chain;
        let rms = |chain| ResidualSummary::new(&residuals(chain, other)).rms_m;
        let change = |before_m, after_m| Change { before_mm: mm_from_m(before_m), after_mm: mm_from_m(after_m) };
        let tool = |chain| tool_error(&truth.chain, chain, &truth.limits, WORKSPACE_POSES, 0);
        let (before, after) = (tool(&design.chain), tool(fitted));
        Self {
            poses: fit.fitted.count,
            sigma_mm: SIGMA_MM,
            status: fit.solution.status.name(),
            free_parameters: fit.free_parameters(),
            rms_initial_mm: mm_from_m(fit.initial.rms_m),
            rms_mm: mm_from_m(fit.fitted.rms_m),
            other_shells: change(rms(&design.chain), rms(fitted)),
            tool: change(before.rms_m, after.rms_m),
            tool_max: change(before.max_m, after.max_m),
            files,
            folder: folder.display().to_string(),
        }
    }
}

impl Report for DemoReport {
    fn text(&self) -> String {
        let mut text = format!(
            "A PUMA 560 whose controller believes the design parameters, while the arm has those that the paper found.\n\
             {} lengths from three chucks to three spheres on 46 cm shells, each with {} mm of noise.\n\
             Fit {}: {} parameters identified.\n\n",
            self.poses, self.sigma_mm, self.status, self.free_parameters
        );
        let mut table = Columns::new(&["<", "design", "calibrated"]);
        let change = |change: &Change| [format!("{:.3} mm", change.before_mm), format!("{:.3} mm", change.after_mm)];
        let fitted = Change { before_mm: self.rms_initial_mm, after_mm: self.rms_mm };
        for (what, numbers) in [
            ("RMS of the lengths fitted, 46 cm shells", change(&fitted)),
            ("RMS of lengths never seen, 61 cm shells", change(&self.other_shells)),
            ("tool position error over the workspace, RMS", change(&self.tool)),
            ("tool position error over the workspace, largest", change(&self.tool_max)),
        ] {
            table.row([what.to_owned()].into_iter().chain(numbers));
        }
        text += &table.text();
        text += &format!("\nLeft in {}: {}\n", self.folder, self.files.join(" "));
        let at = |name: &str| quoted(&Path::new(&self.folder).join(name));
        let (design, rig, fitted, other, calibrated) =
            (at("design.toml"), at("rig.toml"), at("poses-460.csv"), at("poses-610.csv"), at("calibrated.toml"));
        text += &format!(
            "\nTry next (host-cal is target/release/host-cal, or on your path after `cargo install --path host`):\n  host-cal fit --robot {design} --rig {rig} {fitted}\n  host-cal validate --robot {calibrated} --rig {rig} {other}\n  \
             host-cal rank --robot {design} --rig {rig} {fitted} --pairings A:1\n  host-cal paper\n"
        );
        text
    }
}

/// A path as a shell takes it.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = text.chars().all(|c| c.is_alphanumeric() || "/._-".contains(c));
    if is_plain { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
}
