//! `host-cal demo`: a calibration from nothing to proof, without hardware: through the board's own firmware and over its wire.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use ballbar::{Chain, Kinematics};
use ballbar_calib::assess::{Assessment, Evidence};
use ballbar_calib::identify::{Fit, FitOptions, ResidualSummary, fit, residuals};
use ballbar_calib::model::{Dataset, Robot};
use ballbar_calib::simulate::tool_error;
use clap::Args;
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::apply::say_steps;
use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print, write_calibrated, write_file, write_files};
use crate::board::{Admission, StreamLosses, Upload, rms_kinematics};
use crate::files::{FileKind, Output, RIGS, Source, append_poses, open_rig, open_robot, robot_source};
use crate::remedies::Remedied;
use crate::terminal::progress;
use crate::terminal::table::Columns;
use crate::text::{one_line, shown_path};
use crate::units::{m_from_mm, mm_from_m};
use crate::virtual_board::{Bench, BenchRun, Scene};

/// See a whole calibration without hardware: stream, settle, fit, validate, apply, verify
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
    /// Of the poses that the board itself computes, over the same workspace.
    board_tool: Change,
    /// Between the board's kinematics and this program's, with the parameters just stored.
    board_difference_um: f64,
    losses: StreamLosses,
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

/// Of no seed that was tried.
#[derive(Debug, Error, Diagnostic)]
#[error("the simulated calibration is not to be trusted: {0}")]
#[diagnostic(help("Give another seed with --seed."))]
struct RefusedError(String);

/// What the demo printed, left among its files; by it the demo knows its own folder again.
const SUMMARY_NAME: &str = "demo.txt";
/// Noise of every length, the paper's.
const SIGMA_MM: f64 = 0.084;
const POSES_PER_PAIRING: usize = 90;
const FITTED_BAR_MM: f64 = 460.0;
const OTHER_BAR_MM: f64 = 610.0;
const WORKSPACE_POSES: usize = 5_000;
/// Joint vectors at which the board is asked where the tool is.
const BOARD_POSES: NonZeroUsize = NonZeroUsize::new(300).unwrap();

impl DemoArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let scene =
            Scene { design: open_robot("puma560")?, truth: open_robot("puma560-optimised")?, rig: open_rig("triangles")? };
        let Scene { design, rig, .. } = &scene;
        self.prepare_folder()?;

        let mut bench = Bench::power_up(&scene, self.seed)?;
        let mut collect = |what, bar_mm, seed| {
            let (bar_m, sigma_m) = (m_from_mm(bar_mm), m_from_mm(SIGMA_MM));
            let bar = progress((rig.all_pairings().len() * POSES_PER_PAIRING) as u64, what);
            bench.collect(&BenchRun { bar_m, per_pairing: POSES_PER_PAIRING, sigma_m, seed }, || bar.inc(1))
        };
        let fitted_poses_csv = collect("46 cm shells", FITTED_BAR_MM, self.seed)?;
        let other_poses_csv = collect("61 cm shells", OTHER_BAR_MM, self.seed.wrapping_add(1))?;
        let (fitted_name, other_name) = ("poses-460.csv", "poses-610.csv");
        let mut fitted_poses = Dataset::default();
        append_poses(&mut fitted_poses, &Source::new(fitted_name, &fitted_poses_csv), design, rig)?;
        let mut other_poses = Dataset::default();
        append_poses(&mut other_poses, &Source::new(other_name, &other_poses_csv), design, rig)?;

        let design_source = robot_source("puma560")?;
        let fit = fit(design, &fitted_poses, &FitOptions::default()).map_err(Remedied)?;
        let files = [
            ("design.toml", FileKind::Robot, design_source.text().to_owned()),
            ("rig.toml", FileKind::Rig, Source::named_or_read("triangles", &RIGS, "rig")?.text().to_owned()),
            (fitted_name, FileKind::Poses, fitted_poses_csv),
            (other_name, FileKind::Poses, other_poses_csv),
        ];
        let written = files.iter().map(|(name, kind, text)| (self.out.join(name), *kind, text.clone()));
        write_files(&written.collect::<Vec<_>>(), false)?;
        let calibrated_name = "calibrated.toml";
        let calibrated_path = self.out.join(calibrated_name);
        let unseen = [(other_name.to_owned(), &other_poses)];
        let evidence = Evidence { robot: design, rig, dataset: &fitted_poses, fit: &fit, unseen: &unseen, max_rms_m: None };
        let assessment = Assessment::new(&evidence);
        if !write_calibrated(&calibrated_path, false, &design_source, &evidence, &assessment)? {
            return Err(RefusedError(assessment.reasons.join(" ")).into());
        }

        let board = put_on_board(&mut bench, &scene.truth, &open_robot(&calibrated_path.to_string_lossy())?)?;
        let names = files.iter().map(|(name, ..)| *name).chain([calibrated_name]);
        let names = names.chain([SUMMARY_NAME]).map(|name| self.out.join(name).display().to_string()).collect();
        let losses = bench.link.losses();
        let report = DemoReport::new(&scene, &fit, &other_poses, board, losses, names, &self.out);
        self.write_summary(&report.text())?;
        print(&report, self.output.json)?;
        Ok(Outcome::Good)
    }

    /// Makes the folder; one that holds other things than an earlier demo's is left alone.
    fn prepare_folder(&self) -> Result<(), CommandError> {
        let failed = |error| CommandError::output(FolderError { folder: self.out.clone(), error });
        std::fs::create_dir_all(&self.out).map_err(failed)?;
        let is_empty = std::fs::read_dir(&self.out).map_err(failed)?.next().is_none();
        if !is_empty && !self.out.join(SUMMARY_NAME).is_file() {
            return Err(ForeignFolderError { folder: self.out.clone() }.into());
        }
        self.write_summary("")
    }

    fn write_summary(&self, text: &str) -> Result<(), CommandError> {
        write_file(Output { path: &self.out.join(SUMMARY_NAME), kind: FileKind::DemoSummary, force: false }, text)
    }
}

