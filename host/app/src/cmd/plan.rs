//! `host-cal plan`: which poses to measure, and the way between them.

use std::path::{Path, PathBuf};
use std::time::Instant;

use ballbar_calib::model::{Rig, Robot};
use ballbar_calib::plan::{Cell, CheckFound, Grid, Margins, Pace, PlanOptions, PlanRow, Progress, Stage, check, plan};
use clap::Args;
use indicatif::ProgressBar;

use super::inputs::{ForceArgs, ListError, OutputArgs};
use super::outcome::{CommandError, Outcome};
use super::pairings::parse_pairings;
use super::plan_report::warnings;
use super::report::{print, warn, write_file};
use crate::documents::{CheckDocument, Least, PlanDocument};
use crate::files::{FileKind, Output, Source, open_rig, open_robot, read_plan, write_plan};
use crate::remedies::Remedied;
use crate::terminal::progress;
use crate::units::{m_from_mm, mm_from_m};

/// Plan poses on hemispherical shells, and collision-free ways between them
#[derive(Args)]
#[command(after_help = "Examples:
  host-cal plan --robot puma560 --rig triangles --out plan.csv
  host-cal plan --robot puma560 --rig triangles --bar 460 --pairings A:1,B:2,C:3 \\
           --optimal 120 --out plan.csv
  host-cal plan --robot puma560 --rig triangles --check plan.csv

Sizes of links, bar and fixtures are those of the rig's [solids] table (docs/files.md).")]
pub(super) struct PlanArgs {
    /// The robot as its controller believes it to be: robot.toml, or a built-in
    #[arg(long)]
    robot: String,
    /// rig.toml, or the built-in: triangles
    #[arg(long)]
    rig: String,
    /// Bar lengths at mid travel, millimetres; the rig's when not given
    #[arg(long, value_delimiter = ',', value_name = "MM,…", allow_hyphen_values = true)]
    bar: Vec<f64>,
    /// Pairings, chuck:sphere separated by commas; all when not given
    #[arg(long, value_name = "A:1,B:2,…")]
    pairings: Option<String>,
    /// Poses on each pairing's shell, for each bar length
    #[arg(long, default_value_t = 90, allow_hyphen_values = true, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    per_pair: u32,
    /// Latitudes of the grid; longitudes are as many as --per-pair needs, more where some cannot be reached
    #[arg(long, value_delimiter = ',', value_name = "DEG,…", default_value = "15,30,45,60,75", allow_hyphen_values = true)]
    latitudes_deg: Vec<f64>,
    /// Choose the N poses that identify best, instead of all points
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    optimal: Option<u32>,
    #[command(flatten)]
    margins: MarginArgs,
    #[command(flatten)]
    pace: PaceArgs,
    /// The same seed gives the same plan
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Write the plan to this file; without it only the summary is printed, with --json the rows too
    #[arg(long, value_name = "FILE", conflicts_with = "check")]
    out: Option<PathBuf>,
    /// Make no plan, but look at this one once more
    #[arg(long, value_name = "FILE", conflicts_with_all = ["bar", "pairings", "per_pair", "latitudes_deg", "optimal"])]
    check: Option<PathBuf>,
    #[command(flatten)]
    replace: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Args)]
struct MarginArgs {
    /// Left to the limits of revolute joints
    #[arg(long, value_name = "DEG", default_value_t = 3.0, allow_hyphen_values = true)]
    limit_margin_deg: f64,
    /// Left to the limits of prismatic joints
    #[arg(long, value_name = "MM", default_value_t = 5.0, allow_hyphen_values = true)]
    limit_margin_mm: f64,
    /// Left of the bar's travel at either end, even for robots that are plausibly not nominal
    #[arg(long, value_name = "MM", default_value_t = 8.0, allow_hyphen_values = true)]
    travel_margin_mm: f64,
    /// Left between any two solids
    #[arg(long, value_name = "MM", default_value_t = 10.0, allow_hyphen_values = true)]
    clearance_mm: f64,
    /// Smallest singular value of the tool's Jacobian at measured poses, lengths divided by the arm's
    #[arg(long, value_name = "RATIO", default_value_t = 0.03, allow_hyphen_values = true)]
    singularity_margin: f64,
}

