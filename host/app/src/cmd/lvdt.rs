//! `host-cal lvdt`: measure the LVDT's curve from known lengths.

use std::io::{IsTerminal, stdin};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use ballbar::wire::{Answer, Command, Event, Refusal, StreamSelection};
use ballbar::{LVDT_COEFFICIENTS, SettledPose, StillnessCriteria};
use clap::Args;
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::inputs::{ListError, OutputArgs};
use super::outcome::{CommandError, Outcome};
use super::port::PortArgs;
use super::report::{Report, print, warn};
use crate::board::{BoardError, BoardLink, LvdtPoint, Refusals, RobotOnBoard, StreamLosses, check_lvdt_points, fit_lvdt};
use crate::deadline::StopFlag;
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

#[derive(Debug, Error, Diagnostic)]
enum LvdtError {
    #[error("the board holds no parameters, of which the curve is a part")]
    #[diagnostic(help("Upload a robot first: host-cal apply PORT --robot robot.toml"))]
    NoParameters,
    #[error("ended before all lengths were measured: {found} of {wanted}")]
    #[diagnostic(help("Nothing was changed on the board."))]
    Ended { found: usize, wanted: usize },
    #[error("the board has stopped streaming")]
    #[diagnostic(help("Was it started again? Nothing was changed on the board."))]
    NotStreaming,
}

