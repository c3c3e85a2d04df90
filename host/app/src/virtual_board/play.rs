//! What stands between a robot that is what its encoders say and one of metal: play in the gears, and a signal that comes late.

use std::collections::VecDeque;

use ballbar::{JointVector, MAX_JOINTS, TermKind};
use ballbar_calib::model::Robot;

/// Play between an encoder, which sits at the motor, and its joint: the joint follows only where the play is used up.
#[derive(Clone, Debug)]
pub(super) struct Backlash {
    /// Half of each joint's play, radians or metres.
    pub(super) half: [f64; MAX_JOINTS],
    /// Where the joints are, as encoder outputs.
    joint_q: JointVector<f64>,
}

impl Backlash {
    /// The play of a robot's joints, which stand in the middle of it at these encoder outputs. A joint that its terms have run before
    /// its encoder has none.
    pub(super) fn new(robot: &Robot, q: &JointVector<f64>) -> Self {
        let half = |joint| {
            let scale = robot.chain.joint(joint).map_or(1.0, |joint| joint.scale);
            (robot.terms.coefficient(joint, TermKind::Backlash) / scale).max(0.0)
        };
        Self { half: std::array::from_fn(half), joint_q: *q }
    }

    /// Where the joints are when the encoders have come to `q`.
    pub(super) fn follow(&mut self, q: &JointVector<f64>) -> JointVector<f64> {
        for ((joint, q), half) in self.joint_q.as_array_mut().iter_mut().zip(q.as_array()).zip(self.half) {
            *joint = joint.clamp(q - half, q + half);
        }
        self.joint_q
    }
}

/// A signal shown late by a fixed time.
#[derive(Clone, Debug, Default)]
pub(super) struct Lag {
    pub(super) us: u64,
    /// Times and values, from the one that is shown to the latest.
    past: VecDeque<(u64, Option<f64>)>,
}

impl Lag {
    /// Takes the value of now, and gives the one to show: on the straight line between the two of around that time.
    pub(super) fn pass(&mut self, t_us: u64, now: Option<f64>) -> Option<f64> {
        if self.us == 0 {
            return now;
        }
        self.past.push_back((t_us, now));
        let shown_us = t_us.saturating_sub(self.us);
        while self.past.get(1).is_some_and(|&(next_us, _)| next_us <= shown_us) {
            self.past.pop_front();
        }
        let &(before_us, before) = self.past.front()?;
        let &(after_us, after) = self.past.get(1).filter(|_| before_us < shown_us).unwrap_or(&(before_us, before));
        let share = (shown_us - before_us.min(shown_us)) as f64 / (after_us - before_us).max(1) as f64;
        before.zip(after).map(|(before, after)| before + share * (after - before))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_follows_once_its_play_is_used_up() {
        let at = |value: f64| {
            let mut q = JointVector::zero();
            q.as_array_mut()[0] = value;
            q
        };
        let mut backlash = Backlash { half: [0.5; MAX_JOINTS], joint_q: at(0.0) };
        let joint = |backlash: &mut Backlash, q: f64| backlash.follow(&at(q)).as_array()[0];
        assert_eq!(joint(&mut backlash, 0.4), 0.0);
        assert_eq!(joint(&mut backlash, 2.0), 1.5);
        assert_eq!(joint(&mut backlash, 1.2), 1.5);
        assert_eq!(joint(&mut backlash, 0.5), 1.0);
    }

    #[test]
    fn a_late_signal_is_the_one_of_before() {
        let mut lag = Lag { us: 3_000, ..Lag::default() };
        let shown: Vec<Option<f64>> = (0..8).map(|ms| lag.pass(ms * 1_000, Some(ms as f64))).collect();
        assert_eq!(shown[4..], [Some(1.0), Some(2.0), Some(3.0), Some(4.0)]);
        assert_eq!(lag.past.len(), 4);
        lag.us = 2_500;
        assert_eq!(lag.pass(8_000, Some(8.0)), Some(5.5));
        assert_eq!(lag.pass(9_000, None), Some(6.5));
        assert_eq!(lag.pass(11_000, None), None);
    }
}