#[derive(Args)]
struct PaceArgs {
    /// Speed of revolute joints, for the expected duration and the order of poses
    #[arg(long, value_name = "DEG/S", default_value_t = 30.0, allow_hyphen_values = true)]
    speed_deg_s: f64,
    /// Speed of prismatic joints
    #[arg(long, value_name = "MM/S", default_value_t = 100.0, allow_hyphen_values = true)]
    speed_mm_s: f64,
    /// Standing still at each measured pose
    #[arg(long, value_name = "S", default_value_t = 2.0, allow_hyphen_values = true)]
    settle_s: f64,
}

impl PlanArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let margins = self.margins.read()?;
        let pace = self.pace.read()?;
        let robot = open_robot(&self.robot)?;
        let rig = open_rig(&self.rig)?;
        let travel_m = rig.bar.as_ref().ok_or(ListError::NoTravel)?.travel_m;
        if travel_m / 2.0 <= margins.travel_m {
            let expected = "less than half of the bar's travel";
            return Err(number("--travel-margin-mm", mm_from_m(margins.travel_m), expected).into());
        }
        match &self.check {
            Some(path) => self.look_again(&robot, &rig, travel_m, margins, pace, &Source::read_rows(path)?),
            None => self.plan(&robot, &rig, travel_m, margins, pace),
        }
    }

    fn plan(&self, robot: &Robot, rig: &Rig, travel_m: f64, margins: Margins, pace: Pace) -> Result<Outcome, CommandError> {
        let options = PlanOptions {
            pairings: self.pairings.as_ref().map_or_else(|| Ok(rig.all_pairings()), |list| parse_pairings(list, rig))?,
            bars_m: self.bars_m(rig)?,
            travel_m,
            grid: self.grid()?,
            poses_per_shell: self.per_pair as usize,
            optimal: self.optimal.map(|wanted| wanted as usize),
            margins,
            pace,
            seed: self.seed,
        };
        if let Some(path) = &self.out {
            self.output_to(path).check().map_err(CommandError::not_written)?;
        }
        let start = Instant::now();
        let bar = progress(1, "planning");
        let plan = plan(robot, rig, &options, &|now| show(&bar, now));
        bar.finish_and_clear();
        let plan = plan.map_err(Remedied)?;
        let planning_s = start.elapsed().as_secs_f64();
        let found = self.checked(robot, rig, travel_m, margins, pace, &plan.rows)?;

        if let Some(path) = &self.out {
            write_file(self.output_to(path), &write_plan(robot, rig, &plan.rows))?;
        }
        let mut report = PlanDocument::new(robot, rig, &options, &plan, &found, planning_s, self.out.as_deref());
        report.warnings = warnings(robot, rig, &plan, &report);
        for warning in &report.warnings {
            warn(warning);
        }
        print(&report, self.output.json)?;
        Ok(if report.warnings.is_empty() { Outcome::Good } else { Outcome::Doubtful })
    }

    fn output_to<'a>(&self, path: &'a Path) -> Output<'a> {
        Output { path, kind: FileKind::Plan, force: self.replace.force }
    }

    fn look_again(
        &self,
        robot: &Robot,
        rig: &Rig,
        travel_m: f64,
        margins: Margins,
        pace: Pace,
        source: &Source,
    ) -> Result<Outcome, CommandError> {
        let rows = read_plan(source, robot, rig)?;
        let found = self.checked(robot, rig, travel_m, margins, pace, &rows)?;
        let report = CheckDocument::new(source.name(), robot, &rows, Least::new(robot, &found), &margins);
        print(&report, self.output.json)?;
        Ok(if report.is_kept { Outcome::Good } else { Outcome::Doubtful })
    }

    /// Margins as fine steps and many plausible robots show them.
    fn checked(
        &self,
        robot: &Robot,
        rig: &Rig,
        travel_m: f64,
        margins: Margins,
        pace: Pace,
        rows: &[PlanRow],
    ) -> Result<CheckFound, CommandError> {
        const STEP: f64 = 0.01;
        const ROBOTS: usize = 1000;
        let cell = Cell::new(robot, rig, travel_m, margins, pace).map_err(Remedied)?;
        let bar = progress(1, "checking");
        let found = check(&cell, rows, STEP, ROBOTS, self.seed.wrapping_add(1), &|now| show(&bar, now));
        bar.finish_and_clear();
        Ok(found)
    }

    fn bars_m(&self, rig: &Rig) -> Result<Vec<f64>, CommandError> {
        if let Some(bar) = self.bar.iter().find(|&&mm| !(mm > 0.0 && mm <= 1e6)) {
            return Err(number("--bar", *bar, "a number above 0, at most 1e6").into());
        }
        no_repeats("--bar", &self.bar)?;
        if !self.bar.is_empty() {
            return Ok(self.bar.iter().map(|&mm| m_from_mm(mm)).collect());
        }
        Ok(rig.bar.as_ref().ok_or(ListError::NoBar)?.lengths_m.clone())
    }

    fn grid(&self) -> Result<Grid, CommandError> {
        if let Some(latitude) = self.latitudes_deg.iter().find(|&&deg| !(0.0..=90.0).contains(&deg)) {
            return Err(number("--latitudes-deg", *latitude, "numbers from 0 to 90").into());
        }
        no_repeats("--latitudes-deg", &self.latitudes_deg)?;
        Ok(Grid::of(&self.latitudes_deg, self.per_pair as usize))
    }
}

