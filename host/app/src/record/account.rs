//! What came of a stream so far: counts, losses, the latest values, and the recording.

use ballbar::wire::{Event, Status, Stream};
use ballbar::{JointVector, Pairing, SettleDetector, SettledPose, StillnessCriteria};
use ballbar_calib::model::{BeyondLimits, Robot};

use super::latest::{ExpectedLength, Latest};
use super::news::{Fate, News, Settled, SettledAt};
use crate::board::{Frame, OtherRobot, Refusals, RobotOnBoard, StreamLosses, check_kinds};
use crate::session::{Connection, RecordError, Recorder, SettledFate, SettledRule};
use crate::units::{mm_from_m, tidy};

/// What is known of the arm before anything comes.
pub struct Watched {
    /// The parameters that the board uses.
    pub robot: Option<RobotOnBoard>,
    /// The robot's file, for its limits.
    pub limits: Option<Robot>,
    /// What the bar joins.
    pub connection: Option<Connection>,
    /// Where in the rig that is.
    pub pairing: Option<Pairing<f64>>,
    /// When the arm stands still.
    pub criteria: StillnessCriteria,
}

/// How much came.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Samples.
    pub samples: u64,
    /// Settled poses.
    pub settled: u64,
    /// Poses of the tool.
    pub tool_poses: u64,
    /// Settled poses that were written.
    pub written: u64,
    /// Settled poses that were not written because not every encoder was homed.
    pub withheld: u64,
    /// Settled poses with a joint beyond its limits.
    pub beyond_limits: u64,
    /// Times that the board was away.
    pub gaps: u64,
}

/// The books of one run.
pub struct Account {
    watched: Watched,
    /// What computes lengths, where that can be.
    expected: Option<ExpectedLength>,
    /// Of the session, where one is recorded.
    recorder: Option<Recorder>,
    counts: Counts,
    /// Poses of earlier runs that the log held and poses.csv lacked.
    recovered: usize,
    /// Joints of which it was said that they are beyond their limits.
    said_beyond: Vec<usize>,
    /// Of this link and those before it.
    losses: StreamLosses,
    losses_before: StreamLosses,
    latest: Latest,
    is_homed: Option<bool>,
    /// Which settled poses are written.
    rule: SettledRule,
    refusals: Refusals,
    /// Follows the board's own, where samples come.
    detector: SettleDetector,
    /// Time and index of the first and the latest sample since the port was last lost.
    clock: Option<[(u64, u32); 2]>,
}

impl Account {
    /// At the beginning of a run that is not recorded.
    ///
    /// # Errors
    /// [`OtherRobot`] when the limits are not those of the board's robot.
    pub fn new(watched: Watched) -> Result<Self, OtherRobot> {
        if let (Some(limits), Some(robot)) = (&watched.limits, &watched.robot) {
            check_kinds(limits, robot.kinds())?;
        }
        let between = watched.robot.as_ref().zip(watched.pairing);
        Ok(Self {
            expected: between.and_then(|(robot, pairing)| ExpectedLength::new(robot, pairing)),
            recorder: None,
            counts: Counts::default(),
            recovered: 0,
            said_beyond: Vec::new(),
            losses: StreamLosses::default(),
            losses_before: StreamLosses::default(),
            latest: Latest::default(),
            is_homed: None,
            rule: SettledRule::new(watched.criteria),
            refusals: Refusals::default(),
            detector: SettleDetector::new(watched.criteria),
            clock: None,
            watched,
        })
    }

    /// Records from here on. Every settled pose is one of the connection, by the criteria: the log has both, so that what is recovered
    /// from it is what would have been written.
    ///
    /// # Errors
    /// [`RecordError::Log`], [`RecordError::LongNames`].
    pub fn with_recorder(self, mut recorder: Recorder) -> Result<Self, RecordError> {
        match self.watched.connection.clone() {
            Some(connection) => recorder.connect_for_every_settled(connection, self.watched.criteria)?,
            None => recorder.connect(None)?,
        }
        Ok(Self { recovered: recorder.recovered(), recorder: Some(recorder), ..self })
    }

