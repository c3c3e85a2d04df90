//! `host-cal export`: a robot in the formats of others.

use std::path::PathBuf;

use ballbar_calib::kinematics::NearlyParallel;
use ballbar_calib::model::{CalibrationVerdict, Standing};
use clap::{Args, ValueEnum};
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::inputs::{ForceArgs, OutputArgs, refuse_terms};
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print, warn, write_file};
use crate::export::{Format, JointZero, export};
use crate::files::{Output, open_robot};
use crate::text::{one_line, shown_path};
use crate::units::mm_from_m;

/// Write a robot as URDF, DH table, data or source code
#[derive(Args)]
#[command(
    after_help = "Example:\n  host-cal export --robot calibrated.toml --format urdf --out calibrated.urdf\n\nFormats:\n  urdf        robot description of ROS; metres and radians\n  ros2        ROS 2 parameter file with the URDF as robot_description\n  dh, mdh     Denavit-Hartenberg table, standard or modified (Craig), CSV; millimetres and degrees\n  json, yaml  links, joints and limits; metres and radians\n  csv         parameters and limits; millimetres and degrees\n  c, rust     constants for firmware; metres and radians\n  octave      MATLAB or Octave function of the tool's pose; metres and radians"
)]
pub(super) struct ExportArgs {
    /// robot.toml, or a built-in: puma560, puma560-optimised, irb120, ur5e, stanford, scara
    #[arg(long)]
    robot: String,
    /// What to write it as: urdf, ros2, dh, mdh, json, yaml, csv, c, rust, octave
    #[arg(long, value_enum, hide_possible_values = true)]
    format: Format,
    /// Where the joint values of a URDF are zero: `model`, offset + scale * encoder output; or `encoder`, scale * encoder output, with
    /// the offsets in the origins [default: model]
    #[arg(long, value_enum, hide_possible_values = true, value_name = "WHERE")]
    joint_zero: Option<JointZero>,
    /// File to write; printed when not given
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    replace: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Error, Diagnostic)]
#[error("--joint-zero is only for formats with a URDF")]
#[diagnostic(help("The other formats hold offset and scale: leave it out, or take --format urdf or --format ros2."))]
struct NoUrdf;

#[derive(Serialize)]
struct ExportReport {
    robot: String,
    format: String,
    #[serde(skip)]
    standing: Standing,
    calibrated: bool,
    /// Of the fit that wrote the robot's file.
    #[serde(skip_serializing_if = "Option::is_none")]
    verdict: Option<CalibrationVerdict>,
    #[serde(skip_serializing_if = "Option::is_none")]
    out: Option<PathBuf>,
    /// The file, where it was not written.
    #[serde(skip_serializing_if = "Option::is_none")]
    text: Option<String>,
    /// Of a format with another model than the robot's.
    #[serde(skip_serializing_if = "Option::is_none")]
    largest_difference_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    largest_difference_deg: Option<f64>,
    /// Of DH tables.
    #[serde(skip_serializing_if = "Option::is_none")]
    nearly_parallel: Option<Vec<NearlyParallelReport>>,
    warnings: Vec<String>,
}

#[derive(Serialize)]
struct NearlyParallelReport {
    /// Numbers of the two joints, from 1.
    joints: [usize; 2],
    angle_deg: f64,
}

impl ExportArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        if self.joint_zero.is_some() && !matches!(self.format, Format::Urdf | Format::Ros2) {
            return Err(NoUrdf.into());
        }
        let robot = open_robot(&self.robot)?;
        refuse_terms(&robot, "export")?;
        let exported = export(&robot, self.format, self.joint_zero.unwrap_or_default())?;
        for remark in &exported.remarks {
            warn(remark);
        }
        if let Some(path) = &self.out {
            write_file(Output { path, kind: self.format.kind(), force: self.replace.force }, &exported.text)?;
        }
        let report = ExportReport {
            robot: robot.name.clone(),
            format: self.format.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned()),
            standing: robot.standing(),
            calibrated: robot.standing().is_calibrated(),
            verdict: robot.verdict(),
            out: self.out.clone(),
            text: self.out.is_none().then_some(exported.text),
            largest_difference_mm: exported.largest_difference.map(|(off_m, _)| mm_from_m(off_m)),
            largest_difference_deg: exported.largest_difference.map(|(_, turned_rad)| turned_rad.to_degrees()),
            nearly_parallel: exported.largest_difference.map(|_| exported.nearly_parallel.iter().map(pair).collect()),
            warnings: exported.remarks,
        };
        print(&report, self.output.json)?;
        Ok(Outcome::Good)
    }
}

fn pair(pair: &NearlyParallel) -> NearlyParallelReport {
    NearlyParallelReport { joints: [pair.joint, pair.joint + 1], angle_deg: pair.angle_rad.to_degrees() }
}

impl Report for ExportReport {
    fn is_document(&self) -> bool {
        self.text.is_some()
    }

    fn text(&self) -> String {
        if let Some(text) = &self.text {
            return text.clone();
        }
        let out = self.out.as_deref().map_or_else(String::new, shown_path);
        let mut text = format!("{} ({}) is written to {out}\n", one_line(&self.robot), self.standing);
        if let (Some(mm), Some(deg)) = (self.largest_difference_mm, self.largest_difference_deg) {
            text += &format!("largest difference to the robot over random joint vectors: {mm:.1e} mm, {deg:.1e} degrees\n");
        }
        text
    }
}
