//! `host-cal simulate`: lengths that a robot would give on hemispherical shells.

use std::path::PathBuf;

use ballbar_calib::model::{PairingId, PoseRow, Rig, Robot};
use ballbar_calib::simulate::{ShellPose, Shells};
use clap::Args;
use serde::Serialize;

use super::inputs::{ForceArgs, ListError, OutputArgs};
use super::outcome::{CommandError, Outcome};
use super::pairings::parse_pairings;
use super::report::{Report, print, write_file};
use crate::files::{FileKind, Output, open_rig, open_robot, write_poses};
use crate::remedies::Remedied;
use crate::terminal::progress;
use crate::text::one_line;
use crate::units::{ScreenUnit, m_from_mm, mm_from_m};

/// Simulate lengths on the hemispherical shells of the chosen pairings
#[derive(Args)]
#[command(after_help = "Examples:
  host-cal simulate --robot puma560-optimised --plan-robot puma560 --rig triangles --bar 460 \\
           --per-pair 90 --sigma-mm 0.084 --seed 7 --out poses.csv
  host-cal simulate --robot ur5e --rig triangles --bar 460,610 --pairings A:1,B:2,C:3

Poses keep the robot's joint limits and the bar's travel. Without --out they go to stdout.")]
pub(super) struct SimulateArgs {
    /// The true robot: robot.toml, or a built-in
    #[arg(long)]
    robot: String,
    /// The robot that the poses are planned with, when its controller believes other parameters
    #[arg(long)]
    plan_robot: Option<String>,
    /// rig.toml, or the built-in: triangles
    #[arg(long)]
    rig: String,
    /// Bar lengths at mid travel, millimetres; the rig's when not given
    #[arg(long, value_delimiter = ',', value_name = "MM,…", allow_hyphen_values = true)]
    bar: Vec<f64>,
    /// Pairings, chuck:sphere separated by commas; all when not given
    #[arg(long, value_name = "A:1,B:2,…")]
    pairings: Option<String>,
    /// Poses on each pairing's shell
    #[arg(long, default_value_t = 90, allow_hyphen_values = true, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    per_pair: u32,
    /// Standard deviation of the lengths' noise, millimetres
    #[arg(long, default_value_t = 0.0, value_name = "MM", allow_hyphen_values = true)]
    sigma_mm: f64,
    /// The same seed gives the same poses and noise
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Write the poses to this file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    replace: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct SimulateReport {
    robot: String,
    planned_with: String,
    bar_mm: Vec<f64>,
    pairings: Vec<String>,
    per_pairing: usize,
    sigma_mm: f64,
    seed: u64,
    poses: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    out: Option<String>,
    /// The poses themselves, unless they went to a file.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    rows: Vec<RowLine>,
    #[serde(skip)]
    csv: String,
}

#[derive(Serialize)]
struct RowLine {
    chuck: String,
    sphere: String,
    /// Degrees, or millimetres for a prismatic joint.
    q: Vec<f64>,
    length_mm: f64,
    bar_mm: String,
    latitude_deg: f64,
    longitude_deg: f64,
}

impl SimulateArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let truth = open_robot(&self.robot)?;
        let planned_with = self.plan_robot.as_deref().map_or_else(|| Ok(truth.clone()), open_robot)?;
        let rig = open_rig(&self.rig)?;
        let report = self.simulate(&truth, &planned_with, &rig)?;
        if let Some(path) = &self.out {
            write_file(Output { path, kind: FileKind::Poses, force: self.replace.force }, &report.csv)?;
        }
        print(&report, self.output.json)?;
        Ok(Outcome::Good)
    }

    fn simulate(&self, truth: &Robot, planned_with: &Robot, rig: &Rig) -> Result<SimulateReport, CommandError> {
        let pairings = self.pairings.as_ref().map_or_else(|| Ok(rig.all_pairings()), |list| parse_pairings(list, rig))?;
        let bar_mm = self.bar_mm(rig)?;
        self.check(truth, planned_with)?;

        let bar = progress((bar_mm.len() * pairings.len()) as u64 * u64::from(self.per_pair), "simulating poses");
        let mut poses = Vec::new();
        for (i, &bar_mm) in bar_mm.iter().enumerate() {
            let shells = Shells {
                planned_with,
                truth,
                rig,
                pairings: &pairings,
                bar_m: m_from_mm(bar_mm),
                per_pairing: self.per_pair as usize,
                sigma_m: m_from_mm(self.sigma_mm),
                seed: self.seed.wrapping_add(i as u64),
            };
            poses.extend(shells.simulate(|| bar.inc(1)).map_err(Remedied)?);
        }
        bar.finish_and_clear();
        let rows: Vec<PoseRow> = poses.iter().map(|pose| pose.row.clone()).collect();
        Ok(SimulateReport {
            robot: truth.name.clone(),
            planned_with: planned_with.name.clone(),
            bar_mm,
            pairings: pairings.iter().map(|&pairing: &PairingId| rig.pairing_name(pairing)).collect(),
            per_pairing: self.per_pair as usize,
            sigma_mm: self.sigma_mm,
            seed: self.seed,
            poses: poses.len(),
            out: self.out.as_ref().map(|path| path.display().to_string()),
            rows: if self.out.is_some() { Vec::new() } else { poses.iter().map(|pose| row_line(pose, truth, rig)).collect() },
            csv: write_poses(truth, rig, &rows),
        })
    }

    fn bar_mm(&self, rig: &Rig) -> Result<Vec<f64>, CommandError> {
        if !self.bar.is_empty() {
            return Ok(self.bar.clone());
        }
        let bar = rig.bar.as_ref().ok_or(ListError::NoBar)?;
        Ok(bar.lengths_m.iter().map(|&m| mm_from_m(m)).collect())
    }

    fn check(&self, truth: &Robot, planned_with: &Robot) -> Result<(), CommandError> {
        let refuse = |flag, found: String, expected| Err(ListError::Number { flag, found, expected }.into());
        if let Some(bar) = self.bar.iter().find(|&&mm| !(mm > 0.0 && mm <= 1e6)) {
            return refuse("--bar", bar.to_string(), "a number above 0, at most 1e6");
        }
        if !(0.0..=1e6).contains(&self.sigma_mm) {
            return refuse("--sigma-mm", self.sigma_mm.to_string(), "a number from 0 to 1e6");
        }
        if truth.chain.joint_kinds() != planned_with.chain.joint_kinds() {
            return refuse("--plan-robot", planned_with.name.clone(), "a robot with the same joints as --robot");
        }
        Ok(())
    }
}

fn row_line(pose: &ShellPose, robot: &Robot, rig: &Rig) -> RowLine {
    let row = &pose.row;
    let q = robot.chain.joint_kinds().iter().zip(row.measurement.q.as_array());
    RowLine {
        chuck: rig.chucks[row.pairing.chuck].name.clone(),
        sphere: rig.spheres[row.pairing.sphere].name.clone(),
        q: q.map(|(&kind, &q)| ScreenUnit::from(kind).from_si(q)).collect(),
        length_mm: mm_from_m(row.measurement.length_m),
        bar_mm: row.set.clone().unwrap_or_default(),
        latitude_deg: pose.latitude_rad.to_degrees(),
        longitude_deg: pose.longitude_rad.to_degrees(),
    }
}

impl Report for SimulateReport {
    fn is_document(&self) -> bool {
        self.out.is_none()
    }

    fn text(&self) -> String {
        match &self.out {
            Some(out) => format!(
                "{} poses of {} on {} shells, to {}\n",
                self.poses,
                one_line(&self.robot),
                self.pairings.len() * self.bar_mm.len(),
                one_line(out)
            ),
            None => self.csv.clone(),
        }
    }
}
