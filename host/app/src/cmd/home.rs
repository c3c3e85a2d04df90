//! `host-cal home`: tell the board where the joints stand.

use ballbar::JointKind;
use clap::Args;
use serde::Serialize;

use super::inputs::{ListError, OutputArgs};
use super::outcome::{CommandError, Outcome};
use super::port::PortArgs;
use super::report::{Report, print, warn};
use crate::board::{HomeError, Homed, Homing};
use crate::files::open_robot;
use crate::remedies::Remedied;
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
        let homing = Homing::begin(&mut link).map_err(Remedied)?;
        // Of a value too many no kind is known; it is refused.
        let kinds = homing.kinds().iter().map(|&kind| ScreenUnit::from(kind)).chain(std::iter::repeat(ScreenUnit::One));
        let q: Vec<f64> = kinds.zip(&self.q).map(|(unit, &value)| unit.to_si(value)).collect();
        let Homed { kinds, counts, beyond_limits } = homing.at(&q, limits.as_ref()).map_err(home_error)?;
        let beyond_limits = beyond_limits.map(|joints| joints.iter().map(ToString::to_string).collect::<Vec<_>>());
        for beyond in beyond_limits.iter().flatten() {
            warn(&format!("{beyond}: is the robot really there?"));
        }
        print(&HomeReport { q: self.q.clone(), counts, beyond_limits, kinds }, self.output.json)?;
        Ok(Outcome::Good)
    }
}

fn home_error(error: HomeError) -> CommandError {
    match error {
        HomeError::Joints { found, expected } => ListError::JointValues { flag: "--q", found, expected }.into(),
        error => Remedied(error).into(),
    }
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
