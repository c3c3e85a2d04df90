//! A simulated robot with the ball-bar at its tool, as a function of time: what a board's inputs see.
//!
//! The robot goes from station to station of a [`Script`]. At a station its servos hold whole counts, after a short ringing; the
//! length is that of the true chain at these encoder outputs plus the station's error, and the LVDT shows it with a little noise.
//! Nothing here knows of a board, so that boards of any kind can be fed with it.

use std::collections::VecDeque;
use std::time::Duration;

use ballbar::{JointEncoders, JointKind, JointVector, Kinematics, LvdtCurve};
use ballbar_calib::model::Robot;
use ballbar_firmware::{ENCODERS, EncoderLatch, LvdtScan};
use miette::Diagnostic;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use thiserror::Error;

use super::counters::{counter, last_index};
use super::lvdt::{code_at, lvdt_curve};
use super::motion::{Held, Moment, Move, Rest, us_from_s};
use super::play::{Backlash, Lag};
use super::script::{AttachedBar, Script, Station, move_duration_s};
use crate::board::{NoEncoders, joint_encoders};
use crate::robot_link::JointSpeed;

/// Noise of the LVDT's oversampled code, standard deviation, codes.
const CODE_NOISE: f64 = 1.5;

/// A simulated robot and ball-bar. The same seed and the same calls give the same states.
#[derive(Clone, Debug)]
pub struct Plant {
    truth: Kinematics<f64>,
    kinds: Vec<JointKind>,
    encoders: JointEncoders<f64>,
    lvdt: LvdtCurve,
    /// Counts at power-up, where the counters stand at zero.
    start_counts: [i32; ENCODERS],
    /// Counts at the call before.
    last_counts: [i32; ENCODERS],
    phase: Phase,
    waiting: VecDeque<Station>,
    speed: JointSpeed,
    backlash: Backlash,
    lvdt_lag: Lag,
    now_us: u64,
    scripts: u64,
    rng: ChaCha8Rng,
}

/// What the board's inputs see at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlantState {
    /// The counters and the index pulses since the call before.
    pub latch: EncoderLatch,
    /// The LVDT.
    pub scan: LvdtScan,
}

/// Why a robot cannot be simulated.
#[derive(Debug, Error, Diagnostic)]
pub enum PlantError {
    /// Its file does not say how its encoders count.
    #[error(transparent)]
    #[diagnostic(transparent)]
    NoEncoders(#[from] NoEncoders),
    /// More joints than the board has encoders.
    #[error("the robot has {joints} joints, but the board counts {ENCODERS} encoders")]
    #[diagnostic(help("Take a robot of at most {ENCODERS} joints."))]
    TooManyJoints {
        /// Joints of the robot.
        joints: usize,
    },
}

#[derive(Clone, Debug)]
enum Phase {
    Rest(Box<Rest>),
    Move(Box<Move>),
}

impl Plant {
    /// The robot at rest at encoder outputs of zero, or as near to them as its limits allow, with the bar not attached.
    /// `travel_m` is the LVDT's from end to end.
    ///
    /// # Errors
    /// [`PlantError`] for a robot whose encoders are not known or are more than a board's.
    pub fn new(truth: &Robot, travel_m: f64, seed: u64) -> Result<Self, PlantError> {
        let joints = truth.chain.joints();
        if joints > ENCODERS {
            return Err(PlantError::TooManyJoints { joints });
        }
        let encoders = joint_encoders(truth)?;
        let mut q = JointVector::zero();
        for (q, limits) in q.as_array_mut().iter_mut().zip(&truth.limits) {
            *q = 0_f64.clamp(limits.min, limits.max);
        }
        let rest = Rest::at_start(Held::new(&encoders, &q));
        let start_counts = rest.at(0).counts;
        Ok(Self {
            truth: truth.kinematics(),
            kinds: truth.chain.joint_kinds().to_vec(),
            encoders,
            lvdt: lvdt_curve(travel_m),
            start_counts,
            last_counts: start_counts,
            phase: Phase::Rest(Box::new(rest)),
            waiting: VecDeque::new(),
            speed: JointSpeed::default(),
            backlash: Backlash::new(truth, &q),
            lvdt_lag: Lag::default(),
            now_us: 0,
            scripts: 0,
            rng: ChaCha8Rng::seed_from_u64(seed),
        })
    }

    /// The same robot with play in its revolute joints: from one end of it to the other, radians of the joint.
    #[must_use]
    pub fn with_backlash(mut self, play_rad: f64) -> Self {
        for (half, kind) in self.backlash.half.iter_mut().zip(&self.kinds) {
            *half = if *kind == JointKind::Revolute { play_rad / 2.0 } else { 0.0 };
        }
        self
    }

    /// The same bar with an LVDT that shows every length so much later.
    #[must_use]
    pub fn with_lvdt_lag(mut self, lag: Duration) -> Self {
        self.lvdt_lag.us = lag.as_micros() as u64;
        self
    }

    /// The true curve of the LVDT.
    pub fn lvdt(&self) -> LvdtCurve {
        self.lvdt
    }

    /// Joints of the robot; the encoders beyond them stand at zero.
    pub fn joints(&self) -> usize {
        self.kinds.len()
    }

