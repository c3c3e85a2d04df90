//! The two things that a robot does: standing at a station, and moving to the next.

use std::f64::consts::TAU;

use ballbar::{JointEncoders, JointVector, Kinematics, MAX_JOINTS};
use ballbar_firmware::ENCODERS;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::script::{Station, progress};

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
    /// Where the robot measures; none before the first station.
    station: Option<Station>,
    /// Displacement of the bar from mid travel, metres.
    displacement_m: f64,
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
        Self {
            held,
            station: None,
            displacement_m: 0.0,
            ring_counts: [0.0; ENCODERS],
            ring_length_m: 0.0,
            since_us: 0,
            until_us: 0,
        }
    }

    /// Counts, and displacement of the bar from mid travel in metres where it is attached.
    pub(super) fn at(&self, t_us: u64) -> ([i32; ENCODERS], Option<f64>) {
        let since_s = t_us.saturating_sub(self.since_us) as f64 * 1e-6;
        let decay = since_s / RING_TIME_CONSTANT_S;
        let ring = if decay < RING_TIME_CONSTANTS { (-decay).exp() * (TAU * RING_HZ * since_s).sin() } else { 0.0 };
        let displacement_m = self.station.map(|_| self.displacement_m + ring * self.ring_length_m);
        (whole(&self.held.counts, &self.ring_counts.map(|counts| counts * ring)), displacement_m)
    }
}

impl Move {
    /// From where the robot stands, when its time there is over, to a station.
    pub(super) fn new(from: Rest, to: Station, encoders: &JointEncoders<f64>, duration_us: u64) -> Self {
        let held = Held::new(encoders, &to.q);
        Self { from, to, held, since_us: from.until_us, until_us: from.until_us + duration_us }
    }

    /// Counts, and displacement of the bar from mid travel in metres where it is attached.
    pub(super) fn at(&self, t_us: u64, truth: &Kinematics<f64>) -> ([i32; ENCODERS], Option<f64>) {
        let way = progress((t_us - self.since_us) as f64 / (self.until_us - self.since_us) as f64);
        // Counts are linear in q, couplings included.
        let counts = std::array::from_fn(|i| between(self.from.held.counts[i], self.held.counts[i], way));
        let displacement_m = self.attached_from().map(|from| {
            let mut q = self.held.q;
            for (q, from) in q.as_array_mut().iter_mut().zip(self.from.held.q.as_array()) {
                *q = between(*from, *q, way);
            }
            let error_m = between(from.length_error_m, self.to.length_error_m, way);
            truth.length(&q, &self.to.pairing) + error_m - self.to.bar_m
        });
        (whole(&counts, &[0.0; ENCODERS]), displacement_m)
    }

    /// The station before, when the bar stays where it is on the way.
    fn attached_from(&self) -> Option<Station> {
        self.from.station.filter(|from| from.pairing == self.to.pairing && from.bar_m == self.to.bar_m)
    }

    /// Standing at the station, after a move that is over.
    pub(super) fn arrive(&self, truth: &Kinematics<f64>, rng: &mut ChaCha8Rng) -> Rest {
        let station = self.to;
        // Joints that did not move are not shaken either; that holds for the encoders beyond the robot's joints as well.
        let ring_counts = std::array::from_fn(|i| {
            let amplitude = rng.random_range(-RING_COUNTS..RING_COUNTS);
            if self.held.counts[i] == self.from.held.counts[i] { 0.0 } else { amplitude }
        });
        Rest {
            held: self.held,
            station: Some(station),
            displacement_m: truth.length(&self.held.q, &station.pairing) + station.length_error_m - station.bar_m,
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