    /// The parameters that the board uses.
    pub fn robot(&self) -> Option<&RobotOnBoard> {
        self.watched.robot.as_ref()
    }

    /// What the bar joins.
    pub fn connection(&self) -> Option<&Connection> {
        self.watched.connection.as_ref()
    }

    /// When the arm stands still.
    pub fn criteria(&self) -> StillnessCriteria {
        self.watched.criteria
    }

    /// Whether it is known where the limits of the joints are.
    pub fn knows_limits(&self) -> bool {
        self.watched.limits.is_some()
    }

    /// How much came.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Poses of earlier runs that the log held and poses.csv lacked, and that were written when this run began.
    pub fn recovered(&self) -> usize {
        self.recovered
    }

    /// The latest values.
    pub fn latest(&self) -> &Latest {
        &self.latest
    }

    /// Whether all encoders of the joints were homed, as of the latest message.
    pub fn is_homed(&self) -> Option<bool> {
        self.is_homed
    }

    /// What was lost and refused, over all links.
    pub fn losses(&self) -> StreamLosses {
        self.losses
    }

    /// Length of the bar at mid travel, where it is known.
    pub fn bar_mm(&self) -> Option<f64> {
        self.connection().map(|connection| tidy(mm_from_m(connection.bar_m)))
    }

    /// Measured less expected length, millimetres, where both are known.
    pub fn residual_mm(&self) -> Option<f64> {
        Some(self.latest.length_mm? - self.expected.as_ref()?.length_mm(self.latest.q.as_ref()?)?)
    }

    /// Samples a second by the board's clock.
    pub fn rate_hz(&self) -> Option<f64> {
        let [(t0_us, first), (t1_us, last)] = self.clock?;
        let samples = last.wrapping_sub(first);
        (t1_us > t0_us).then(|| f64::from(samples) / ((t1_us - t0_us) as f64 * 1e-6))
    }

    /// Takes a frame; the log keeps it as it came.
    ///
    /// # Errors
    /// [`RecordError`] when it, or the pose in it, cannot be kept.
    pub fn take(&mut self, frame: &Frame) -> Result<Option<News>, RecordError> {
        if let Some(recorder) = &mut self.recorder {
            recorder.frame(&frame.bytes)?;
        }
        let stream = match &frame.message {
            Ok(stream) => stream,
            Err(reason) => return Ok(self.refusals.note(*reason).map(News::Refused)),
        };
        self.is_homed = self.robot().map(|robot| robot.is_homed(stream.homed));
        match &stream.event {
            Event::Samples(batch) => {
                let bar_mm = self.bar_mm();
                self.counts.samples += batch.len() as u64;
                if let Some(robot) = &self.watched.robot {
                    self.rule.take_samples(robot, batch);
                }
                for sample in batch.samples() {
                    let now = (sample.t_us, sample.index);
                    self.clock = Some([self.clock.map_or(now, |[first, _]| first), now]);
                    self.detector.push(&sample);
                    if sample.index == batch.first.index.wrapping_add(batch.rest.len() as u32) {
                        self.latest.take_sample(&sample, self.watched.robot.as_ref(), bar_mm);
                    }
                }
                self.latest.take_stillness(self.detector.stillness());
                Ok(None)
            }
            Event::Settled(pose) => Ok(Some(News::Settled(Box::new(self.take_settled(pose, stream)?)))),
            Event::Poses(batch) => {
                self.counts.tool_poses += batch.poses.len() as u64;
                if let Some(pose) = batch.poses.last() {
                    self.latest.take_pose(pose);
                }
                Ok(None)
            }
        }
    }

