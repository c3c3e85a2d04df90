//! `host-cal lvdt`: measure the LVDT's curve from known lengths.

use std::io::{IsTerminal, stdin};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use ballbar::{LVDT_COEFFICIENTS, SettledPose};
use clap::Args;
use serde::Serialize;

use super::inputs::{ListError, OutputArgs};
use super::outcome::{CommandError, Outcome};
use super::port::PortArgs;
use super::report::{Report, print, warn};
use crate::board::{
    Implausible, LengthSet, LengthSetter, LvdtError, LvdtPoint, Refusals, StreamLosses, check_lvdt_points, fit_lvdt,
    measure_lvdt, store_lvdt,
};
use crate::remedies::Remedied;
use crate::terminal::out::{ask, tell};
use crate::terminal::table::{Columns, fixed};
use crate::terminal::{EndRequest, INTERRUPTED, typed_lines};
use crate::units::{m_from_mm, mm_from_m};

/// Measure the LVDT's curve from known lengths, and store it on the board
#[derive(Args)]
#[command(
    after_help = "Example:\n  host-cal lvdt /dev/ttyUSB0 --bar 460 --lengths 425,432,439,446,453,460,467,474,481,488,495\n\nSet the bar to each length in turn, as with gauge blocks or a micrometer stage, and hold it still until it is taken.\nThe curve is stored when it is within --tolerance-mm of every length."
)]
pub(super) struct LvdtArgs {
    #[command(flatten)]
    port: PortArgs,
    /// Length of the bar at mid travel, millimetres
    #[arg(long, value_name = "MM")]
    bar: f64,
    /// The known lengths, in the order in which they will be set, millimetres
    #[arg(long, value_delimiter = ',', required = true, value_name = "MM,…")]
    lengths: Vec<f64>,
    /// Degree of the polynomial
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u8).range(1..LVDT_COEFFICIENTS as i64))]
    degree: u8,
    /// How long each length must stand still, milliseconds
    #[arg(long, default_value_t = 1000, value_name = "MS")]
    hold_ms: u32,
    /// Largest residual with which the curve is stored, millimetres
    #[arg(long, default_value_t = 0.05, value_name = "MM")]
    tolerance_mm: f64,
    /// Fit and show the curve, and store nothing
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    output: OutputArgs,
}

/// From one look at the keyboard to the next.
const LOOK: Duration = Duration::from_millis(50);

#[derive(Serialize)]
struct LvdtReport {
    degree: u8,
    points: Vec<PointLine>,
    rms_mm: f64,
    max_abs_mm: f64,
    code_min: u16,
    code_max: u16,
    coefficients_mm: [f64; LVDT_COEFFICIENTS],
    /// Whether the curve was stored, and why not.
    outcome: &'static str,
    losses: StreamLosses,
}

#[derive(Serialize)]
struct PointLine {
    length_mm: f64,
    code: f64,
    code_std: f32,
    residual_mm: f64,
}

