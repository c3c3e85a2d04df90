//! `host-cal validate`: residuals of poses that a fit has not seen.

use ballbar_calib::identify::{ResidualSummary, by_pairing, residuals};
use ballbar_calib::model::{CalibrationVerdict, Standing};
use clap::Args;
use serde::Serialize;

use super::inputs::{Measured, MeasuredArgs, OutputArgs, check_max_rms_mm};
use super::outcome::{CommandError, Outcome};
use super::report::{Report, largest_text, print};
use crate::documents::{PairingLine, ResidualLine, largest};
use crate::terminal::table::{Columns, fixed};
use crate::units::mm_from_m;

/// Residuals on poses that the fit has not seen
#[derive(Args)]
#[command(
    after_help = "Example:\n  host-cal validate --robot calibrated.toml --rig rig.toml poses-610.csv\n\nWith --max-rms-mm, exit code 1 says that the residuals are larger."
)]
pub(super) struct ValidateArgs {
    #[command(flatten)]
    measured: MeasuredArgs,
    /// End with exit code 1 when the RMS residual is above this
    #[arg(long, value_name = "MM", allow_hyphen_values = true)]
    max_rms_mm: Option<f64>,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct ValidateReport {
    robot: String,
    calibrated: bool,
    /// Of the fit that wrote the robot's file.
    #[serde(skip_serializing_if = "Option::is_none")]
    verdict: Option<CalibrationVerdict>,
    #[serde(skip)]
    standing: Standing,
    /// The rule of --hold-out.
    #[serde(skip_serializing_if = "Option::is_none")]
    held_out: Option<String>,
    poses: usize,
    rms_mm: f64,
    max_abs_mm: f64,
    mean_mm: f64,
    by_pairing: Vec<PairingLine>,
    largest: Vec<ResidualLine>,
    #[serde(skip_serializing_if = "Option::is_none")]
    within_max_rms: Option<bool>,
    warnings: Vec<String>,
}

impl ValidateArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        check_max_rms_mm(self.max_rms_mm)?;
        let measured = self.measured.read()?;
        let report = self.report(measured);
        print(&report, self.output.json)?;
        Ok(if report.within_max_rms == Some(false) { Outcome::Doubtful } else { Outcome::Good })
    }

    fn report(&self, measured: Measured) -> ValidateReport {
        let Measured { robot, rig, dataset, held_out, warnings, .. } = measured;
        let (rule, dataset) = held_out.map_or((None, dataset), |(rule, rows)| (Some(rule.to_string()), rows));
        let residuals = residuals(&robot.kinematics(), &dataset);
        let summary = ResidualSummary::new(&residuals);
        let rms_mm = mm_from_m(summary.rms_m);
        ValidateReport {
            calibrated: robot.standing().is_calibrated(),
            verdict: robot.verdict(),
            standing: robot.standing(),
            robot: robot.name,
            held_out: rule,
            poses: summary.count,
            rms_mm,
            max_abs_mm: mm_from_m(summary.max_abs_m),
            mean_mm: mm_from_m(summary.mean_m),
            by_pairing: by_pairing(&dataset, &residuals).iter().map(|one| PairingLine::new(&rig, one)).collect(),
            largest: largest(&dataset, &rig, &residuals, 5),
            within_max_rms: self.max_rms_mm.map(|limit| rms_mm <= limit),
            warnings,
        }
    }
}

impl Report for ValidateReport {
    fn text(&self) -> String {
        let rule = self.held_out.as_ref().map_or(String::new(), |rule| format!(" held out ({rule})"));
        let mut text = format!("{} ({}), {} poses{rule}\n\n", self.robot, self.standing, self.poses);
        text += &format!("RMS {:.4} mm, mean {:.4} mm, largest {:.4} mm\n\n", self.rms_mm, self.mean_mm, self.max_abs_mm);
        let mut table = Columns::new(&["<pairing", "poses", "RMS mm", "mean mm", "largest mm"]);
        for line in &self.by_pairing {
            let numbers = [line.rms_mm, line.mean_mm, line.max_abs_mm].map(|mm| fixed(mm, 4));
            table.row([line.pairing.clone(), line.poses.to_string()].into_iter().chain(numbers));
        }
        text += &table.text();
        text += "\nlargest residuals (measured less computed)\n";
        text += &largest_text(&self.largest);
        if let Some(within) = self.within_max_rms {
            text += if within { "\nThe RMS is within the limit.\n" } else { "\nThe RMS is ABOVE the limit.\n" };
        }
        text
    }
}
