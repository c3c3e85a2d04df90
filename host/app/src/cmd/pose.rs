//! `host-cal pose`: where the board says the tool is.

use ballbar::wire::CurrentPose;
use ballbar::{JointKind, Vector3};
use clap::Args;
use serde::Serialize;

use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome};
use super::port::PortArgs;
use super::report::{Report, print, warn};
use crate::board::{RobotOnBoard, current_pose};
use crate::text::one_line;
use crate::units::{ScreenUnit, joints_text, mm_from_m};

/// The tool's true pose now, as the board computes it
#[derive(Args)]
#[command(after_help = "Example:\n  host-cal pose /dev/ttyUSB0")]
pub(super) struct PoseArgs {
    #[command(flatten)]
    port: PortArgs,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct PoseReport {
    position_mm: [f64; 3],
    /// Rows; base from tool.
    rotation: [[f64; 3]; 3],
    /// Degrees or millimetres.
    q: Vec<f64>,
    /// From mid travel; none when the bar is off or beyond its travel.
    displacement_mm: Option<f64>,
    homed: bool,
    robot: String,
    calibrated: bool,
    t_s: f64,
    #[serde(skip)]
    kinds: Vec<JointKind>,
}

impl PoseArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let mut link = self.port.connect()?;
        let (pose, robot) = current_pose(&mut link)?;
        let report = PoseReport::new(&pose, &robot);
        if !report.homed {
            warn("not every encoder is homed since the board started: the pose means little. host-cal home PORT --q …");
        }
        print(&report, self.output.json)?;
        Ok(if report.homed { Outcome::Good } else { Outcome::Doubtful })
    }
}

impl PoseReport {
    fn new(pose: &CurrentPose, robot: &RobotOnBoard) -> Self {
        let wide = |v: [f32; 3]| Vector3::from(v.map(f64::from));
        let (x, y) = (wide(pose.pose.x_axis), wide(pose.pose.y_axis));
        let z = x.cross(&y);
        let kinds = robot.kinds().to_vec();
        Self {
            position_mm: pose.pose.position_m.map(|m| mm_from_m(f64::from(m))),
            rotation: [0, 1, 2].map(|row| [x[row], y[row], z[row]]),
            q: kinds.iter().zip(&pose.q).map(|(&kind, &q)| ScreenUnit::from(kind).from_si(f64::from(q))).collect(),
            displacement_mm: pose.displacement_m.map(|m| mm_from_m(f64::from(m))),
            homed: robot.is_homed(pose.homed),
            robot: robot.set().name.as_str().to_owned(),
            calibrated: robot.set().is_calibrated,
            t_s: pose.t_us as f64 * 1e-6,
            kinds,
        }
    }
}

impl Report for PoseReport {
    fn text(&self) -> String {
        let [x, y, z] = self.position_mm;
        let si: Vec<f64> = self.kinds.iter().zip(&self.q).map(|(&kind, &q)| ScreenUnit::from(kind).to_si(q)).collect();
        let what = if self.calibrated { "calibrated" } else { "design parameters" };
        let mut text = format!("{} ({what}) at {}\n", one_line(&self.robot), joints_text(&self.kinds, &si));
        text += &format!("tool at {x:.4} {y:.4} {z:.4} mm\n");
        for row in self.rotation {
            text += &row.map(|entry| format!("{entry:10.6}")).join(" ");
            text += "\n";
        }
        text += &match self.displacement_mm {
            Some(mm) => format!("bar {mm:+.4} mm from mid travel\n"),
            None => "no bar within its travel\n".into(),
        };
        text
    }
}
