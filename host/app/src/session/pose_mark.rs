//! What the host notes of poses between the frames of a session's log.
//!
//! These marks share the frames of the wire, but are no messages of it: what a host notes for itself is no reason for boards to need
//! another firmware, or for older logs to be of another version.

use ballbar::wire::{MAX_FRAME, decode, encode};
use ballbar::{Approach, JointVector, StillnessCriteria};
use serde::{Deserialize, Serialize};

use super::measured_pose::{Connection, MeasuredPose};

/// A mark of the host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum PoseMark {
    /// What the bar joins from here on, at most until the run ends.
    Connected {
        /// What it joins.
        connection: Connection,
        /// Every settled pose is measured, by [`super::SettledRule`] with these criteria.
        every_settled: Option<StillnessCriteria>,
    },
    /// From here on the bar is off, or nobody knows what it joins.
    Disconnected,
    /// A pose was measured with the bar as it is connected, by a program that kept no directions. It goes to poses.csv next.
    Measured(MarkedPose),
    /// The latest poses of these times were taken out of poses.csv again.
    Erased {
        /// Times of the poses by the board's clock, microseconds.
        times_us: Vec<u64>,
        /// The next mark has more of them. Poses are erased by the last of a row of marks, or not at all.
        goes_on: bool,
    },
    /// A pose was measured with the bar as it is connected. It goes to poses.csv next.
    Approached {
        /// The pose.
        pose: MarkedPose,
        /// From which sides the joints came there, where it is known.
        approach: Approach,
    },
}

/// A measured pose, in SI units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MarkedPose {
    /// Encoder outputs, radians or metres.
    pub q: Vec<f64>,
    /// Displacement of the bar from mid travel, metres.
    pub displacement_m: f64,
    /// Time of its middle by the board's clock, seconds.
    pub t_s: f64,
    /// How fast the length grew, metres per second, where the arm moved.
    pub rate_m_s: Option<f64>,
    /// Line of plan.csv that it was measured for.
    pub plan_row: Option<usize>,
}

/// Times in one mark at most: a time takes ten bytes at most, and a payload holds 1,024.
const MOST_TIMES: usize = 90;

/// The first byte of a mark: no message of a board begins so, since they are numbered from zero.
const TAG: u8 = b'P';

impl PoseMark {
    /// The mark as a frame; `None` when it is too long for one, as only names can make it.
    pub(super) fn frame(&self) -> Option<Vec<u8>> {
        encode(&(TAG, self), &mut [0; MAX_FRAME]).ok().map(<[u8]>::to_vec)
    }

    /// The mark of a frame's payload, if it is one.
    pub(super) fn of_payload(payload: &[u8]) -> Option<Self> {
        let (tag, mark): (u8, Self) = decode(payload)?;
        (tag == TAG).then_some(mark)
    }

    /// The marks of poses that were taken out together.
    pub(super) fn erased(times_us: &[u64]) -> impl Iterator<Item = Self> {
        let marks = times_us.len().div_ceil(MOST_TIMES);
        let mark = move |(number, times): (usize, &[u64])| Self::Erased { times_us: times.to_vec(), goes_on: number < marks };
        (1..).zip(times_us.chunks(MOST_TIMES)).map(mark)
    }

    /// A pose of a robot with so many joints.
    pub(super) fn measured(pose: &MeasuredPose, joints: usize) -> Self {
        let MeasuredPose { q, approach, displacement_m, t_s, rate_m_s, plan_row } = *pose;
        let q = q.as_array().iter().copied().take(joints).collect();
        Self::Approached { pose: MarkedPose { q, displacement_m, t_s, rate_m_s, plan_row }, approach }
    }
}

impl MarkedPose {
    /// The pose, approached so.
    pub(super) fn measured(&self, approach: Approach) -> MeasuredPose {
        let mut q = JointVector::zero();
        for (value, marked) in q.as_array_mut().iter_mut().zip(&self.q) {
            *value = *marked;
        }
        let Self { displacement_m, t_s, rate_m_s, plan_row, .. } = *self;
        MeasuredPose { q, approach, displacement_m, t_s, rate_m_s, plan_row }
    }
}