impl MarginArgs {
    fn read(&self) -> Result<Margins, CommandError> {
        let checked = |flag, value: f64, most: f64, expected| {
            if (0.0..=most).contains(&value) { Ok(value) } else { Err(number(flag, value, expected)) }
        };
        Ok(Margins {
            limit_rad: checked("--limit-margin-deg", self.limit_margin_deg, 180.0, "a number from 0 to 180")?.to_radians(),
            limit_m: m_from_mm(checked("--limit-margin-mm", self.limit_margin_mm, 1e6, "a number from 0 to 1e6")?),
            travel_m: m_from_mm(checked("--travel-margin-mm", self.travel_margin_mm, 1e6, "a number from 0 to 1e6")?),
            clearance_m: m_from_mm(checked("--clearance-mm", self.clearance_mm, 1e6, "a number from 0 to 1e6")?),
            singularity: checked("--singularity-margin", self.singularity_margin, 1.0, "a number from 0 to 1")?,
        })
    }
}

impl PaceArgs {
    fn read(&self) -> Result<Pace, CommandError> {
        let speed = |flag, value: f64| {
            if value > 0.0 && value <= 1e6 { Ok(value) } else { Err(number(flag, value, "a number above 0, at most 1e6")) }
        };
        if !(0.0..=3600.0).contains(&self.settle_s) {
            return Err(number("--settle-s", self.settle_s, "a number from 0 to 3600").into());
        }
        Ok(Pace {
            turn_rad_s: speed("--speed-deg-s", self.speed_deg_s)?.to_radians(),
            slide_m_s: m_from_mm(speed("--speed-mm-s", self.speed_mm_s)?),
            settle_s: self.settle_s,
        })
    }
}

/// A bar for each stage, with the stage's number and name.
fn show(bar: &ProgressBar, now: Progress) {
    if now.done == 0 {
        bar.set_length(now.total as u64);
        bar.set_message(format!("{}/{} {}", now.stage as usize + 1, Stage::ALL.len(), now.stage));
        bar.reset();
    }
    bar.set_position(now.done as u64);
}

fn no_repeats(flag: &'static str, numbers: &[f64]) -> Result<(), ListError> {
    let is_repeated = |(i, number): &(usize, &f64)| numbers[..*i].contains(number);
    match numbers.iter().enumerate().find(is_repeated) {
        Some((_, &found)) => Err(ListError::Repeated { flag, found }),
        None => Ok(()),
    }
}

fn number(flag: &'static str, found: f64, expected: &'static str) -> ListError {
    ListError::Number { flag, found: found.to_string(), expected }
}
