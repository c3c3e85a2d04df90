//! Takes what a board streams into a session's files.

use std::fmt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use ballbar::wire::{BoardHello, LogMark};
use ballbar::{JointKind, JointVector};
use miette::Diagnostic;
use thiserror::Error;

use super::description::{Description, DescriptionError, Run};
use super::log::{LogError, LogWriter, unix_ms};
use super::pose_file::{Erased, PoseFile, PoseFileError, SettledRow};
use super::{LOG_NAME, POSES_NAME};
use crate::units::{mm_from_m, tidy};

/// Why a recording cannot begin or go on.
#[derive(Debug, Error, Diagnostic)]
pub enum RecordError {
    /// The directory.
    #[error("{}: cannot be made: {error}", path.display())]
    Directory {
        /// The directory.
        path: PathBuf,
        /// The operating system's reason.
        error: std::io::Error,
    },
    /// The log.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Log(#[from] LogError),
    /// The description.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Description(#[from] DescriptionError),
    /// The poses.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Poses(#[from] PoseFileError),
    /// Poses while nobody has said what the bar joins.
    #[error("a pose was to be kept without a connection of the bar")]
    NotConnected,
}

/// Which ends the bar joined, and how long it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Connection {
    /// Name of the chuck.
    pub chuck: String,
    /// Name of the sphere.
    pub sphere: String,
    /// Length of the bar at mid travel, metres.
    pub bar_m: f64,
}

impl fmt::Display for Connection {
    /// `A:1, 460 mm`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}, {} mm", self.chuck, self.sphere, tidy(mm_from_m(self.bar_m)))
    }
}

/// A pose to keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredPose {
    /// Encoder outputs, radians or metres.
    pub q: JointVector<f64>,
    /// Displacement of the bar from mid travel, metres.
    pub displacement_m: f64,
    /// Time of its middle by the board's clock, seconds.
    pub t_s: f64,
    /// How fast the length grew, metres per second, where the arm moved.
    pub rate_m_s: Option<f64>,
    /// Line of plan.csv that it was measured for.
    pub plan_row: Option<usize>,
}

/// A session being recorded.
pub struct Recorder {
    session: PathBuf,
    log: LogWriter,
    poses: Option<PoseFile>,
    connection: Option<Connection>,
    description: Description,
    synced: Instant,
}

/// How often the disk is asked to keep what was written.
const SYNC_EVERY: Duration = Duration::from_secs(1);

impl Recorder {
    /// Begins a run in a session's directory, which is made when it is not there. With the kinds of the robot's joints, poses can
    /// go to poses.csv.
    ///
    /// # Errors
    /// [`RecordError`]; nothing that was in the directory is changed then.
    pub fn begin(session: &Path, run: Run, kinds: Option<&[JointKind]>) -> Result<Self, RecordError> {
        std::fs::create_dir_all(session).map_err(|error| RecordError::Directory { path: session.to_owned(), error })?;
        let mut description = Description::read(session)?;
        let poses = kinds.map(|kinds| PoseFile::open(&session.join(POSES_NAME), kinds)).transpose()?;
        let log = LogWriter::open(&session.join(LOG_NAME))?;
        description.runs.push(run);
        description.write(session)?;
        Ok(Self { session: session.to_owned(), log, poses, connection: None, description, synced: Instant::now() })
    }

    /// From here on poses are those of this connection.
    pub fn connect(&mut self, connection: Option<Connection>) {
        self.connection = connection;
    }

    /// Keeps a frame.
    ///
    /// # Errors
    /// [`RecordError::Log`].
    pub fn frame(&mut self, bytes: &[u8]) -> Result<(), RecordError> {
        self.log.frame(bytes)?;
        if self.synced.elapsed() >= SYNC_EVERY {
            self.log.sync()?;
            self.synced = Instant::now();
        }
        Ok(())
    }

    /// Whether settled poses go to poses.csv.
    pub fn writes_poses(&self) -> bool {
        self.poses.is_some() && self.connection.is_some()
    }

    /// Keeps poses.
    ///
    /// # Errors
    /// [`RecordError::Poses`], [`RecordError::NotConnected`].
    pub fn poses(&mut self, poses: &[MeasuredPose]) -> Result<(), RecordError> {
        let (Some(file), Some(Connection { chuck, sphere, bar_m })) = (&mut self.poses, &self.connection) else {
            return Err(RecordError::NotConnected);
        };
        Ok(file.add(poses.iter().map(|pose| SettledRow {
            chuck,
            sphere,
            q: pose.q,
            length_m: bar_m + pose.displacement_m,
            t_s: pose.t_s,
            bar_m: *bar_m,
            rate_m_s: pose.rate_m_s,
            plan_row: pose.plan_row,
        }))?)
    }

    /// Lines of plan.csv that poses were kept for, over all runs.
    pub fn measured_lines(&self) -> Vec<usize> {
        self.poses.as_ref().map_or_else(Vec::new, |file| file.plan_rows().collect())
    }

    /// Lines of plan.csv that the operator skipped, over all runs.
    pub fn skipped_lines(&self) -> Vec<usize> {
        self.description.runs.iter().flat_map(|run| run.skipped.iter().copied()).collect()
    }

    /// Notes that the operator skips a line of plan.csv.
    ///
    /// # Errors
    /// [`RecordError::Description`].
    pub fn skip(&mut self, line: usize) -> Result<(), RecordError> {
        if let Some(run) = self.description.runs.last_mut() {
            run.skipped.push(line);
        }
        Ok(self.description.write(&self.session)?)
    }

    /// Takes the latest pose, or all those of the latest move, out again.
    ///
    /// # Errors
    /// [`RecordError::Poses`].
    pub fn erase_last(&mut self) -> Result<Erased, RecordError> {
        Ok(self.poses.as_mut().map_or(Ok(Erased::default()), PoseFile::erase_last)?)
    }

    /// Notes that the port was lost.
    ///
    /// # Errors
    /// [`RecordError::Log`].
    pub fn lost(&mut self) -> Result<(), RecordError> {
        Ok(self.log.mark(LogMark::Lost { unix_ms: unix_ms() })?)
    }

    /// Notes that the port is back.
    ///
    /// # Errors
    /// [`RecordError::Log`].
    pub fn back(&mut self) -> Result<(), RecordError> {
        Ok(self.log.mark(LogMark::Back { unix_ms: unix_ms() })?)
    }

    /// Ends the run.
    ///
    /// # Errors
    /// [`RecordError`].
    pub fn end(mut self) -> Result<(), RecordError> {
        self.log.sync()?;
        let added = self.poses.as_ref().map_or(0, PoseFile::added);
        if let Some(run) = self.description.runs.last_mut() {
            run.ended = Some(now());
            run.poses = added;
        }
        Ok(self.description.write(&self.session)?)
    }
}

impl Run {
    /// A run that begins now.
    pub fn beginning(port: &str, hello: &BoardHello, rate_hz: u16) -> Self {
        Self {
            started: now(),
            ended: None,
            by: concat!("host-cal ", env!("CARGO_PKG_VERSION")).to_owned(),
            port: port.to_owned(),
            rig: None,
            pairing: None,
            bar_mm: None,
            robot_link: None,
            skipped: Vec::new(),
            temperature_c: None,
            rate_hz,
            poses: 0,
            board: hello.into(),
            robot: hello.active.as_ref().map(Into::into),
        }
    }
}

/// RFC 3339, to the second.
fn now() -> String {
    let now = jiff::Timestamp::now();
    now.round(jiff::Unit::Second).unwrap_or(now).to_string()
}