/// From one look at the keyboard to the next.
const LOOK: Duration = Duration::from_millis(50);
/// After so much silence the board is asked how it is.
const SILENCE: Duration = Duration::from_secs(1);
/// How long an arm that moves is waited for.
const STORE_PATIENCE: Duration = Duration::from_secs(10);

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
        RobotOnBoard::read(&mut link)?.ok_or(LvdtError::NoParameters)?;
        let end = EndRequest::listen();
        link.heed(end.stop_flag());
        let measured = self.measure(&mut link, &end);
        // Whatever came of it, the board is left as it is after its start.
        let left = link.end_stream();
        link.heed(&StopFlag::default());
        let left = left.and_then(|_| link.act(Command::SetStillness(StillnessCriteria::default())));
        let poses = measured?;
        left?;
        let point = |(&length_mm, pose): (&f64, &SettledPose)| LvdtPoint {
            displacement_m: m_from_mm(length_mm - self.bar),
            code: pose.code_mean,
        };
        let points: Vec<LvdtPoint> = self.lengths.iter().zip(&poses).map(point).collect();
        let (curve, residuals_m) = fit_lvdt(&points, usize::from(self.degree))?;

        let squares: f64 = residuals_m.iter().map(|m| m * m).sum();
        let line = |((&length_mm, pose), &m): ((&f64, &SettledPose), &f64)| PointLine {
            length_mm,
            code: pose.code_mean,
            code_std: pose.code_std,
            residual_mm: mm_from_m(m),
        };
        let max_abs_mm = mm_from_m(residuals_m.iter().fold(0.0, |max: f64, m| max.max(m.abs())));
        let (outcome, stored) = match max_abs_mm <= self.tolerance_mm {
            false => ("not stored: too far off", Ok(())),
            true if self.dry_run => ("not stored: dry run", Ok(())),
            true => match store(&mut link, curve) {
                Ok(()) => ("stored", Ok(())),
                Err(error) => ("not stored: see the error", Err(error)),
            },
        };
        let report = LvdtReport {
            degree: self.degree,
            points: self.lengths.iter().zip(&poses).zip(&residuals_m).map(line).collect(),
            rms_mm: mm_from_m((squares / residuals_m.len() as f64).sqrt()),
            max_abs_mm,
            code_min: curve.code_min,
            code_max: curve.code_max,
            coefficients_mm: curve.coefficients_m.map(|m| mm_from_m(f64::from(m))),
            outcome,
            losses: link.losses(),
        };
        // What was measured by hand is shown, whatever became of it.
        print(&report, self.output.json)?;
        stored?;
        Ok(if max_abs_mm <= self.tolerance_mm { Outcome::Good } else { Outcome::Doubtful })
    }

    /// Ended before its time, by Ctrl-C or because stdin was closed.
    fn ended(&self, found: usize, end: &EndRequest) -> CommandError {
        let error = CommandError::from(LvdtError::Ended { found, wanted: self.lengths.len() });
        if end.is_made() { CommandError { exit_code: INTERRUPTED, ..error } } else { error }
    }

    /// Takes one settled pose for each length.
    fn measure(&self, link: &mut BoardLink, end: &EndRequest) -> Result<Vec<SettledPose>, CommandError> {
        let typed = stdin().is_terminal().then(typed_lines);
        let mut refusals = Refusals::default();
        // The arm may do what it likes; only the LVDT has to stand.
        let criteria = StillnessCriteria {
            hold_us: self.hold_ms.saturating_mul(1_000),
            band_counts: u16::MAX,
            ..StillnessCriteria::default()
        };
        let mut poses: Vec<SettledPose> = Vec::new();
        for &length_mm in &self.lengths {
            tell(&format!("set the bar to {length_mm} mm and hold it still"));
            let ended = || Err(self.ended(poses.len(), end));
            if typed.as_ref().is_some_and(|typed| !is_entered(typed, end)) {
                return ended();
            }
            // Asked for anew, so that stillness before now does not count.
            let started = link
                .act(Command::SetStillness(criteria))
                .and_then(|()| link.start_stream(StreamSelection { settled: true, ..StreamSelection::default() }));
            if matches!(started, Err(BoardError::Stopped)) {
                return ended();
            }
            started?;
            // Nobody says when the next length is set: a code that has not moved is still that of the last one.
            let old_code = poses.last().map(|pose| pose.code_mean).filter(|_| typed.is_none());
            let is_new =
                |pose: &SettledPose| old_code.is_none_or(|old| (pose.code_mean - old).abs() > f64::from(criteria.band_codes));
            let Some(pose) = next_settled(link, end, &mut refusals, is_new)? else { return ended() };
            tell(&format!("  code {:.1} ± {:.1} over {} samples", pose.code_mean, pose.code_std, pose.samples));
            poses.push(pose);
        }
        Ok(poses)
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

/// The next pose that stands and is new; `None` when the user ends instead. A board that falls silent is asked how it is.
fn next_settled(
    link: &mut BoardLink,
    end: &EndRequest,
    refusals: &mut Refusals,
    is_new: impl Fn(&SettledPose) -> bool,
) -> Result<Option<SettledPose>, CommandError> {
    let mut heard = Instant::now();
    while !end.is_made() {
        match link.next_frame()?.map(|frame| frame.message) {
            Some(Ok(stream)) => {
                heard = Instant::now();
                if let Event::Settled(pose) = stream.event
                    && is_new(&pose)
                {
                    return Ok(Some(pose));
                }
            }
            Some(Err(reason)) => refusals.note(reason).iter().for_each(|words| warn(words)),
            None if heard.elapsed() >= SILENCE => {
                heard = Instant::now();
                match link.request(Command::Status) {
                    Ok(Answer::Status(status)) if status.streaming.is_none() => return Err(LvdtError::NotStreaming.into()),
                    Ok(_) | Err(BoardError::Stopped) => {}
                    Err(error) => return Err(error.into()),
                }
            }
            None => {}
        }
    }
    Ok(None)
}

/// Stages the curve and stores it; while the arm moves, the store is tried again for some seconds.
fn store(link: &mut BoardLink, curve: ballbar::LvdtCurve) -> Result<(), CommandError> {
    link.act(Command::Discard)?;
    let Answer::Staged { crc } = link.request(Command::SetLvdt(curve))? else {
        return Err(BoardError::WrongAnswer { command: "set LVDT" }.into());
    };
    let began = Instant::now();
    loop {
        match link.act(Command::Commit { crc }) {
            Err(BoardError::Refused { refusal: Refusal::Moving, .. }) if began.elapsed() < STORE_PATIENCE => {
                std::thread::sleep(Duration::from_millis(200));
            }
            stored => return Ok(stored?),
        }
    }
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