/// What the board computes.
struct OnBoard {
    tool: Change,
    difference_um: f64,
}

/// Puts the calibrated robot on the board; the board's own poses against the true robot's, before and after.
fn put_on_board(bench: &mut Bench<'_>, truth: &Robot, calibrated: &Robot) -> Result<OnBoard, CommandError> {
    let upload = Upload::new(calibrated, Admission::Calibrated, BOARD_POSES).map_err(Remedied)?;
    let before_m = rms_kinematics(&mut bench.link, truth, BOARD_POSES.get())?;
    let uploaded = upload.put(&mut bench.link, &mut say_steps(BOARD_POSES)).map_err(Remedied)?;
    let after_m = rms_kinematics(&mut bench.link, truth, BOARD_POSES.get())?;
    Ok(OnBoard {
        tool: Change { before_mm: mm_from_m(before_m), after_mm: mm_from_m(after_m) },
        difference_um: uploaded.difference.position_m * 1e6,
    })
}

impl DemoReport {
    fn new(
        scene: &Scene,
        fit: &Fit,
        other: &Dataset,
        board: OnBoard,
        losses: StreamLosses,
        files: Vec<String>,
        folder: &Path,
    ) -> Self {
        let (Scene { design, truth, .. }, fitted) = (scene, &fit.solution.chain);
        let rms = |chain: &Chain<f64>| ResidualSummary::new(&residuals(&Kinematics::new(chain), other)).rms_m;
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
            board_tool: board.tool,
            board_difference_um: board.difference_um,
            losses,
            files,
            folder: folder.display().to_string(),
        }
    }
}

impl Report for DemoReport {
    fn text(&self) -> String {
        let mut text = format!(
            "A PUMA 560 whose controller believes the design parameters, while the arm has those that the paper found.\n\
             The board's firmware runs in this process, behind a serial port; {} lengths on 46 cm shells, from three chucks to three\n\
             spheres, each with {} mm of noise, came over it while the arm stood still: {}.\n\
             Fit {}: {} parameters identified.\n\n",
            self.poses,
            self.sigma_mm,
            match self.losses.lost() {
                0 => "nothing was lost".to_owned(),
                lost => format!("{lost} messages were LOST"),
            },
            self.status,
            self.free_parameters
        );
        let mut table = Columns::new(&["<", "design", "calibrated"]);
        let change = |change: &Change| [format!("{:.3} mm", change.before_mm), format!("{:.3} mm", change.after_mm)];
        let fitted = Change { before_mm: self.rms_initial_mm, after_mm: self.rms_mm };
        for (what, numbers) in [
            ("RMS of the lengths fitted, 46 cm shells", change(&fitted)),
            ("RMS of lengths never seen, 61 cm shells", change(&self.other_shells)),
            ("tool position error over the workspace, RMS", change(&self.tool)),
            ("tool position error over the workspace, largest", change(&self.tool_max)),
            ("the same, of poses that the board computes, RMS", change(&self.board_tool)),
        ] {
            table.row([what.to_owned()].into_iter().chain(numbers));
        }
        text += &table.text();
        text += &format!(
            "\nThe calibrated parameters are in the board's flash; its poses and this program's differ by {:.2} µm at most.\n",
            self.board_difference_um
        );
        text += &format!("\nLeft in {}: {}\n", one_line(&self.folder), one_line(&self.files.join(" ")));
        let at = |name: &str| quoted(&Path::new(&self.folder).join(name));
        let (design, rig, fitted, other, calibrated) =
            (at("design.toml"), at("rig.toml"), at("poses-460.csv"), at("poses-610.csv"), at("calibrated.toml"));
        text += &format!(
            "\nTry next (host-cal is target/release/host-cal, or on your path after `cargo install --path host/app`):\n  host-cal fit --robot {design} --rig {rig} {fitted}\n  host-cal validate --robot {calibrated} --rig {rig} {other}\n  \
             host-cal rank --robot {design} --rig {rig} {fitted} --pairings A:1\n  host-cal paper\n"
        );
        text
    }
}

/// A path as a shell takes it.
fn quoted(path: &Path) -> String {
    let text = shown_path(path);
    let is_plain = text.chars().all(|c| c.is_alphanumeric() || "/._-".contains(c));
    if is_plain { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
}
