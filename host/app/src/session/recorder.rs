//! Takes what a board streams into a session's files.

use std::time::{Duration, Instant};

use ballbar::wire::{BoardHello, LogMark};
use ballbar::{JointKind, StillnessCriteria};

use super::description::{DescriptionFile, Run};
use super::lock::SessionLock;
use super::log::{LogWriter, unix_ms};
use super::measured_pose::{Connection, MeasuredPose};
use super::pose_file::{Erased, PoseFile, SettledRow};
use super::pose_file_error::PoseFileError;
use super::pose_mark::PoseMark;
use super::record_error::RecordError;
use super::recovery::Recovery;
use super::{LOG_NAME, now};

/// A session being recorded.
///
/// A pose goes to the log first and to poses.csv then: whatever ends the program between the two, the next run finds it.
pub struct Recorder {
    log: LogWriter,
    poses: Option<PoseFile>,
    /// As the log has it: what the bar joins, and the criteria by which every settled pose is measured.
    connected: Option<(Connection, Option<StillnessCriteria>)>,
    description: DescriptionFile,
    recovered: usize,
    /// Somebody else's change of poses.csv is in the log already.
    is_change_noted: bool,
    synced: Instant,
    _lock: SessionLock,
}

/// How often the disk is asked to keep what was written, and whether it still is where it was.
const SYNC_EVERY: Duration = Duration::from_secs(1);

impl Recorder {
    /// Begins a run in a session. With the kinds of the robot's joints, poses can go to poses.csv. Poses that the log of earlier runs
    /// holds and poses.csv lacks are written.
    ///
    /// # Errors
    /// [`RecordError`]; nothing that was in the directory is changed when something there is damaged or of another robot.
    pub fn begin(lock: &SessionLock, run: Run, kinds: Option<&[JointKind]>) -> Result<Self, RecordError> {
        let session = lock.session();
        let mut description = DescriptionFile::open(session)?;
        let recovery = Recovery::find(session, kinds)?;
        let log = LogWriter::open(&session.join(LOG_NAME))?;
        description.description.runs.push(run);
        description.write()?;
        let (file, recovered) = recovery.write()?;
        let poses = file.filter(|_| kinds.is_some());
        let (connected, is_change_noted, synced) = (None, false, Instant::now());
        Ok(Self { log, poses, connected, description, recovered, is_change_noted, synced, _lock: lock.clone() })
    }

    /// Poses of earlier runs that the log held and poses.csv lacked, and that were written when this run began.
    pub fn recovered(&self) -> usize {
        self.recovered
    }

    /// From here on poses are those of this connection.
    ///
    /// # Errors
    /// [`RecordError::Log`], [`RecordError::LongNames`].
    pub fn connect(&mut self, connection: Option<Connection>) -> Result<(), RecordError> {
        self.note_connected(connection.map(|connection| (connection, None)))
    }

    /// From here on every settled pose is one of this connection, by [`super::SettledRule`] with these criteria.
    ///
    /// # Errors
    /// [`RecordError::Log`], [`RecordError::LongNames`].
    pub fn connect_for_every_settled(&mut self, connection: Connection, criteria: StillnessCriteria) -> Result<(), RecordError> {
        self.note_connected(Some((connection, Some(criteria))))
    }

    fn note_connected(&mut self, connected: Option<(Connection, Option<StillnessCriteria>)>) -> Result<(), RecordError> {
        if connected == self.connected {
            return Ok(());
        }
        let mark = match connected.clone() {
            Some((connection, every_settled)) => PoseMark::Connected { connection, every_settled },
            None => PoseMark::Disconnected,
        };
        let bytes = connected.as_ref().map_or(0, |(Connection { chuck, sphere, .. }, _)| chuck.len() + sphere.len());
        let frame = mark.frame().ok_or(RecordError::LongNames { bytes })?;
        self.log.frame(&frame)?;
        self.connected = connected;
        Ok(())
    }

    /// Keeps a frame.
    ///
    /// # Errors
    /// [`RecordError::Log`].
    pub fn frame(&mut self, bytes: &[u8]) -> Result<(), RecordError> {
        self.log.frame(bytes)?;
        if self.synced.elapsed() >= SYNC_EVERY {
            self.log.sync()?;
            self.log.check_place()?;
            self.synced = Instant::now();
        }
        Ok(())
    }