    /// True positions of the encoders at the latest call of [`Plant::at`], counts from encoder output zero: what a homed board
    /// shows.
    pub fn counts(&self) -> [i32; ENCODERS] {
        self.last_counts
    }

    /// Stations begin at the next call of [`Plant::at`], instead of what is left of an earlier script. A move under way is
    /// finished first, a stay at a station is not.
    pub fn play(&mut self, script: Script) {
        // Noise of its own for every script: that of one does not depend on how long the robot stood before it.
        self.scripts += 1;
        self.rng.set_stream(self.scripts);
        self.rng.set_word_pos(0);
        self.waiting = script.stations.into();
        self.speed = script.speed;
        match &mut self.phase {
            Phase::Rest(rest) => rest.until_us = self.now_us,
            Phase::Move(movement) => movement.to.dwell_s = 0.0,
        }
    }

    /// Stops where the robot is, and forgets what is left of a script.
    pub fn halt(&mut self) {
        self.waiting.clear();
        match &mut self.phase {
            Phase::Rest(rest) => rest.until_us = rest.until_us.min(self.now_us),
            Phase::Move(movement) if movement.until_us > self.now_us => {
                **movement = movement.halted(self.now_us, &self.encoders);
            }
            Phase::Move(_) => {}
        }
    }

    /// The bar comes off, wherever the robot is.
    pub fn drop_bar(&mut self) {
        self.waiting.iter_mut().for_each(|station| station.bar = None);
        match &mut self.phase {
            Phase::Rest(rest) => rest.bar = None,
            Phase::Move(movement) => movement.drop_bar(),
        }
    }

    /// Whether the last station's time was over at the latest call of [`Plant::at`]. The robot then stays there.
    pub fn is_done(&self) -> bool {
        self.waiting.is_empty() && matches!(&self.phase, Phase::Rest(rest) if rest.until_us <= self.now_us)
    }

    /// Whether the robot moved, or had a station before it, at the latest call of [`Plant::at`].
    pub fn is_moving(&self) -> bool {
        !self.waiting.is_empty() || matches!(self.phase, Phase::Move(_))
    }

    /// Encoder outputs at the latest call of [`Plant::at`], as the servos hold them, and the bar that was attached.
    pub fn stance(&self) -> (JointVector<f64>, Option<AttachedBar>) {
        let now = self.moment();
        (now.q, now.bar)
    }

    /// The inputs at a time in microseconds, which must not fall from call to call.
    pub fn at(&mut self, t_us: u64) -> PlantState {
        self.now_us = t_us;
        self.go_on();
        let now = self.moment();
        let joint_q = self.backlash.follow(&now.q);
        let displacement_m = now.bar.map(|bar| self.truth.length(&joint_q, &bar.pairing) + now.length_error_m - bar.mid_m);
        let shown_m = self.lvdt_lag.pass(t_us, displacement_m);
        PlantState { latch: self.latch(now.counts), scan: self.scan(shown_m) }
    }

    fn moment(&self) -> Moment {
        match &self.phase {
            Phase::Rest(rest) => rest.at(self.now_us),
            Phase::Move(movement) => movement.at(self.now_us),
        }
    }

    /// Ends the phases that are over.
    fn go_on(&mut self) {
        loop {
            self.phase = match &self.phase {
                Phase::Rest(rest) if rest.until_us <= self.now_us => {
                    let Some(station) = self.waiting.pop_front() else { return };
                    let duration_us = us_from_s(move_duration_s(&self.kinds, &self.speed, &rest.held.q, &station.q));
                    Phase::Move(Box::new(Move::new(**rest, station, &self.encoders, duration_us)))
                }
                Phase::Move(movement) if movement.until_us <= self.now_us => {
                    Phase::Rest(Box::new(movement.arrive(&mut self.rng)))
                }
                _ => return,
            };
        }
    }

    fn latch(&mut self, counts: [i32; ENCODERS]) -> EncoderLatch {
        let mut latch = EncoderLatch::default();
        for (i, &now) in counts.iter().enumerate() {
            latch.counters[i] = counter(i, now, self.start_counts[i]);
            let per_index = self.encoders.encoders().get(i).map_or(0, |encoder| encoder.counts_per_index);
            latch.at_index[i] =
                last_index(self.last_counts[i], now, per_index).map(|index| counter(i, index, self.start_counts[i]));
        }
        self.last_counts = counts;
        latch
    }

    /// Without a bar, or beyond its travel, the signal stands at an end of the converter's range.
    fn scan(&mut self, displacement_m: Option<f64>) -> LvdtScan {
        let Some(displacement_m) = displacement_m else { return LvdtScan { code: 0, saturated: true } };
        let Some(code) = code_at(&self.lvdt, displacement_m) else {
            return LvdtScan { code: if displacement_m < 0.0 { 0 } else { u16::MAX }, saturated: true };
        };
        let noise: f64 = StandardNormal.sample(&mut self.rng);
        LvdtScan { code: (code + CODE_NOISE * noise).round() as u16, saturated: false }
    }
}

#[cfg(test)]
mod tests;
