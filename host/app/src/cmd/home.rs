//! `host-cal home`: tell the board where the joints stand.

use ballbar::wire::Command;
use ballbar::{JointKind, JointVector};
use ballbar_calib::model::Robot;
use clap::Args;
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::inputs::{ListError, OutputArgs};
use super::outcome::{CommandError, Outcome};
use super::port::{PortArgs, check_kinds};
use super::report::{Report, print, warn};
use crate::board::RobotOnBoard;
use crate::files::open_robot;
use crate::units::{ScreenUnit, joints_text};

/// Tell the board where the joints stand (its encoders count from there)
#[derive(Args)]
#[command(
    after_help = "Example:\n  host-cal home /dev/ttyUSB0 --q 0,-90,90,0,0,0 --robot design.toml\n\nAfter every start of the board its encoders know only how far they have moved. Drive the robot to a known posture, such as\nits marks or its nest, let it stand still, and give the joint values that its controller shows there."
)]
pub(super) struct HomeArgs {
    #[command(flatten)]
    port: PortArgs,
    /// Encoder outputs, separated by commas: degrees, or millimetres for a prismatic joint
    #[arg(long, value_delimiter = ',', allow_hyphen_values = true, required = true)]
    q: Vec<f64>,
    /// The robot, whose limits the values are held against: robot.toml, or a built-in
    #[arg(long)]
    robot: Option<String>,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Error, Diagnostic)]
enum HomeError {
    #[error("the board holds no parameters, so it does not know how its encoders count")]
    #[diagnostic(help("Upload a robot first: host-cal apply PORT --robot robot.toml"))]
    NoParameters,
    #[error("joint {joint}: {counts:.0} counts are more than the board can hold")]
    #[diagnostic(help("Is the value in degrees or millimetres? Nothing was changed."))]
    OutOfRange { joint: usize, counts: f64 },
}

#[derive(Serialize)]
struct HomeReport {
    q: Vec<f64>,
    counts: Vec<i32>,
    /// Joints beyond their limits, in words; none when the limits are not known.
    beyond_limits: Option<Vec<String>>,
    #[serde(skip)]
    kinds: Vec<JointKind>,
}

impl HomeArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        if let Some(value) = self.q.iter().find(|value| !value.is_finite()) {
            return Err(ListError::Number { flag: "--q", found: value.to_string(), expected: "finite numbers" }.into());
        }
        let limits = self.robot.as_deref().map(open_robot).transpose()?;
        let mut link = self.port.connect()?;
        let (robot, _) = RobotOnBoard::read(&mut link)?.ok_or(HomeError::NoParameters)?;
        let kinds = robot.kinds();
        if self.q.len() != kinds.len() {
            return Err(ListError::JointValues { flag: "--q", found: self.q.len(), expected: kinds.len() }.into());
        }
        let mut q = JointVector::zero();
        for ((place, &value), &kind) in q.as_array_mut().iter_mut().zip(&self.q).zip(kinds) {
            *place = ScreenUnit::from(kind).to_si(value);
        }
        let beyond_limits = match &limits {
            Some(limits) => Some(beyond_limits(limits, kinds, &q)?),
            None => None,
        };
        let counts = whole_counts(&robot.encoders().counts(&q)[..kinds.len()])?;
        for (joint, &counts) in counts.iter().enumerate() {
            link.act(Command::PresetEncoder { joint: joint as u8, counts })?;
        }
        for beyond in beyond_limits.iter().flatten() {
            warn(&format!("{beyond}: is the robot really there?"));
        }
        print(&HomeReport { q: self.q.clone(), counts, beyond_limits, kinds: kinds.to_vec() }, self.output.json)?;
        Ok(Outcome::Good)
    }
}

/// Joints beyond the limits of a robot, which has to be the board's.
fn beyond_limits(robot: &Robot, kinds: &[JointKind], q: &JointVector<f64>) -> Result<Vec<String>, CommandError> {
    check_kinds(robot, kinds)?;
    Ok(robot.beyond_limits(q.as_array()).map(|beyond| beyond.to_string()).collect())
}

fn whole_counts(counts: &[f64]) -> Result<Vec<i32>, HomeError> {
    let whole = |(i, &counts): (usize, &f64)| {
        let rounded = counts.round();
        let fits = (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&rounded);
        if fits { Ok(rounded as i32) } else { Err(HomeError::OutOfRange { joint: i + 1, counts }) }
    };
    counts.iter().enumerate().map(whole).collect()
}

impl Report for HomeReport {
    fn text(&self) -> String {
        let si: Vec<f64> = self.kinds.iter().zip(&self.q).map(|(&kind, &q)| ScreenUnit::from(kind).to_si(q)).collect();
        let limits = match self.beyond_limits.as_deref() {
            None => "joint limits are not known without --robot",
            Some([]) => "all joints are within their limits",
            Some(_) => "joints are BEYOND THEIR LIMITS",
        };
        format!("homed at {}\nencoders at {:?} counts\n{limits}\n", joints_text(&self.kinds, &si), self.counts)
    }
}
