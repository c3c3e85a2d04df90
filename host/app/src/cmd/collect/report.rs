//! What `collect` ends with.

use std::path::Path;
use std::time::Duration;

use serde::Serialize;

use crate::board::StreamLosses;
use crate::cmd::report::Report;
use crate::collect::{CollectError, Ended, Lag, Ledger, RowState, Summary};
use crate::session::SessionInputs;
use crate::text::one_line;
use crate::units::mm_from_m;

#[derive(Serialize)]
pub(super) struct CollectReport {
    robot: String,
    session: String,
    /// `done`, `quit`, or `stopped` by an error, which stands on stderr.
    status: &'static str,
    /// Rows of the plan to measure.
    planned: usize,
    /// Rows of the plan that are measured, over all runs.
    measured: usize,
    skipped: usize,
    /// Rows that are left.
    left: usize,
    missed: Vec<MissedLine>,
    /// Poses written in this run.
    poses_written: usize,
    /// Poses of earlier runs that the log held and poses.csv lacked.
    poses_recovered: usize,
    repeats: Vec<RepeatLine>,
    /// Of the lengths at poses returned to, RMS.
    repeatability_mm: Option<f64>,
    /// By how much the LVDT was late, of poses measured on the way; removed from their lengths.
    #[serde(skip_serializing_if = "Option::is_none")]
    lag_ms: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    lag_std_ms: Option<f64>,
    troubles: Vec<String>,
    losses: StreamLosses,
    duration_s: f64,
}

#[derive(Serialize)]
struct MissedLine {
    line: usize,
    why: String,
}

#[derive(Serialize)]
struct RepeatLine {
    line: usize,
    difference_mm: f64,
}

impl CollectReport {
    pub(super) fn new(
        session: &Path,
        files: &SessionInputs,
        ledger: &Ledger<'_>,
        summary: &Summary,
        ended: &Result<Ended, CollectError>,
        duration: Duration,
    ) -> Self {
        let repeats: Vec<RepeatLine> = summary
            .repeats
            .iter()
            .map(|repeat| RepeatLine { line: repeat.line, difference_mm: mm_from_m(repeat.difference_m) })
            .collect();
        let mean_square = repeats.iter().map(|repeat| repeat.difference_mm.powi(2)).sum::<f64>() / repeats.len() as f64;
        Self {
            robot: files.robot.name.clone(),
            session: session.display().to_string(),
            status: match ended {
                Ok(Ended::Done) => "done",
                Ok(Ended::Quit) => "quit",
                Err(_) => "stopped",
            },
            planned: ledger.measurable(),
            measured: ledger.count(&RowState::Measured),
            skipped: ledger.count(&RowState::Skipped),
            left: ledger.count(&RowState::Todo),
            missed: ledger.missed().into_iter().map(|(line, why)| MissedLine { line, why }).collect(),
            poses_written: summary.written,
            poses_recovered: 0,
            repeatability_mm: (!repeats.is_empty()).then(|| mean_square.sqrt()),
            repeats,
            lag_ms: None,
            lag_std_ms: None,
            troubles: summary.troubles.clone(),
            losses: summary.losses,
            duration_s: duration.as_secs_f64(),
        }
    }

    pub(super) fn set_recovered(&mut self, poses: usize) {
        self.poses_recovered = poses;
    }

    pub(super) fn set_lag(&mut self, lag: &Lag) {
        (self.lag_ms, self.lag_std_ms) = (Some(lag.lag_s * 1e3), Some(lag.std_s * 1e3));
    }

    /// Whether all that was planned is measured or skipped, and nothing was lost.
    pub(super) fn is_complete(&self) -> bool {
        self.status == "done" && self.missed.is_empty() && self.losses.lost() == 0
    }
}

impl Report for CollectReport {
    fn text(&self) -> String {
        let mut text = format!(
            "{}: {} of {} planned poses are measured, {} poses written in this run ({:.0} s)\n",
            one_line(&self.session),
            self.measured,
            self.planned,
            self.poses_written,
            self.duration_s
        );
        let numbers = [(self.skipped, "skipped"), (self.missed.len(), "missed"), (self.left, "left")];
        let others: Vec<String> =
            numbers.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect();
        if !others.is_empty() {
            text += &format!("{}\n", others.join(", "));
        }
        for missed in &self.missed {
            text += &format!("  line {}: {}\n", missed.line, one_line(&missed.why));
        }
        if let Some(repeatability_mm) = self.repeatability_mm {
            text += &format!("{} poses returned to: lengths differ by {repeatability_mm:.4} mm RMS\n", self.repeats.len());
        }
        if let (Some(lag_ms), Some(std_ms)) = (self.lag_ms, self.lag_std_ms) {
            text += &format!("the LVDT comes {lag_ms:.3} ± {std_ms:.3} ms late; removed from the lengths\n");
        }
        for trouble in &self.troubles {
            text += &format!("trouble: {}\n", one_line(trouble));
        }
        text += &match self.losses.lost() {
            0 => "nothing lost\n".to_owned(),
            lost => format!("LOST: {lost} messages or samples\n"),
        };
        if self.losses.refused.all() > 0 {
            text += &format!("REFUSED: {}\n", self.losses.refused);
        }
        if self.left + self.missed.len() > 0 {
            text += "The same command goes on.\n";
        } else {
            text += &format!("Next: host-cal fit {} --out calibrated.toml\n", one_line(&self.session));
        }
        text
    }
}
