//! The board during a collection: what it says is recorded, and its latest word kept.

use std::time::{Duration, Instant};

use ballbar::wire::{Answer, Command, Event, Stream, StreamSelection};
use ballbar::{Approach, JointVector, Sample, SettleDetector, SettledPose, Stillness, StillnessCriteria};

use super::check_board::CheckedBoard;
use super::errors::CollectError;
use super::track::TrackPoint;
use crate::board::{ApproachWatch, BoardError, BoardLink, Frame, Refusals, RobotOnBoard, StreamLosses};
use crate::deadline::StopFlag;
use crate::session::Recorder;

/// The arm at the latest sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Time by the board's clock, microseconds.
    pub t_us: u64,
    /// Encoder outputs, radians or metres.
    pub q: JointVector<f64>,
    /// Displacement of the bar from mid travel, metres; `None` without a bar within its travel.
    pub displacement_m: Option<f64>,
    /// Whether all encoders of the joints are homed.
    pub is_homed: bool,
    /// Since when there is no bar within its travel, by the board's clock, microseconds.
    pub off_since_us: Option<u64>,
    /// Whether the arm stands still.
    pub stillness: Stillness,
}

/// A pose at which the arm stood still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// Encoder outputs, means, radians or metres.
    pub q: JointVector<f64>,
    /// From which sides the joints came there, where it is known.
    pub approach: Approach,
    /// Mean displacement of the bar from mid travel, metres; `None` beyond it.
    pub displacement_m: Option<f64>,
    /// Beginning of the time of which this is the mean, by the board's clock, microseconds.
    pub began_us: u64,
    /// Middle of it, seconds.
    pub t_s: f64,
}

/// A board that streams into a session.
pub struct BoardWatch {
    link: BoardLink,
    robot: RobotOnBoard,
    recorder: Recorder,
    criteria: StillnessCriteria,
    /// Follows the board's own detector.
    detector: SettleDetector,
    approach: ApproachWatch,
    period_us: u64,
    refusals: Refusals,
    /// What is to be said of refused messages.
    refusal: Option<String>,
    /// Time and index of the first sample.
    first: Option<(u64, u32)>,
    /// Index of the latest.
    index: u32,
    view: Option<View>,
    stand: Option<Stand>,
    track: Option<Vec<TrackPoint>>,
    is_watchful: bool,
    heard: Instant,
}

/// The stream has samples all the time: after this much silence something is wrong.
const SILENCE: Duration = Duration::from_secs(3);
/// The same while the robot moves: at 30 degrees per second it goes as many.
const SILENCE_ON_THE_WAY: Duration = Duration::from_secs(1);

impl BoardWatch {
    /// From here on nothing is waited for any longer once the flag is set.
    pub fn heed(&mut self, stop: &StopFlag) {
        self.link.heed(stop);
    }

    /// Lets a board stream samples and settled poses.
    ///
    /// # Errors
    /// [`CollectError`] when the board refuses or is gone.
    pub fn begin(
        board: CheckedBoard,
        recorder: Recorder,
        rate_hz: u16,
        criteria: StillnessCriteria,
    ) -> Result<Self, CollectError> {
        let CheckedBoard { mut link, robot, .. } = board;
        link.act(Command::SetRate { rate_hz })?;
        link.act(Command::SetStillness(criteria))?;
        link.start_stream(StreamSelection { samples: true, settled: true, poses: false })?;
        let (refusals, refusal, detector) = (Refusals::default(), None, SettleDetector::new(criteria));
        let approach = ApproachWatch::new(&robot, &criteria);
        let (heard, period_us) = (Instant::now(), 1_000_000 / u64::from(rate_hz.max(1)));
        let (first, index, view, stand, track, is_watchful) = (None, 0, None, None, None, false);
        Ok(Self {
            link,
            robot,
            recorder,
            criteria,
            detector,
            approach,
            period_us,
            refusals,
            refusal,
            first,
            index,
            view,
            stand,
            track,
            is_watchful,
            heard,
        })
    }

    /// The parameters that the board uses.
    pub fn robot(&self) -> &RobotOnBoard {
        &self.robot
    }

    /// The session.
    pub fn recorder(&mut self) -> &mut Recorder {
        &mut self.recorder
    }

    /// Takes one frame, or waits some milliseconds for one.
    ///
    /// # Errors
    /// [`CollectError::Silent`], also when what comes is not to be believed, [`CollectError::Port`], [`CollectError::Record`].
    pub fn listen(&mut self) -> Result<(), CollectError> {
        if let Some(frame) = self.link.next_frame()? {
            self.take(&frame)?;
        }
        let silence = if self.is_watchful { SILENCE_ON_THE_WAY } else { SILENCE };
        let silent = self.heard.elapsed();
        if silent > silence { Err(self.silent(silent)) } else { Ok(()) }
    }

    /// What is to be said of messages that were refused, once for each reason.
    pub(super) fn take_refusal(&mut self) -> Option<String> {
        self.refusal.take()
    }

    fn silent(&self, silent: Duration) -> CollectError {
        CollectError::Silent { port: self.link.port_name().to_owned(), seconds: silent.as_secs_f64() }
    }

    /// While the robot moves, silence is put up with for a shorter time.
    pub(super) fn be_watchful(&mut self, is_watchful: bool) {
        self.is_watchful = is_watchful;
    }

    /// The latest sample; waits for the first one.
    ///
    /// # Errors
    /// As [`BoardWatch::listen`].
    pub fn view(&mut self) -> Result<View, CollectError> {
        loop {
            if let Some(view) = self.view {
                return Ok(view);
            }
            self.link.check_stop()?;
            self.listen()?;
        }
    }

