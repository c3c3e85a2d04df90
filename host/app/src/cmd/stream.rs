//! `host-cal stream`: watch a board, and record what it sends.

mod picture;
mod watch;
mod words;

use std::path::{Path, PathBuf};
use std::time::Duration;

use ballbar::Pairing;
use ballbar::wire::{FrameCounts, StreamSelection};
use ballbar_calib::model::{Rig, Robot};
use clap::Args;
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;
use watch::Watch;

use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome, lock_error, record_error};
use super::pairings::parse_pairings;
use super::port::{PortArgs, StillnessArgs};
use super::recorder::begin_recording;
use super::report::{Report, print, warn};
use crate::board::{BoardLink, RobotOnBoard, StreamLosses};
use crate::files::{open_rig, open_robot};
use crate::record::{Account, Latest, Watched};
use crate::remedies::Remedied;
use crate::session::{Connection, ROBOT_NAME, Run, SessionLock};
use crate::text::one_line;
use crate::units::{m_from_mm, mm_from_m};

/// Watch a board: joint angles, length, losses; record a session
#[derive(Args)]
#[command(
    after_help = "Examples:\n  host-cal stream /dev/ttyUSB0\n  host-cal stream /dev/ttyUSB0 --session today --rig rig.toml --pairing A:1 --bar 460\n\nWithout --raw, --settled and --pose, samples and settled poses are streamed. Ctrl-C ends cleanly.\nA session's poses.csv holds one row for every pose at which the arm stood still; it needs --pairing and --bar."
)]
pub(super) struct StreamArgs {
    #[command(flatten)]
    port: PortArgs,
    /// Directory to record into; one that holds a session is gone on with
    #[arg(long, value_name = "DIR")]
    session: Option<PathBuf>,
    /// End after this time, as in 30s or 2m
    #[arg(long = "for", value_name = "TIME", value_parser = parse_time)]
    time: Option<Duration>,
    /// End after so many settled poses
    #[arg(long, value_name = "N")]
    poses: Option<u64>,
    /// Stream every sample
    #[arg(long)]
    raw: bool,
    /// Stream the poses at which the arm stood still
    #[arg(long)]
    settled: bool,
    /// Stream the tool's corrected pose
    #[arg(long)]
    pose: bool,
    /// Samples a second, 100 to 5000
    #[arg(long, default_value_t = 1000, value_name = "HZ", value_parser = clap::value_parser!(u16).range(100..=5_000))]
    rate: u16,
    #[command(flatten)]
    stillness: StillnessArgs,
    /// What the bar joins, chuck:sphere
    #[arg(long, value_name = "A:1")]
    pairing: Option<String>,
    /// Length of the bar at mid travel, millimetres
    #[arg(long, value_name = "MM")]
    bar: Option<f64>,
    /// rig.toml, or the built-in: triangles; checks the pairing and the bar, and lets the screen show residuals
    #[arg(long)]
    rig: Option<String>,
    /// The robot, whose joint limits are watched: robot.toml, or a built-in; the session's own where it has one
    #[arg(long)]
    robot: Option<String>,
    /// Temperature, kept with the session, degrees Celsius
    #[arg(long, value_name = "C")]
    temperature_c: Option<f64>,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Error, Diagnostic)]
enum StreamError {
    #[error("--pairing and --bar need each other")]
    #[diagnostic(help("Poses are written with the chuck, the sphere and the length: --pairing A:1 --bar 460"))]
    HalfConnection,
    #[error("--pairing and --bar without --session")]
    #[diagnostic(help("Poses are written into a session: --session DIR"))]
    NoSession,
    #[error("--bar is {found} mm, but the rig's bar has {known} mm")]
    OtherBar { found: f64, known: String },
    #[error("--bar is {0}, expected a number of millimetres above 0")]
    BadBar(f64),
    #[error("--pairing `{0}`: expected one chuck and one sphere, as in A:1")]
    BadPairing(String),
    #[error("the board holds no parameters, so it cannot tell joint angles or lengths")]
    #[diagnostic(help(
        "Upload a robot first: host-cal apply PORT --robot robot.toml. Raw samples can be streamed without: --raw"
    ))]
    NoParameters,
}

