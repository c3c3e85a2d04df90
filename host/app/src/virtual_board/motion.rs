//! The two things that a robot does: standing at a station, and moving to the next.

use std::f64::consts::TAU;

use ballbar::{JointEncoders, JointVector, MAX_JOINTS};
use ballbar_firmware::ENCODERS;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::script::{AttachedBar, Station, progress};

/// Ringing of the arm when it has arrived.
const RING_HZ: f64 = 12.0;
const RING_TIME_CONSTANT_S: f64 = 0.08;
/// It begins with this, at most on the joints and exactly on the bar: within a tenth of a second it is inside the band that counts
/// as standing still by default, and outside it before.
const RING_COUNTS: f64 = 3.0;
const RING_LENGTH_M: f64 = 8e-5;
/// After so many time constants nothing of it is left.
const RING_TIME_CONSTANTS: f64 = 12.0;

/// Where servos hold a robot: at whole counts, since they know nothing between.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    /// Encoder outputs, radians or metres.
    pub(super) q: JointVector<f64>,
    counts: [f64; MAX_JOINTS],
}

/// Standing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    pub(super) held: Held,
    pub(super) bar: Option<AttachedBar>,
    /// What the bar measures too much here, metres.
    length_error_m: f64,
    ring_counts: [f64; ENCODERS],
    ring_length_m: f64,
    since_us: u64,
    pub(super) until_us: u64,
}

/// On the way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Move {
    from: Rest,
    pub(super) to: Station,
    held: Held,
    since_us: u64,
    pub(super) until_us: u64,
}

/// Where the robot is at one moment.
pub(super) struct Moment {
    /// Positions of the encoders.
    pub(super) counts: [i32; ENCODERS],
    /// Encoder outputs that the servos hold, radians or metres, not rounded to counts while the robot moves.
    pub(super) q: JointVector<f64>,
    /// The bar, where it is attached.
    pub(super) bar: Option<AttachedBar>,
    /// What the bar measures too much, metres.
    pub(super) length_error_m: f64,
}

impl Held {
    /// At the whole counts nearest to these encoder outputs.
    pub(super) fn new(encoders: &JointEncoders<f64>, q: &JointVector<f64>) -> Self {
        let counts = encoders.counts(q).map(f64::round);
        Self { q: encoders.q(counts), counts }
    }
}

impl Rest {
    /// At power-up, with the bar not attached, until the first station.
    pub(super) fn at_start(held: Held) -> Self {
        Self { held, bar: None, length_error_m: 0.0, ring_counts: [0.0; ENCODERS], ring_length_m: 0.0, since_us: 0, until_us: 0 }
    }

    pub(super) fn at(&self, t_us: u64) -> Moment {
        let since_s = t_us.saturating_sub(self.since_us) as f64 * 1e-6;
        let decay = since_s / RING_TIME_CONSTANT_S;
        let ring = if decay < RING_TIME_CONSTANTS { (-decay).exp() * (TAU * RING_HZ * since_s).sin() } else { 0.0 };
        Moment {
            counts: whole(&self.held.counts, &self.ring_counts.map(|counts| counts * ring)),
            q: self.held.q,
            bar: self.bar,
            length_error_m: self.length_error_m + ring * self.ring_length_m,
        }
    }
}

impl Move {
    /// From where the robot stands, when its time there is over, to a station.
    pub(super) fn new(from: Rest, to: Station, encoders: &JointEncoders<f64>, duration_us: u64) -> Self {
        let held = Held::new(encoders, &to.q);
        Self { from, to, held, since_us: from.until_us, until_us: from.until_us + duration_us }
    }

    pub(super) fn at(&self, t_us: u64) -> Moment {
        let way = progress((t_us - self.since_us) as f64 / (self.until_us - self.since_us) as f64);
        let mut q = self.held.q;
        for (q, from) in q.as_array_mut().iter_mut().zip(self.from.held.q.as_array()) {
            *q = between(*from, *q, way);
        }
        // Counts are linear in q, couplings included.
        let counts = std::array::from_fn(|i| between(self.from.held.counts[i], self.held.counts[i], way));
        Moment {
            counts: whole(&counts, &[0.0; ENCODERS]),
            q,
            bar: self.to.bar.filter(|bar| self.from.bar.as_ref() == Some(bar)),
            length_error_m: between(self.from.length_error_m, self.to.length_error_m, way),
        }
    }

    /// The same move, ending where the robot is at a time on the way.
    pub(super) fn halted(&self, t_us: u64, encoders: &JointEncoders<f64>) -> Self {
        let now = self.at(t_us);
        let to = Station { q: now.q, bar: now.bar, dwell_s: 0.0, length_error_m: now.length_error_m };
        Self { to, held: Held::new(encoders, &now.q), until_us: t_us, ..*self }
    }

    /// The bar comes off on the way.
    pub(super) fn drop_bar(&mut self) {
        (self.from.bar, self.to.bar) = (None, None);
    }

    /// Standing at the station, after a move that is over.
    pub(super) fn arrive(&self, rng: &mut ChaCha8Rng) -> Rest {
        let station = self.to;
        // Joints that did not move are not shaken either; that holds for the encoders beyond the robot's joints as well.
        let ring_counts = std::array::from_fn(|i| {
            let amplitude = rng.random_range(-RING_COUNTS..RING_COUNTS);
            if self.held.counts[i] == self.from.held.counts[i] { 0.0 } else { amplitude }
        });
        Rest {
            held: self.held,
            bar: station.bar,
            length_error_m: station.length_error_m,
            ring_counts,
            ring_length_m: if rng.random() { RING_LENGTH_M } else { -RING_LENGTH_M },
            since_us: self.until_us,
            until_us: self.until_us + us_from_s(station.dwell_s),
        }
    }
}

fn between(from: f64, to: f64, way: f64) -> f64 {
    from + (to - from) * way
}

fn whole(counts: &[f64; MAX_JOINTS], ring: &[f64; ENCODERS]) -> [i32; ENCODERS] {
    std::array::from_fn(|i| (counts[i] + ring[i]).round() as i32)
}

/// Microseconds of a time in seconds.
pub(super) fn us_from_s(s: f64) -> u64 {
    (s * 1e6) as u64
}
