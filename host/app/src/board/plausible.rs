//! What a message of a board can say, by itself: numbers that are finite and within what a board measures, for as many encoders as it
//! has. What it can say after the message before it is the business of [`super::filter`].

use ballbar::wire::{
    Answer, BoardHello, Check, CurrentPose, Event, ParameterSet, ParameterSetError, PoseBatch, Reply, SampleBatch, SelfTest,
    Status, ToolPose,
};
use ballbar::{LvdtCurve, MAX_JOINTS, SettledPose};
use thiserror::Error;

/// Why a message is not believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum Implausible {
    /// Not as many values as there are encoders or joints.
    #[error("{found} {what} instead of {expected}")]
    WrongCount {
        /// Of what.
        what: &'static str,
        /// How many there are in the message.
        found: usize,
        /// How many the board has.
        expected: usize,
    },
    /// A number that is infinite or none.
    #[error("{0} is not a finite number")]
    NotFinite(&'static str),
    /// A number that no board measures.
    #[error("{0} is out of range")]
    OutOfRange(&'static str),
    /// Parameters that cannot be computed with.
    #[error("its parameters cannot be used: {0}")]
    Parameters(ParameterSetError),
    /// The message came already.
    #[error("it came already")]
    Repeated,
    /// A number or a time before those that came already.
    #[error("{0} goes back")]
    WentBack(&'static str),
}

/// What is known of a board, against which its messages are held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BoardFacts {
    /// Encoders that it counts; unknown in a log whose hello is damaged.
    pub(super) encoders: Option<usize>,
    /// Joints of the robot whose parameters it said it uses.
    pub(super) joints: Option<usize>,
    /// Sampling rates, Hz.
    pub(super) rate_hz: (u16, u16),
}

impl Default for BoardFacts {
    /// Of a board that has not said hello.
    fn default() -> Self {
        Self { encoders: None, joints: None, rate_hz: (1, u16::MAX) }
    }
}

impl From<&BoardHello> for BoardFacts {
    fn from(hello: &BoardHello) -> Self {
        Self {
            encoders: Some(usize::from(hello.encoders)),
            joints: hello.active.as_ref().map(|active| usize::from(active.joints)),
            rate_hz: (hello.rate_min_hz, hello.rate_max_hz),
        }
    }
}

/// No board runs longer: a hundred years. Every number of microseconds below is exact as an f64.
const MAX_UPTIME_US: u64 = 100 * 366 * 86_400 * 1_000_000;
/// No length here is longer, metres: as in the files of robots.
const MAX_LENGTH_M: f64 = 1e3;
/// No joint value is larger, radians or metres: an encoder that has counted to its end in counts as coarse as any.
const MAX_JOINT: f64 = 1e9;
/// Axes of the tool are of length one and upright on one another within this: f32 leaves a few millionths.
const AXIS_TOLERANCE: f64 = 1e-3;
/// The largest code of the LVDT.
const MAX_CODE: f64 = u16::MAX as f64;
/// Largest standard deviation of a channel that stood within its band.
const MAX_BAND: f64 = u16::MAX as f64;
/// Tests of which a self-test consists.
const CHECKS: [Check; 8] = [
    Check::Sampling,
    Check::Overruns,
    Check::LvdtSignal,
    Check::Index,
    Check::Parameters,
    Check::Slots,
    Check::Kinematics,
    Check::Stack,
];

type Checked = Result<(), Implausible>;

fn within(value: impl Into<f64>, (least, most): (f64, f64), what: &'static str) -> Checked {
    let value = value.into();
    if !value.is_finite() {
        return Err(Implausible::NotFinite(what));
    }
    if (least..=most).contains(&value) { Ok(()) } else { Err(Implausible::OutOfRange(what)) }
}

fn is_so(is_so: bool, what: &'static str) -> Checked {
    if is_so { Ok(()) } else { Err(Implausible::OutOfRange(what)) }
}

fn count(what: &'static str, found: usize, expected: Option<usize>) -> Checked {
    let expected = expected.unwrap_or(found);
    if found == expected { Ok(()) } else { Err(Implausible::WrongCount { what, found, expected }) }
}

pub(super) fn uptime(t_us: u64) -> Checked {
    is_so(t_us <= MAX_UPTIME_US, "its time")
}

/// A board introduces itself.
pub(super) fn hello(hello: &BoardHello) -> Checked {
    let encoders = usize::from(hello.encoders);
    is_so((1..=MAX_JOINTS).contains(&encoders), "the number of its encoders")?;
    is_so(hello.rate_min_hz > 0 && hello.rate_min_hz <= hello.rate_max_hz, "the range of its sampling rate")?;
    uptime(hello.uptime_us)?;
    let is_counted = |joints: u8| (1..=hello.encoders).contains(&joints);
    is_so(hello.active.as_ref().is_none_or(|active| is_counted(active.joints)), "the number of its robot's joints")
}

impl BoardFacts {
    /// The answer in a reply.
    pub(super) fn reply(&self, reply: &Reply) -> Checked {
        match &reply.outcome {
            Ok(Answer::Status(status)) => self.status(status),
            Ok(Answer::SelfTest(self_test)) => check_self_test(self_test),
            Ok(Answer::Parameters(set)) => self.parameters(set),
            Ok(Answer::CurrentPose(pose)) => self.current_pose(pose),
            Ok(Answer::Pose(pose)) => tool_pose(pose),
            Ok(Answer::Done | Answer::Staged { .. }) | Err(_) => Ok(()),
        }
    }

    /// The content of a stream message.
    pub(super) fn event(&self, event: &Event) -> Checked {
        match event {
            Event::Samples(batch) => self.samples(batch),
            Event::Settled(pose) => self.settled(pose),
            Event::Poses(batch) => poses(batch),
        }
    }

    fn status(&self, status: &Status) -> Checked {
        count("encoders", status.encoders.len(), self.encoders)?;
        uptime(status.uptime_us)?;
        is_so((self.rate_hz.0..=self.rate_hz.1).contains(&status.rate_hz), "its sampling rate")?;
        let encoders = self.encoders.unwrap_or(MAX_JOINTS);
        let is_counted = |joints: u8| (1..=encoders).contains(&usize::from(joints));
        is_so(status.active.as_ref().is_none_or(|active| is_counted(active.joints)), "the number of its robot's joints")
    }

    fn parameters(&self, set: &ParameterSet) -> Checked {
        set.compile().map_err(Implausible::Parameters)?;
        if let Some(encoders) = self.encoders.filter(|&encoders| set.kinds.len() > encoders) {
            return Err(Implausible::WrongCount { what: "joints", found: set.kinds.len(), expected: encoders });
        }
        lvdt(&set.lvdt)
    }

    fn current_pose(&self, pose: &CurrentPose) -> Checked {
        count("joint values", pose.q.len(), self.joints)?;
        uptime(pose.t_us)?;
        pose.q.iter().try_for_each(|&q| within(q, (-MAX_JOINT, MAX_JOINT), "a joint value"))?;
        displacement(pose.displacement_m)?;
        tool_pose(&pose.pose)
    }

    fn samples(&self, batch: &SampleBatch) -> Checked {
        let encoders = Some(self.encoders.unwrap_or(batch.first.counts.len()));
        count("encoders", batch.first.counts.len(), encoders)?;
        let mut code = i64::from(batch.first.lvdt.code);
        let mut t_us = batch.first.t_us;
        uptime(t_us)?;
        for step in &batch.rest {
            count("encoders", step.counts.len(), encoders)?;
            code += i64::from(step.code);
            is_so((0..=i64::from(u16::MAX)).contains(&code), "a code of the LVDT")?;
            is_so(step.dt_us > 0, "the time between samples")?;
            t_us += u64::from(step.dt_us);
        }
        uptime(t_us)
    }

    fn settled(&self, pose: &SettledPose) -> Checked {
        let encoders = Some(self.encoders.unwrap_or(pose.counts_mean.len()));
        count("encoders", pose.counts_mean.len(), encoders)?;
        count("encoders", pose.counts_std.len(), encoders)?;
        let positions = (f64::from(i32::MIN), f64::from(i32::MAX));
        pose.counts_mean.iter().try_for_each(|&mean| within(mean, positions, "a mean position"))?;
        pose.counts_std.iter().try_for_each(|&std| within(std, (0.0, MAX_BAND), "a position's deviation"))?;
        within(pose.code_mean, (0.0, MAX_CODE), "the mean code of the LVDT")?;
        within(pose.code_std, (0.0, MAX_BAND), "the code's deviation")?;
        uptime(pose.t_us)?;
        uptime(pose.t_us + u64::from(pose.duration_us))?;
        // At twice the highest rate, for clocks that are not the board's own.
        let least_us = u64::from(pose.samples.saturating_sub(1)) * 1_000_000 / u64::from(self.rate_hz.1) / 2;
        let has_stood = pose.samples >= 2 && pose.duration_us > 0 && u64::from(pose.duration_us) >= least_us;
        is_so(has_stood, "the time that the arm stood still")
    }
}

fn poses(batch: &PoseBatch) -> Checked {
    is_so(!batch.poses.is_empty() && batch.stride > 0, "the number of poses")?;
    uptime(batch.t_us)?;
    is_so(batch.poses.is_sorted_by(|a, b| a.dt_us < b.dt_us), "the time between poses")?;
    batch.poses.iter().try_for_each(|pose| {
        uptime(batch.t_us + u64::from(pose.dt_us))?;
        displacement(pose.displacement_m)?;
        tool_pose(&pose.pose)
    })
}

/// A self-test that leaves a test out has not passed it.
fn check_self_test(self_test: &SelfTest) -> Checked {
    let is_there = |check: &Check| self_test.results.iter().any(|result| result.check == *check);
    is_so(CHECKS.iter().all(is_there), "the set of its tests")
}

fn displacement(displacement_m: Option<f32>) -> Checked {
    displacement_m.map_or(Ok(()), |m| within(m, (-MAX_LENGTH_M, MAX_LENGTH_M), "the bar's displacement"))
}

/// A place within reach, and a rotation.
fn tool_pose(pose: &ToolPose) -> Checked {
    let wide = |v: [f32; 3]| v.map(f64::from);
    pose.position_m.iter().try_for_each(|&m| within(m, (-MAX_LENGTH_M, MAX_LENGTH_M), "the tool's position"))?;
    let (x, y) = (wide(pose.x_axis), wide(pose.y_axis));
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let near = |expected: f64| (expected - AXIS_TOLERANCE, expected + AXIS_TOLERANCE);
    for (product, expected) in [(dot(x, x), 1.0), (dot(y, y), 1.0), (dot(x, y), 0.0)] {
        within(product, near(expected), "the tool's rotation")?;
    }
    Ok(())
}

/// A curve that gives a displacement at every code of its travel.
fn lvdt(curve: &LvdtCurve) -> Checked {
    (curve.code_min..=curve.code_max).step_by(64).chain([curve.code_max]).try_for_each(|code| {
        let displacement_m = curve.displacement_of_code_m(f64::from(code)).unwrap_or(f64::NAN);
        within(displacement_m, (-MAX_LENGTH_M, MAX_LENGTH_M), "the LVDT's curve")
    })
}