/// What the run ended with.
#[derive(Serialize)]
struct StreamReport {
    port: String,
    board: String,
    firmware: String,
    robot: Option<String>,
    rate_hz: u16,
    duration_s: f64,
    samples: u64,
    /// By the board's clock; none before two samples came.
    measured_rate_hz: Option<f64>,
    settled: u64,
    tool_poses: u64,
    poses_written: u64,
    /// Poses of earlier runs that the log held and poses.csv lacked.
    poses_recovered: usize,
    /// Settled poses that were not written because not every encoder was homed.
    poses_withheld: u64,
    /// Settled poses with a joint beyond its limits; none when the limits are not known.
    beyond_limits: Option<u64>,
    losses: StreamLosses,
    frames: FrameLine,
    gaps: u64,
    latest: Latest,
    session: Option<String>,
}

/// Frames that arrived, by their fate.
#[derive(Serialize)]
struct FrameLine {
    good: u32,
    crc: u32,
    malformed: u32,
    overlong: u32,
    not_understood: u32,
}

impl StreamArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let connection = self.connection()?;
        let limits = self.limits()?;
        let mut link = self.port.connect()?;
        let robot = RobotOnBoard::read(&mut link)?;
        if robot.is_none() && (connection.is_some() || self.pose) {
            return Err(StreamError::NoParameters.into());
        }
        let (robot, robot_frame) = robot.unzip();
        let (pairing, criteria) = (self.pairing()?, self.stillness.criteria());
        let mut account = Account::new(Watched { robot, limits, connection, pairing, criteria }).map_err(Remedied)?;
        if let Some(session) = &self.session {
            account = self.record(account, session, &link, robot_frame.as_deref())?;
        }
        let mut watch = Watch::new(link, self, account);
        let ended = watch.run();
        let (report, closed) = watch.finish();
        print(&report, self.output.json)?;
        // What ended the run comes first: it is why the other failed, if it did.
        ended?;
        closed?;
        let doubts = report.losses.lost() + report.gaps + report.poses_withheld;
        Ok(if doubts == 0 { Outcome::Good } else { Outcome::Doubtful })
    }

    /// What is streamed.
    fn selection(&self) -> StreamSelection {
        let nothing_said = !(self.raw || self.settled || self.pose);
        StreamSelection { samples: self.raw || nothing_said, settled: self.settled || nothing_said, poses: self.pose }
    }

    /// The robot whose limits are watched, as far as anybody has said.
    fn limits(&self) -> Result<Option<Robot>, CommandError> {
        if let Some(robot) = &self.robot {
            return Ok(Some(open_robot(robot)?));
        }
        let kept = self.session.as_ref().map(|session| session.join(ROBOT_NAME)).filter(|path| path.is_file());
        Ok(kept.map(|path| open_robot(&path.to_string_lossy())).transpose()?)
    }

    fn connection(&self) -> Result<Option<Connection>, CommandError> {
        let (pairing, bar_mm) = match (&self.pairing, self.bar) {
            (None, None) => return Ok(None),
            (Some(pairing), Some(bar_mm)) => (pairing, bar_mm),
            _ => return Err(StreamError::HalfConnection.into()),
        };
        if self.session.is_none() {
            return Err(StreamError::NoSession.into());
        }
        if !(bar_mm > 0.0 && bar_mm <= 1e6) {
            return Err(StreamError::BadBar(bar_mm).into());
        }
        let bad_pairing = || StreamError::BadPairing(pairing.clone());
        if let Some(rig) = &self.rig {
            let rig = open_rig(rig)?;
            if parse_pairings(pairing, &rig)?.len() != 1 {
                return Err(bad_pairing().into());
            }
            check_bar(bar_mm, &rig)?;
        }
        let (chuck, sphere) = pairing.split_once(':').ok_or_else(bad_pairing)?;
        let is_name = |name: &str| !name.is_empty() && !name.contains([',', ':', '#', '"']);
        if !is_name(chuck) || !is_name(sphere) {
            return Err(bad_pairing().into());
        }
        Ok(Some(Connection { chuck: chuck.into(), sphere: sphere.into(), bar_m: m_from_mm(bar_mm) }))
    }

    /// Where the ends are that the bar joins, as far as that is known.
    fn pairing(&self) -> Result<Option<Pairing<f64>>, CommandError> {
        let (Some(rig), Some(pairing)) = (&self.rig, &self.pairing) else { return Ok(None) };
        let rig = open_rig(rig)?;
        Ok(parse_pairings(pairing, &rig)?.first().map(|&id| rig.pairing(id)))
    }

    /// Begins a run in the session, where poses are written when it is known what the bar joins.
    fn record(
        &self,
        account: Account,
        session: &Path,
        link: &BoardLink,
        robot_frame: Option<&[u8]>,
    ) -> Result<Account, CommandError> {
        let run = Run {
            rig: self.rig.clone(),
            pairing: self.pairing.clone(),
            bar_mm: self.bar,
            temperature_c: self.temperature_c,
            ..Run::beginning(link.port_name(), link.hello(), self.rate)
        };
        let lock = SessionLock::acquire(session).map_err(lock_error)?;
        let kinds = account.connection().and(account.robot()).map(RobotOnBoard::kinds);
        let said: Vec<&[u8]> = [link.hello_frame()].into_iter().chain(robot_frame).collect();
        let recorder = begin_recording(&lock, run, kinds, &said)?;
        let account = account.with_recorder(recorder).map_err(record_error)?;
        if self.selection().settled && self.pairing.is_none() {
            warn("without --pairing and --bar the settled poses go to the log and not to poses.csv");
        }
        Ok(account)
    }
}

