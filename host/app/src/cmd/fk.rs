//! `host-cal fk`: where the tool is.

use ballbar_calib::kinematics::link_angles;
use ballbar_calib::model::Robot;
use clap::Args;
use serde::Serialize;

use super::inputs::{ListError, OutputArgs};
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print, warn};
use crate::files::open_robot;
use crate::units::{ScreenUnit, mm_from_m};

/// Pose of the tool at given joint values (forward kinematics)
#[derive(Args)]
#[command(after_help = "Example:\n  host-cal fk --robot puma560 --q 10,-40,100,20,-30,50")]
pub(super) struct FkArgs {
    /// robot.toml, or a built-in: puma560, puma560-optimised, irb120, ur5e, stanford, scara
    #[arg(long)]
    robot: String,
    /// Encoder outputs, separated by commas: degrees, or millimetres for a prismatic joint
    #[arg(long, value_delimiter = ',', allow_hyphen_values = true, required = true)]
    q: Vec<f64>,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct FkReport {
    position_mm: [f64; 3],
    /// Rows; base from tool.
    rotation: [[f64; 3]; 3],
    /// The same rotation as a link's angles: Rz(alpha) · Ry(beta) · Rx(gamma).
    alpha_beta_gamma_deg: [f64; 3],
    /// Joints beyond their limits, in words.
    warnings: Vec<String>,
}

impl FkArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let robot = open_robot(&self.robot)?;
        let report = self.report(&robot)?;
        print(&report, self.output.json)?;
        Ok(Outcome::Good)
    }

    fn report(&self, robot: &Robot) -> Result<FkReport, CommandError> {
        if let Some(value) = self.q.iter().find(|value| !value.is_finite()) {
            return Err(ListError::Number { flag: "--q", found: value.to_string(), expected: "finite numbers" }.into());
        }
        let kinds = robot.chain.joint_kinds();
        let q: Vec<f64> = self.q.iter().zip(kinds).map(|(&q, &kind)| ScreenUnit::from(kind).to_si(q)).collect();
        let wrong_count = ListError::JointValues { flag: "--q", found: self.q.len(), expected: kinds.len() };
        if self.q.len() != kinds.len() {
            return Err(wrong_count.into());
        }
        let warnings: Vec<String> = robot.beyond_limits(&q).map(|beyond| beyond.to_string()).collect();
        for warning in &warnings {
            warn(warning);
        }
        let q = robot.chain.joint_vector(&q).map_err(|_| wrong_count)?;
        let base_from_tool = robot.kinematics().base_from_tool(&q);
        let r = base_from_tool.rotation;
        Ok(FkReport {
            position_mm: base_from_tool.translation_m.map(|m| positive_zero(mm_from_m(m))).into(),
            rotation: std::array::from_fn(|i| std::array::from_fn(|j| positive_zero(r[(i, j)]))),
            alpha_beta_gamma_deg: link_angles(&r).map(|angle| positive_zero(angle.to_degrees())),
            warnings,
        })
    }
}

/// Zero without a sign, and what would be printed as a signed zero.
fn positive_zero(value: f64) -> f64 {
    if value.abs() < 5e-13 { 0.0 } else { value }
}

impl Report for FkReport {
    fn text(&self) -> String {
        let [x, y, z] = self.position_mm;
        let [alpha, beta, gamma] = self.alpha_beta_gamma_deg;
        let mut text = format!("position of the tool in the base frame, mm\n  {x:12.6} {y:12.6} {z:12.6}\n");
        text += "rotation from the tool's axes to the base's\n";
        for [a, b, c] in self.rotation {
            text += &format!("  {a:12.9} {b:12.9} {c:12.9}\n");
        }
        text + &format!("as alpha (z), beta (y), gamma (x), deg\n  {alpha:12.6} {beta:12.6} {gamma:12.6}\n")
    }
}