    /// Takes what the board says of itself when it is asked.
    pub fn take_status(&mut self, status: &Status) {
        let bar_mm = self.bar_mm();
        self.is_homed = self.robot().map(|robot| robot.is_homed_by(status));
        self.latest.take_status(status, self.watched.robot.as_ref(), bar_mm);
    }

    /// What the link has lost and refused so far.
    pub fn count_losses(&mut self, of_link: StreamLosses) {
        self.losses = self.losses_before + of_link;
    }

    /// The port was lost, or the board reset.
    ///
    /// # Errors
    /// [`RecordError`].
    pub fn lose(&mut self) -> Result<(), RecordError> {
        self.counts.gaps += 1;
        self.losses_before = self.losses;
        self.clock = None;
        self.detector.restart();
        self.rule.lose_port();
        self.recorder.as_mut().map_or(Ok(()), Recorder::lost)
    }

    /// The port is back, with the frames in which the board said what it is and, maybe, what it uses.
    ///
    /// # Errors
    /// [`RecordError`].
    pub fn regain(&mut self, hello_frame: &[u8], robot_frame: Option<&[u8]>) -> Result<(), RecordError> {
        let Some(recorder) = &mut self.recorder else { return Ok(()) };
        recorder.back()?;
        recorder.frame(hello_frame)?;
        robot_frame.map_or(Ok(()), |frame| recorder.frame(frame))
    }

    /// Ends the recording, as far as that can be done.
    ///
    /// # Errors
    /// [`RecordError`], the first of several.
    pub fn end(&mut self) -> Result<(), RecordError> {
        self.recorder.take().map_or(Ok(()), Recorder::end)
    }

    fn take_settled(&mut self, pose: &SettledPose, stream: &Stream) -> Result<Settled, RecordError> {
        self.counts.settled += 1;
        let number = self.counts.settled;
        let at = match self.robot().map(|robot| (robot.settled(pose), robot.is_homed(stream.homed))) {
            None => None,
            Some(((q, displacement_m), is_homed)) => {
                let newly_beyond = self.take_limits(&q, is_homed);
                let kept = |displacement_m| self.keep(pose, stream.homed).map(|fate| (displacement_m, fate));
                Some(SettledAt { q, bar: displacement_m.map(kept).transpose()?, newly_beyond })
            }
        };
        Ok(Settled { number, pose: pose.clone(), at })
    }

    /// The joints that are beyond their limits for the first time. Before the encoders are homed they tell nothing.
    fn take_limits(&mut self, q: &JointVector<f64>, is_homed: bool) -> Vec<BeyondLimits> {
        let Some(robot) = self.watched.limits.as_ref().filter(|_| is_homed) else { return Vec::new() };
        let mut beyond: Vec<BeyondLimits> = robot.beyond_limits(q.as_array()).collect();
        self.counts.beyond_limits += u64::from(!beyond.is_empty());
        beyond.retain(|beyond| !self.said_beyond.contains(&beyond.joint));
        self.said_beyond.extend(beyond.iter().map(|beyond| beyond.joint));
        beyond
    }

    /// Writes a pose with a length, where poses are written.
    fn keep(&mut self, pose: &SettledPose, homed: u8) -> Result<Fate, RecordError> {
        let Some(robot) = &self.watched.robot else { return Ok(Fate::Seen { is_homed: false }) };
        let Some(recorder) = self.recorder.as_mut().filter(|recorder| recorder.writes_poses()) else {
            return Ok(Fate::Seen { is_homed: robot.is_homed(homed) });
        };
        match self.rule.judge(robot, pose, homed) {
            SettledFate::Kept(pose) => {
                recorder.poses(&[pose])?;
                self.counts.written += 1;
                Ok(Fate::Written)
            }
            SettledFate::NotHomed => {
                self.counts.withheld += 1;
                Ok(Fate::Withheld)
            }
            SettledFate::SameStand => Ok(Fate::SameStand),
            // Without a length it does not come here.
            SettledFate::BeyondTravel => Ok(Fate::Seen { is_homed: true }),
        }
    }
}