fn check_bar(bar_mm: f64, rig: &Rig) -> Result<(), StreamError> {
    let Some(bar) = &rig.bar else { return Ok(()) };
    if bar.lengths_m.iter().any(|&m| (mm_from_m(m) - bar_mm).abs() < 1e-6) {
        return Ok(());
    }
    let known = bar.lengths_m.iter().map(|&m| mm_from_m(m).to_string()).collect::<Vec<_>>().join(" or ");
    Err(StreamError::OtherBar { found: bar_mm, known })
}

/// `30s`, `2m`, `1h 30m`.
fn parse_time(text: &str) -> Result<Duration, String> {
    let time: jiff::SignedDuration = text.parse().map_err(|_| "expected a time as in 30s or 2m".to_owned())?;
    Duration::try_from(time).map_err(|_| "expected a time above zero".to_owned())
}

impl From<(FrameCounts, u32)> for FrameLine {
    fn from((counts, not_understood): (FrameCounts, u32)) -> Self {
        let FrameCounts { good, overlong, malformed, crc } = counts;
        Self { good, crc, malformed, overlong, not_understood }
    }
}

impl Report for StreamReport {
    fn text(&self) -> String {
        let mut text = one_line(&format!("{} ({} {})", self.port, self.board, self.firmware)).into_owned();
        text += &self.robot.as_ref().map_or("\n".into(), |robot| format!(", robot {}\n", one_line(robot)));
        text += &format!("{:.1} s: {} samples", self.duration_s, self.samples);
        text += &self.measured_rate_hz.map_or(String::new(), |hz| format!(" at {hz:.1} Hz"));
        text += &format!(", {} settled poses, {} tool poses\n", self.settled, self.tool_poses);
        let losses = &self.losses;
        text += &match losses.lost() {
            0 => "nothing lost\n".to_owned(),
            _ => format!(
                "LOST: {} messages ({} dropped by the board, {} on the line), {} samples by overrun\n",
                losses.missing, losses.dropped_by_board, losses.lost_on_line, losses.overruns
            ),
        };
        if losses.refused.all() > 0 {
            text += &format!("REFUSED: {}\n", losses.refused);
        }
        let frames = &self.frames;
        if frames.crc + frames.malformed + frames.overlong + frames.not_understood > 0 {
            text += &format!(
                "frames: {} whole, {} with a wrong CRC, {} malformed, {} overlong, {} not understood\n",
                frames.good, frames.crc, frames.malformed, frames.overlong, frames.not_understood
            );
        }
        if self.gaps > 0 {
            text += &format!("the port was lost {} times\n", self.gaps);
        }
        if let Some(session) = &self.session {
            text += &format!("recorded in {}, {} poses added to poses.csv\n", one_line(session), self.poses_written);
        }
        text += &match self.beyond_limits {
            None if self.settled > 0 => "joint limits were not watched: they are not known without --robot\n".to_owned(),
            None | Some(0) => String::new(),
            Some(poses) => format!("{poses} poses have a joint BEYOND ITS LIMITS: is the board homed where the robot stands?\n"),
        };
        if self.poses_withheld > 0 {
            text += &format!("{} poses were NOT WRITTEN because the encoders are not homed\n", self.poses_withheld);
        }
        text
    }
}