impl LvdtArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        if let Some(bad) = self.lengths.iter().chain([&self.bar]).find(|mm| !(**mm > 0.0 && **mm <= 1e6)) {
            let (flag, found) = ("--bar and --lengths", bad.to_string());
            return Err(ListError::Number { flag, found, expected: "millimetres above 0, at most 1e6" }.into());
        }
        check_lvdt_points(self.lengths.len(), usize::from(self.degree))?;
        let mut link = self.port.connect()?;
        let end = EndRequest::listen();
        let mut person = Person {
            lengths_mm: &self.lengths,
            typed: stdin().is_terminal().then(typed_lines),
            end: &end,
            refusals: Refusals::default(),
        };
        let hold_us = self.hold_ms.saturating_mul(1_000);
        let poses = measure_lvdt(&mut link, self.lengths.len(), hold_us, end.stop_flag(), &mut person);
        let poses = poses.map_err(|error| lvdt_error(error, &end))?;
        let point = |(&length_mm, pose): (&f64, &SettledPose)| LvdtPoint {
            displacement_m: m_from_mm(length_mm - self.bar),
            code: pose.code_mean,
        };
        let points: Vec<LvdtPoint> = self.lengths.iter().zip(&poses).map(point).collect();
        let fit = fit_lvdt(&points, usize::from(self.degree))?;
        let tolerance_m = m_from_mm(self.tolerance_mm);
        let line = |((&length_mm, pose), &m): ((&f64, &SettledPose), &f64)| PointLine {
            length_mm,
            code: pose.code_mean,
            code_std: pose.code_std,
            residual_mm: mm_from_m(m),
        };
        let (outcome, stored) = match fit.is_within(tolerance_m) {
            false => ("not stored: too far off", Ok(())),
            true if self.dry_run => ("not stored: dry run", Ok(())),
            true => match store_lvdt(&mut link, &fit, tolerance_m) {
                Ok(()) => ("stored", Ok(())),
                Err(error) => ("not stored: see the error", Err(error)),
            },
        };
        let curve = fit.curve();
        let report = LvdtReport {
            degree: self.degree,
            points: self.lengths.iter().zip(&poses).zip(fit.residuals_m()).map(line).collect(),
            rms_mm: mm_from_m(fit.rms_m()),
            max_abs_mm: mm_from_m(fit.largest_m()),
            code_min: curve.code_min,
            code_max: curve.code_max,
            coefficients_mm: curve.coefficients_m.map(|m| mm_from_m(f64::from(m))),
            outcome,
            losses: link.losses(),
        };
        // What was measured by hand is shown, whatever became of it.
        print(&report, self.output.json)?;
        stored.map_err(Remedied)?;
        Ok(if fit.is_within(tolerance_m) { Outcome::Good } else { Outcome::Doubtful })
    }
}

/// Ended before its time, by Ctrl-C or because stdin was closed, among the rest.
fn lvdt_error(error: LvdtError, end: &EndRequest) -> CommandError {
    let is_interrupted = matches!(error, LvdtError::Ended { .. }) && end.is_made();
    let error = CommandError::from(Remedied(error));
    if is_interrupted { CommandError { exit_code: INTERRUPTED, ..error } } else { error }
}

/// Whoever sets the bar, at a terminal or somewhere else.
struct Person<'a> {
    lengths_mm: &'a [f64],
    /// Lines typed, where there is a terminal.
    typed: Option<Receiver<String>>,
    end: &'a EndRequest,
    refusals: Refusals,
}

impl LengthSetter for Person<'_> {
    fn set(&mut self, number: usize) -> LengthSet {
        tell(&format!("set the bar to {} mm and hold it still", self.lengths_mm[number]));
        match &self.typed {
            None => LengthSet::Unsaid,
            Some(typed) if is_entered(typed, self.end) => LengthSet::Now,
            Some(_) => LengthSet::Never,
        }
    }

    fn taken(&mut self, pose: &SettledPose) {
        tell(&format!("  code {:.1} ± {:.1} over {} samples", pose.code_mean, pose.code_std, pose.samples));
    }

    fn refused(&mut self, reason: Implausible) {
        self.refusals.note(reason).iter().for_each(|words| warn(words));
    }
}

/// Waits for Enter; false when the user ends instead, or nobody is there any more.
fn is_entered(typed: &Receiver<String>, end: &EndRequest) -> bool {
    ask("press Enter when it stands, or Ctrl-C to end: ");
    // Typed before it was asked: meant for something else.
    while typed.try_recv().is_ok() {}
    while !end.is_made() {
        match typed.recv_timeout(LOOK) {
            Ok(_) => return true,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return false,
        }
    }
    tell("");
    false
}

impl Report for LvdtReport {
    fn text(&self) -> String {
        let mut table = Columns::new(&["length mm", "code", "std", "residual mm"]);
        for point in &self.points {
            let cells = [
                fixed(point.length_mm, 4),
                fixed(point.code, 1),
                fixed(f64::from(point.code_std), 2),
                fixed(point.residual_mm, 4),
            ];
            table.row(cells);
        }
        let mut text = table.text();
        text += &format!("degree {}: RMS {:.4} mm, largest {:.4} mm\n", self.degree, self.rms_mm, self.max_abs_mm);
        text += &format!("codes {} to {}; {}\n", self.code_min, self.code_max, self.outcome);
        if self.losses.refused.all() > 0 {
            text += &format!("REFUSED: {}\n", self.losses.refused);
        }
        text
    }
}
