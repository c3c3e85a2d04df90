//! What came of a stream so far: counts, losses, the latest values, and the recording.

use ballbar::SettledPose;
use ballbar::wire::{Event, Status, Stream, ToHost};

use super::live::Latest;
use super::record_error;
use crate::board::{Frame, RobotOnBoard, StreamTally};
use crate::cmd::outcome::CommandError;
use crate::session::Recorder;

/// The books of one run.
pub(super) struct Account {
    pub(super) robot: Option<RobotOnBoard>,
    pub(super) recorder: Option<Recorder>,
    pub(super) bar_mm: Option<f64>,
    pub(super) tally: StreamTally,
    pub(super) latest: Latest,
    pub(super) samples: u64,
    pub(super) settled: u64,
    pub(super) tool_poses: u64,
    pub(super) written: u64,
    pub(super) gaps: u64,
    /// Time and index of the first and the latest sample since the port was last lost.
    clock: Option<[(u64, u32); 2]>,
}

impl Account {
    pub(super) fn new(robot: Option<RobotOnBoard>, recorder: Option<Recorder>, bar_mm: Option<f64>) -> Self {
        Self {
            robot,
            recorder,
            bar_mm,
            tally: StreamTally::default(),
            latest: Latest::default(),
            samples: 0,
            settled: 0,
            tool_poses: 0,
            written: 0,
            gaps: 0,
            clock: None,
        }
    }

    /// Takes a frame; returns a line to show when a pose has settled.
    pub(super) fn take(&mut self, frame: &Frame) -> Result<Option<String>, CommandError> {
        let ToHost::Stream(stream) = &frame.message else { return Ok(None) };
        if let Some(recorder) = &mut self.recorder {
            recorder.frame(&frame.bytes).map_err(record_error)?;
        }
        self.tally.take(stream);
        match &stream.event {
            Event::Samples(batch) => {
                self.samples += batch.len() as u64;
                for sample in batch.samples() {
                    let now = (sample.t_us, sample.index);
                    self.clock = Some([self.clock.map_or(now, |[first, _]| first), now]);
                    if sample.index == batch.first.index.wrapping_add(batch.rest.len() as u32) {
                        self.latest.take_sample(&sample, self.robot.as_ref(), self.bar_mm);
                    }
                }
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

    pub(super) fn take_status(&mut self, status: &Status) {
        self.latest.take_status(status, self.robot.as_ref(), self.bar_mm);
    }

    /// The port was lost, or the board reset.
    pub(super) fn lose(&mut self) -> Result<(), CommandError> {
        self.gaps += 1;
        self.tally.interrupt();
        self.clock = None;
        self.recorder.as_mut().map_or(Ok(()), Recorder::lost).map_err(record_error)
    }

    /// The port is back; `parameters` is the frame with what the board now uses.
    pub(super) fn regain(&mut self, robot: Option<(RobotOnBoard, Vec<u8>)>) -> Result<(), CommandError> {
        if let Some(recorder) = &mut self.recorder {
            recorder.back().map_err(record_error)?;
            if let Some((_, frame)) = &robot {
                recorder.frame(frame).map_err(record_error)?;
            }
        }
        self.robot = robot.map(|(robot, _)| robot);
        Ok(())
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
        let joints = crate::cmd::port::joints_text(robot.kinds(), q.as_array());
        let joints_of_robot = (1_u16 << robot.kinds().len()) - 1;
        let not_homed = if u16::from(stream.homed) & joints_of_robot == joints_of_robot { "" } else { "  NOT HOMED" };
        let Some(displacement_m) = displacement_m else {
            return Ok(format!("settled {number}: {joints}, and the bar beyond its travel: no pose{not_homed}"));
        };
        if let Some(recorder) = &mut self.recorder {
            let t_s = (pose.t_us as f64 + f64::from(pose.duration_us) / 2.0) * 1e-6;
            recorder.pose(q, displacement_m, t_s).map_err(record_error)?;
            self.written += 1;
        }
        let displacement_mm = displacement_m * 1e3;
        let length = match self.bar_mm {
            Some(bar_mm) => format!("{:.4} mm", bar_mm + displacement_mm),
            None => format!("{displacement_mm:+.4} mm from mid travel"),
        };
        Ok(format!("settled {number}: {joints}, {length}, {} samples{not_homed}", pose.samples))
    }
}