    /// Whether settled poses go to poses.csv.
    pub fn writes_poses(&self) -> bool {
        self.poses.is_some() && self.connected.is_some()
    }

    /// Keeps poses.
    ///
    /// # Errors
    /// [`RecordError::Poses`], [`RecordError::Log`], [`RecordError::NotConnected`].
    pub fn poses(&mut self, poses: &[MeasuredPose]) -> Result<(), RecordError> {
        let (Some(file), Some((connection, _))) = (&mut self.poses, &self.connected) else {
            return Err(RecordError::NotConnected);
        };
        for pose in poses {
            self.log.pose_mark(&PoseMark::measured(pose, file.kinds().len()))?;
        }
        let added = file.add(poses.iter().map(|pose| SettledRow::new(connection, pose)));
        self.note_change(added)
    }

    /// What somebody else takes out of poses.csv while this program records stays out.
    fn note_change<T>(&mut self, result: Result<T, PoseFileError>) -> Result<T, RecordError> {
        if let (Err(PoseFileError::Changed(change)), Some(file)) = (&result, &self.poses)
            && !self.is_change_noted
        {
            self.is_change_noted = true;
            for mark in PoseMark::erased(&file.taken_out(change)) {
                self.log.pose_mark(&mark)?;
            }
        }
        Ok(result?)
    }

    /// Lines of plan.csv that poses were kept for, over all runs.
    pub fn measured_lines(&self) -> Vec<usize> {
        self.poses.as_ref().map_or_else(Vec::new, |file| file.plan_rows().collect())
    }

    /// Lines of plan.csv that the operator skipped, over all runs.
    pub fn skipped_lines(&self) -> Vec<usize> {
        self.description.description.runs.iter().flat_map(|run| run.skipped.iter().copied()).collect()
    }

    /// Notes that the operator skips a line of plan.csv.
    ///
    /// # Errors
    /// [`RecordError::Description`].
    pub fn skip(&mut self, line: usize) -> Result<(), RecordError> {
        if let Some(run) = self.description.description.runs.last_mut() {
            run.skipped.push(line);
        }
        Ok(self.description.write()?)
    }

    /// Takes the latest pose, or all those of the latest move, out again.
    ///
    /// # Errors
    /// [`RecordError::Poses`], [`RecordError::Log`].
    pub fn erase_last(&mut self) -> Result<Erased, RecordError> {
        let erased = self.poses.as_mut().map_or(Ok(Erased::default()), PoseFile::erase_last);
        let erased = self.note_change(erased)?;
        for mark in PoseMark::erased(&erased.times_us) {
            self.log.pose_mark(&mark)?;
        }
        // With less than this on the disk, a power cut would bring them back.
        self.log.sync()?;
        Ok(erased)
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

    /// Ends the run, as far as that can be done.
    ///
    /// # Errors
    /// [`RecordError`], the first of several.
    pub fn end(mut self) -> Result<(), RecordError> {
        let checked = self.poses.as_ref().map_or(Ok(()), PoseFile::check);
        let checked = self.note_change(checked);
        let logged = self.log.sync().and_then(|()| self.log.check_place());
        let added = self.poses.as_ref().map_or(0, PoseFile::added);
        if let Some(run) = self.description.description.runs.last_mut() {
            run.ended = Some(now());
            run.poses = added;
        }
        let described = self.description.write();
        checked.and(logged.map_err(Into::into)).and(described.map_err(Into::into))
    }
}

impl<'a> SettledRow<'a> {
    /// A pose of a connection.
    pub(super) fn new(Connection { chuck, sphere, bar_m }: &'a Connection, pose: &MeasuredPose) -> Self {
        SettledRow {
            chuck,
            sphere,
            q: pose.q,
            approach: pose.approach,
            length_m: bar_m + pose.displacement_m,
            t_s: pose.t_s,
            bar_m: *bar_m,
            rate_m_s: pose.rate_m_s,
            plan_row: pose.plan_row,
        }
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