    /// The latest sample and no waiting.
    pub fn latest(&self) -> Option<&View> {
        self.view.as_ref()
    }

    /// Samples a second so far, by the board's clock.
    pub fn rate_hz(&self) -> Option<f64> {
        let ((t0_us, first), view) = (self.first?, self.view?);
        (view.t_us > t0_us).then(|| f64::from(self.index.wrapping_sub(first)) / ((view.t_us - t0_us) as f64 * 1e-6))
    }

    /// What was lost so far.
    pub fn losses(&self) -> StreamLosses {
        self.link.losses()
    }

    /// The latest pose at which the arm stood still, once.
    pub fn take_stand(&mut self) -> Option<Stand> {
        self.stand.take()
    }

    /// The arm now: samples that the board took before may still be on their way.
    ///
    /// # Errors
    /// [`CollectError::Board`].
    pub fn ask(&mut self) -> Result<View, CollectError> {
        let Answer::Status(status) = self.link.request(Command::Status)? else {
            return Err(BoardError::WrongAnswer { command: "status" }.into());
        };
        let displacement_m = self.robot.displacement_m(status.lvdt);
        Ok(View {
            t_us: status.uptime_us,
            q: self.robot.q(status.encoders.iter().map(|encoder| f64::from(encoder.counts))),
            displacement_m,
            is_homed: self.robot.is_homed_by(&status),
            off_since_us: displacement_m.is_none().then_some(status.uptime_us),
            stillness: status.stillness,
        })
    }

    /// Lets the board report the pose at which the arm stands now, although it may have done so before. A time of the board's between
    /// the two.
    ///
    /// # Errors
    /// [`CollectError::Board`].
    pub fn rearm(&mut self) -> Result<u64, CollectError> {
        let now_us = self.ask()?.t_us;
        self.link.act(Command::SetStillness(self.criteria))?;
        self.detector.restart();
        self.stand = None;
        Ok(now_us)
    }

    /// The first sample that was surely latched after the board told this time: it tells that of the latest sample it has taken up,
    /// and the one behind it is latched already.
    ///
    /// # Errors
    /// As [`BoardWatch::listen`].
    pub fn view_after(&mut self, t_us: u64) -> Result<View, CollectError> {
        let began = Instant::now();
        loop {
            if let Some(view) = self.view.filter(|view| view.t_us > t_us + 2 * self.period_us) {
                return Ok(view);
            }
            if began.elapsed() > SILENCE {
                return Err(self.silent(began.elapsed()));
            }
            self.link.check_stop()?;
            self.listen()?;
        }
    }

    /// From here on samples are kept; gives those kept so far.
    pub(super) fn track(&mut self, is_on: bool) -> Vec<TrackPoint> {
        std::mem::replace(&mut self.track, is_on.then(Vec::new)).unwrap_or_default()
    }

    /// Travel left inwards and outwards at a displacement, metres.
    pub fn travel_left_m(&self, displacement_m: f64) -> [f64; 2] {
        let (least_m, most_m) = self.robot.set().lvdt.travel_m::<f64>();
        [displacement_m - least_m, most_m - displacement_m]
    }

    /// Ends stream and session; tells what was lost, and whether all could be written.
    pub fn end(mut self) -> (StreamLosses, Result<(), CollectError>) {
        // A board that is gone by now needs no end.
        let _ = self.link.end_stream();
        // What the board had gathered came before its answers.
        let written = self.link.take_frames().iter().try_for_each(|frame| self.take(frame));
        let ended = self.recorder.end().map_err(CollectError::from);
        (self.link.losses(), written.and(ended))
    }

    /// Keeps a frame as it came, and takes what is to be believed of it.
    fn take(&mut self, frame: &Frame) -> Result<(), CollectError> {
        self.recorder.frame(&frame.bytes)?;
        match &frame.message {
            Ok(stream) => {
                self.heard = Instant::now();
                self.take_stream(stream);
            }
            Err(reason) => self.refusal = self.refusals.note(*reason).or(self.refusal.take()),
        }
        Ok(())
    }

    fn take_stream(&mut self, stream: &Stream) {
        let is_homed = self.robot.is_homed(stream.homed);
        match &stream.event {
            Event::Samples(batch) => batch.samples().for_each(|sample| self.take_sample(&sample, is_homed)),
            Event::Settled(pose) => self.stand = Some(self.stand_of(pose)),
            Event::Poses(_) => {}
        }
    }

    fn take_sample(&mut self, sample: &Sample, is_homed: bool) {
        let q = self.robot.q(sample.counts.iter().map(|&counts| f64::from(counts)));
        let displacement_m = self.robot.displacement_m(sample.lvdt);
        let off_since_us = match displacement_m {
            Some(_) => None,
            None => self.view.and_then(|view| view.off_since_us).or(Some(sample.t_us)),
        };
        self.detector.push(sample);
        self.approach.take(sample, &q);
        self.first.get_or_insert((sample.t_us, sample.index));
        self.index = sample.index;
        let stillness = self.detector.stillness();
        self.view = Some(View { t_us: sample.t_us, q, displacement_m, is_homed, off_since_us, stillness });
        if let (Some(track), Some(displacement_m)) = (&mut self.track, displacement_m) {
            track.push(TrackPoint { t_s: sample.t_us as f64 * 1e-6, q, approach: self.approach.approach(), displacement_m });
        }
    }

    fn stand_of(&self, pose: &SettledPose) -> Stand {
        let (q, displacement_m) = self.robot.settled(pose);
        let t_s = (pose.t_us as f64 + f64::from(pose.duration_us) / 2.0) * 1e-6;
        Stand { q, approach: self.approach.approach(), displacement_m, began_us: pose.t_us, t_s }
    }
}
