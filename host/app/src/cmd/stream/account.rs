//! What came of a stream so far: counts, losses, the latest values, and the recording.

use ballbar::wire::{Event, Status, Stream};
use ballbar::{JointVector, SettleDetector, SettledPose, StillnessCriteria};
use ballbar_calib::model::{BeyondLimits, Robot};

use super::live::{Latest, Model};
use super::record_error;
use super::watch::RobotAndFrame;
use crate::board::{Frame, Refusals, RobotOnBoard, StreamLosses};
use crate::cmd::outcome::CommandError;
use crate::session::{Connection, Recorder, SettledFate, SettledRule};
use crate::units::{mm_from_m, tidy};

/// The books of one run.
pub(super) struct Account {
    pub(super) robot: Option<RobotOnBoard>,
    /// The robot's file, for its limits.
    pub(super) limits: Option<Robot>,
    /// Settled poses with a joint beyond its limits, and joints of which it was said.
    pub(super) beyond_limits: u64,
    said_beyond: Vec<usize>,
    /// What computes lengths, where that can be.
    model: Option<Model>,
    pub(super) recorder: Option<Recorder>,
    pub(super) connection: Option<Connection>,
    /// Of this link and those before it.
    losses: StreamLosses,
    losses_before: StreamLosses,
    pub(super) latest: Latest,
    pub(super) samples: u64,
    pub(super) settled: u64,
    pub(super) tool_poses: u64,
    pub(super) written: u64,
    /// Settled poses that were not written because not every encoder was homed.
    pub(super) withheld: u64,
    pub(super) gaps: u64,
    /// Whether all encoders of the joints were homed, as of the latest message.
    pub(super) is_homed: Option<bool>,
    /// Which settled poses are written.
    rule: SettledRule,
    refusals: Refusals,
    /// Follows the board's own, where samples come.
    detector: SettleDetector,
    /// Time and index of the first and the latest sample since the port was last lost.
    clock: Option<[(u64, u32); 2]>,
}

impl Account {
    pub(super) fn new(
        robot: Option<RobotOnBoard>,
        limits: Option<Robot>,
        model: Option<Model>,
        recorder: Option<Recorder>,
        connection: Option<Connection>,
        criteria: StillnessCriteria,
    ) -> Self {
        Self {
            robot,
            limits,
            beyond_limits: 0,
            said_beyond: Vec::new(),
            model,
            recorder,
            connection,
            withheld: 0,
            rule: SettledRule::new(criteria),
            refusals: Refusals::default(),
            detector: SettleDetector::new(criteria),
            losses: StreamLosses::default(),
            losses_before: StreamLosses::default(),
            latest: Latest::default(),
            samples: 0,
            settled: 0,
            tool_poses: 0,
            written: 0,
            gaps: 0,
            is_homed: None,
            clock: None,
        }
    }

    /// Takes a frame; returns a line to show when a pose has settled, and when a message is not believed for the first time. The log
    /// keeps both as they came.
    pub(super) fn take(&mut self, frame: &Frame) -> Result<Option<String>, CommandError> {
        if let Some(recorder) = &mut self.recorder {
            recorder.frame(&frame.bytes).map_err(record_error)?;
        }
        let stream = match &frame.message {
            Ok(stream) => stream,
            Err(reason) => return Ok(self.refusals.note(*reason)),
        };
        self.is_homed = self.robot.as_ref().map(|robot| robot.is_homed(stream.homed));
        match &stream.event {
            Event::Samples(batch) => {
                self.samples += batch.len() as u64;
                for sample in batch.samples() {
                    let now = (sample.t_us, sample.index);
                    self.clock = Some([self.clock.map_or(now, |[first, _]| first), now]);
                    self.detector.push(&sample);
                    if sample.index == batch.first.index.wrapping_add(batch.rest.len() as u32) {
                        self.latest.take_sample(&sample, self.robot.as_ref(), self.bar_mm());
                    }
                }
                self.latest.take_stillness(self.detector.stillness());
                Ok(None)
            }
            Event::Settled(pose) => self.take_settled(pose, stream).map(Some),
            Event::Poses(batch) => {
                self.tool_poses += batch.poses.len() as u64;
                if let Some(pose) = batch.poses.last() {
                    self.latest.take_pose(pose);
                }
                Ok(None)
            }
        }
    }

    /// What the link has lost and refused so far.
    pub(super) fn count_losses(&mut self, of_link: StreamLosses) {
        self.losses = self.losses_before + of_link;
    }

    pub(super) fn losses(&self) -> StreamLosses {
        self.losses
    }

    pub(super) fn take_status(&mut self, status: &Status) {
        self.is_homed = self.robot.as_ref().map(|robot| robot.is_homed_by(status));
        self.latest.take_status(status, self.robot.as_ref(), self.bar_mm());
    }

