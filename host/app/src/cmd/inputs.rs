//! Arguments that several commands share, and reading what they name.

use std::path::PathBuf;

use ballbar_calib::model::{Dataset, HeldOut, Rig, Robot};
use clap::Args;
use miette::Diagnostic;
use thiserror::Error;

use super::exclude::Exclude;
use super::hold_out::HoldOut;
use super::outcome::CommandError;
use super::report::warn;
use crate::files::Source;
use crate::session::{MeasuredInputs, Named};

/// `--json`.
#[derive(Args)]
pub(super) struct OutputArgs {
    /// Print one JSON document instead of text
    #[arg(long)]
    pub(super) json: bool,
}

/// `--force`.
#[derive(Args)]
pub(super) struct ForceArgs {
    /// Write even where a file of another kind stands; never over an input, a recording or a session's file
    #[arg(long)]
    pub(super) force: bool,
}

/// A robot, a rig and files of poses.
#[derive(Args)]
pub(super) struct MeasuredArgs {
    /// robot.toml, or a built-in: puma560, puma560-optimised, irb120, ur5e, stanford, scara; a session's when not given
    #[arg(long)]
    robot: Option<String>,
    /// rig.toml, or the built-in: triangles; a session's when not given
    #[arg(long)]
    rig: Option<String>,
    /// Keep poses apart: bar=610, pairing=A:1 or set=NAME, several separated by commas. `fit` and `rank` take the others, `validate`
    /// takes these, `report` shows how well a fit to the others predicts these
    #[arg(long, value_name = "KEY=VALUE,…")]
    hold_out: Option<HoldOut>,
    /// Leave these rows out: numbers from 1 over all files, and ranges of them, as in 12,40-45
    #[arg(long, value_name = "ROW,…")]
    exclude: Option<Exclude>,
    /// Files of measured poses (poses.csv), or sessions
    #[arg(required = true, value_name = "SESSION|POSES")]
    poses: Vec<PathBuf>,
}

/// What the arguments named.
pub(super) struct Measured {
    pub(super) robot: Robot,
    /// Its text.
    pub(super) robot_source: Source,
    pub(super) rig: Rig,
    /// The rig's file, or built-in name.
    pub(super) rig_name: String,
    pub(super) dataset: Dataset,
    /// Poses that `--hold-out` keeps apart.
    pub(super) held_out: Option<(HoldOut, Dataset)>,
    /// Rows that may be mistakes, in words.
    pub(super) warnings: Vec<String>,
}

impl Measured {
    /// The poses kept apart, and what to call them.
    pub(super) fn unseen(&self) -> Option<(String, &Dataset)> {
        self.held_out.as_ref().map(|(rule, rows)| (format!("poses held out ({rule})"), rows))
    }
}

impl MeasuredArgs {
    /// Reads the files and says on stderr what may be wrong with them.
    pub(super) fn read(&self) -> Result<Measured, CommandError> {
        let named = Named { robot: self.robot.as_deref(), rig: self.rig.as_deref(), poses: &self.poses };
        let MeasuredInputs { robot, robot_source, rig, rig_name, dataset } = named.read()?;
        let warnings = dataset.warning_sentences(&robot, &rig);
        for warning in &warnings {
            warn(warning);
        }
        let dataset = match &self.exclude {
            None => dataset,
            Some(rows) => rows.others(dataset)?,
        };
        let (held_out, dataset) = match &self.hold_out {
            None => (None, dataset),
            Some(rule) => {
                let HeldOut { apart, others } = rule.split(dataset, &rig)?;
                (Some((rule.clone(), apart)), others)
            }
        };
        Ok(Measured { robot, robot_source, rig, rig_name, dataset, held_out, warnings })
    }
}

/// Refuses a robot whose joints have terms, where they would be left out.
pub(super) fn refuse_terms(robot: &Robot, command: &'static str) -> Result<(), ListError> {
    if robot.terms.are_zero() { Ok(()) } else { Err(ListError::JointTerms { robot: robot.source.clone(), command }) }
}

/// Whether `--max-rms-mm` can be a limit.
pub(super) fn check_max_rms_mm(limit: Option<f64>) -> Result<(), ListError> {
    match limit.filter(|&limit| limit.is_nan() || limit <= 0.0) {
        Some(limit) => Err(ListError::Number { flag: "--max-rms-mm", found: limit.to_string(), expected: "a number above zero" }),
        None => Ok(()),
    }
}

/// Why a list on the command line cannot be used.
#[derive(Debug, Error, Diagnostic)]
pub(super) enum ListError {
    /// No pose has one of these pairings.
    #[error("no pose has one of the pairings {0}")]
    #[diagnostic(help("The poses have {1}."))]
    NoPoseLeft(String, String),
    /// Joint terms where they would be left out.
    #[error("{robot}: its joints have terms, which `host-cal {command}` would leave out")]
    #[diagnostic(help(
        "Take eccentricity, compliance and backlash out of a copy of the file. docs/files.md says which commands know them."
    ))]
    JointTerms {
        /// The file.
        robot: String,
        /// The command.
        command: &'static str,
    },
    /// No bar length to simulate.
    #[error("the rig names no bar length")]
    #[diagnostic(help("Give one, in millimetres: --bar 460"))]
    NoBar,
    /// No travel to plan for.
    #[error("the rig does not say how far the bar travels")]
    #[diagnostic(help("Add to the rig's file, in millimetres: [bar] with lengths_mm = [460.0] and travel_mm = 75.0"))]
    NoTravel,
    /// A number that is there twice.
    #[error("{flag} has {found} twice")]
    Repeated {
        /// The flag.
        flag: &'static str,
        /// What is there twice.
        found: f64,
    },
    /// A number that has to be above zero, or not below.
    #[error("{flag} is {found}, expected {expected}")]
    Number {
        /// The flag.
        flag: &'static str,
        /// What was given.
        found: String,
        /// What may be given.
        expected: &'static str,
    },
    /// Joint values, more or fewer than joints.
    #[error("{flag} has {found} values, but the robot has {expected} joints")]
    #[diagnostic(help("Give one value a joint, in degrees, or millimetres for a prismatic joint: {flag} 10,20,…"))]
    JointValues {
        /// The flag.
        flag: &'static str,
        /// Values given.
        found: usize,
        /// Joints of the robot.
        expected: usize,
    },
}
