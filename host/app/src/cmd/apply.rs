//! `host-cal apply`: put a calibrated robot on the board, and prove that it computes with it.

use std::num::NonZeroUsize;

use ballbar_calib::model::{CalibrationVerdict, Robot};
use clap::Args;
use clap::builder::TypedValueParser;
use serde::Serialize;

use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome};
use super::port::PortArgs;
use super::report::{Report, print, warn};
use crate::board::{Admission, BoardLink, LvdtOrigin, Upload, UploadStep, Uploaded, bring_back};
use crate::files::open_robot;
use crate::remedies::Remedied;
use crate::terminal::progress;
use crate::text::one_line;

/// Upload a calibrated robot to the board, and verify the board's kinematics against this program's
#[derive(Args)]
#[command(
    after_help = "Examples:\n  host-cal apply /dev/ttyUSB0 --robot calibrated.toml\n  host-cal apply /dev/ttyUSB0 --previous\n\nThe parameters are verified on the board before they are stored. When anything fails, the board keeps those it had."
)]
pub(super) struct ApplyArgs {
    #[command(flatten)]
    port: PortArgs,
    /// robot.toml that `host-cal fit --out` has written
    #[arg(long, required_unless_present = "previous")]
    robot: Option<String>,
    /// Upload a robot that was not calibrated, such as the design
    #[arg(long)]
    uncalibrated: bool,
    /// Bring back the parameters that the last commit replaced, LVDT curve and all; once more, and it is undone
    #[arg(long, conflicts_with_all = ["robot", "uncalibrated"])]
    previous: bool,
    /// Joint vectors to compare the kinematics at
    #[arg(long, default_value = "1000", value_name = "N", value_parser = number_of_vectors())]
    vectors: NonZeroUsize,
    #[command(flatten)]
    output: OutputArgs,
}

/// What was stored, and how well the board computes with it.
#[derive(Serialize)]
struct ApplyReport {
    port: String,
    robot: String,
    calibrated: bool,
    /// Of the fit that wrote the robot's file.
    #[serde(skip_serializing_if = "Option::is_none")]
    verdict: Option<CalibrationVerdict>,
    /// What weighs on it.
    reasons: Vec<String>,
    replaced: Option<String>,
    replaced_calibrated: Option<bool>,
    replaced_crc: Option<String>,
    crc: String,
    /// Commits that this board has seen.
    sequence: u32,
    vectors: usize,
    max_position_difference_um: f64,
    max_axis_difference_urad: f64,
    lvdt: &'static str,
}

impl ApplyArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let report = match &self.robot {
            None => {
                let mut link = self.port.connect()?;
                let uploaded = bring_back(&mut link, self.vectors, &mut say_steps(self.vectors)).map_err(Remedied)?;
                ApplyReport::new(&link, &uploaded)
            }
            Some(robot) => {
                let robot = open_robot(robot)?;
                let admission = if self.uncalibrated { Admission::Any } else { Admission::Calibrated };
                let upload = Upload::new(&robot, admission, self.vectors).map_err(Remedied)?;
                let mut link = self.port.connect()?;
                let uploaded = upload.put(&mut link, &mut say_steps(self.vectors)).map_err(Remedied)?;
                ApplyReport::new(&link, &uploaded).of(&robot)
            }
        };
        print(&report, self.output.json)?;
        Ok(Outcome::Good)
    }
}

fn number_of_vectors() -> impl TypedValueParser<Value = NonZeroUsize> {
    clap::value_parser!(u64).range(1..=1_000_000).try_map(|vectors| NonZeroUsize::try_from(vectors as usize))
}

/// Says what is met on the way, and shows how far the comparison is.
pub(super) fn say_steps(vectors: NonZeroUsize) -> impl FnMut(UploadStep) {
    let mut bar = None;
    move |step| match step {
        UploadStep::Unseen(reason) => warn(&format!("what the board holds is replaced unseen: {reason}")),
        UploadStep::NominalLvdt => {
            warn("the board has no LVDT curve yet: a nominal one goes with the robot. Measure the real one: host-cal lvdt PORT");
        }
        UploadStep::Compared => bar.get_or_insert_with(|| progress(vectors.get() as u64, "verifying kinematics")).inc(1),
    }
}

impl ApplyReport {
    fn new(link: &BoardLink, uploaded: &Uploaded) -> Self {
        let Uploaded { stored, replaced, sequence, difference, lvdt } = uploaded;
        let hex = |crc: u32| format!("{crc:08x}");
        Self {
            port: link.port_name().to_owned(),
            robot: stored.name.clone(),
            calibrated: stored.is_calibrated,
            verdict: None,
            reasons: Vec::new(),
            replaced: replaced.as_ref().map(|old| old.name.clone()),
            replaced_calibrated: replaced.as_ref().map(|old| old.is_calibrated),
            replaced_crc: replaced.as_ref().map(|old| hex(old.crc)),
            crc: hex(stored.crc),
            sequence: *sequence,
            vectors: difference.vectors,
            max_position_difference_um: difference.position_m * 1e6,
            max_axis_difference_urad: difference.axis_rad * 1e6,
            lvdt: match lvdt {
                LvdtOrigin::Kept => "kept",
                LvdtOrigin::Nominal => "nominal",
                LvdtOrigin::BroughtBack => "as it was with them",
            },
        }
    }

    /// With what the board does not keep: the end of a long name, and how the fit was judged.
    fn of(self, robot: &Robot) -> Self {
        let reasons = robot.calibration.as_ref().map_or_else(Vec::new, |calibration| calibration.reasons.clone());
        Self { robot: robot.name.clone(), verdict: robot.verdict(), reasons, ..self }
    }
}

impl Report for ApplyReport {
    fn text(&self) -> String {
        let what = |calibrated: bool| if calibrated { "calibrated" } else { "UNCALIBRATED" };
        let reasons: String = self.reasons.iter().map(|reason| format!("with a reservation: {reason}\n")).collect();
        let before = match (&self.replaced, self.replaced_calibrated, &self.replaced_crc) {
            (Some(name), Some(calibrated), Some(crc)) => format!("{} `{}` (CRC {crc})", what(calibrated), one_line(name)),
            _ => "nothing".into(),
        };
        format!(
            "{}: {} robot `{}` stored (CRC {}, commit {}) in place of {before}\n{reasons}read back bit for bit; LVDT curve {}\n\
             {} joint vectors: the board's poses differ from this program's by at most {:.3} µm and {:.3} µrad\n",
            one_line(&self.port),
            what(self.calibrated),
            one_line(&self.robot),
            self.crc,
            self.sequence,
            self.lvdt,
            self.vectors,
            self.max_position_difference_um,
            self.max_axis_difference_urad
        )
    }
}