    /// The port was lost, or the board reset.
    pub(super) fn lose(&mut self) -> Result<(), CommandError> {
        self.gaps += 1;
        self.losses_before = self.losses;
        self.clock = None;
        self.detector.restart();
        self.rule.lose_port();
        self.recorder.as_mut().map_or(Ok(()), Recorder::lost).map_err(record_error)
    }

    /// The port is back, with the frames in which the board said what it is and what it uses.
    pub(super) fn regain(&mut self, hello_frame: &[u8], robot: Option<&RobotAndFrame>) -> Result<(), CommandError> {
        let Some(recorder) = &mut self.recorder else { return Ok(()) };
        recorder.back().map_err(record_error)?;
        recorder.frame(hello_frame).map_err(record_error)?;
        robot.map_or(Ok(()), |(_, frame)| recorder.frame(frame)).map_err(record_error)
    }

    fn bar_mm(&self) -> Option<f64> {
        self.connection.as_ref().map(|connection| tidy(mm_from_m(connection.bar_m)))
    }

    /// Messages and samples lost.
    pub(super) fn lost(&self) -> u64 {
        self.losses.lost()
    }

    /// Measured less computed length, millimetres, where both are known.
    pub(super) fn residual_mm(&self) -> Option<f64> {
        Some(self.latest.length_mm? - self.model.as_ref()?.length_mm(self.latest.q.as_ref()?)?)
    }

    /// How things stand, in a line.
    pub(super) fn text(&self) -> String {
        let kinds = self.robot.as_ref().map_or(&[][..], RobotOnBoard::kinds);
        let rate = self.rate_hz().map_or(String::new(), |hz| format!("{hz:.0} Hz  "));
        format!("{rate}settled {}  lost {}  {}", self.settled, self.lost(), self.latest.text(kinds))
    }

    /// Samples a second by the board's clock.
    pub(super) fn rate_hz(&self) -> Option<f64> {
        let [(t0_us, first), (t1_us, last)] = self.clock?;
        let samples = last.wrapping_sub(first);
        (t1_us > t0_us).then(|| f64::from(samples) / ((t1_us - t0_us) as f64 * 1e-6))
    }

    fn take_settled(&mut self, pose: &SettledPose, stream: &Stream) -> Result<String, CommandError> {
        self.settled += 1;
        let number = self.settled;
        let Some(robot) = &self.robot else {
            return Ok(format!("settled {number}: counts {:?}, code {:.1}", pose.counts_mean.as_slice(), pose.code_mean));
        };
        let (q, displacement_m) = robot.settled(pose);
        let joints = crate::units::joints_text(robot.kinds(), q.as_array());
        let beyond = self.take_limits(&q, robot.is_homed(stream.homed));
        let Some(displacement_m) = displacement_m else {
            return Ok(format!("settled {number}: {joints}, and the bar beyond its travel: no pose{beyond}"));
        };
        let displacement_mm = mm_from_m(displacement_m);
        let length = match self.bar_mm() {
            Some(bar_mm) => format!("{:.4} mm", bar_mm + displacement_mm),
            None => format!("{displacement_mm:+.4} mm from mid travel"),
        };
        let fate = self.keep(pose, stream.homed)?;
        Ok(format!("settled {number}: {joints}, {length}, {} samples{fate}{beyond}", pose.samples))
    }

    /// A line for every joint that is beyond its limits for the first time. Before the encoders are homed they tell nothing.
    fn take_limits(&mut self, q: &JointVector<f64>, is_homed: bool) -> String {
        let Some(robot) = self.limits.as_ref().filter(|_| is_homed) else { return String::new() };
        let beyond: Vec<BeyondLimits> = robot.beyond_limits(q.as_array()).collect();
        self.beyond_limits += u64::from(!beyond.is_empty());
        let new = beyond.into_iter().filter(|beyond| !self.said_beyond.contains(&beyond.joint)).collect::<Vec<_>>();
        self.said_beyond.extend(new.iter().map(|beyond| beyond.joint));
        new.iter().map(|beyond| format!("\nwarning: {beyond}: is the board homed where the robot stands?")).collect()
    }

    /// Writes a pose, where poses are written, and says when it is not.
    fn keep(&mut self, pose: &SettledPose, homed: u8) -> Result<&'static str, CommandError> {
        let Some(robot) = &self.robot else { return Ok("") };
        let Some(recorder) = self.recorder.as_mut().filter(|recorder| recorder.writes_poses()) else {
            return Ok(if robot.is_homed(homed) { "" } else { "; NOT HOMED: host-cal home PORT --q …" });
        };
        match self.rule.judge(robot, pose, homed) {
            SettledFate::Kept(pose) => {
                recorder.poses(&[pose]).map_err(record_error)?;
                self.written += 1;
                Ok("")
            }
            SettledFate::BeyondTravel => Ok(""),
            SettledFate::NotHomed => {
                self.withheld += 1;
                Ok("; not written, because the encoders are NOT HOMED: host-cal home PORT --q …")
            }
            SettledFate::SameStand => Ok("; still where the last pose was written: not written again"),
        }
    }
}
