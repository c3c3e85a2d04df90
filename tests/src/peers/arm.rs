//! The arm of an emulated controller: six joints that go straight, all together, at constant speed.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Joints of every arm here.
pub const JOINTS: usize = 6;

/// An arm on its way, or at its end.
#[derive(Clone, Copy, Debug)]
pub struct Arm {
    from_rad: [f64; JOINTS],
    to_rad: [f64; JOINTS],
    since: Instant,
    until: Instant,
}

impl Arm {
    /// Standing.
    pub fn at_rest(q_rad: [f64; JOINTS], now: Instant) -> Self {
        Self { from_rad: q_rad, to_rad: q_rad, since: now, until: now }
    }

    /// Joint angles at a time, radians.
    pub fn at(&self, now: Instant) -> [f64; JOINTS] {
        let way = self.way(now);
        std::array::from_fn(|i| self.from_rad[i] + way * (self.to_rad[i] - self.from_rad[i]))
    }

    /// Joint speeds at a time, radians per second.
    pub fn speed_at(&self, now: Instant) -> [f64; JOINTS] {
        if now >= self.until {
            return [0.0; JOINTS];
        }
        let duration_s = (self.until - self.since).as_secs_f64();
        std::array::from_fn(|i| (self.to_rad[i] - self.from_rad[i]) / duration_s)
    }

    /// Whether it is on its way.
    pub fn is_moving(&self, now: Instant) -> bool {
        now < self.until
    }

    /// When the move is half done, and when it ends.
    pub fn half_and_end(&self) -> (Instant, Instant) {
        (self.since + (self.until - self.since) / 2, self.until)
    }

    /// Sets out from where it is; all joints arrive after `duration`.
    pub fn go(&mut self, to_rad: [f64; JOINTS], duration: Duration, now: Instant) {
        *self = Self { from_rad: self.at(now), to_rad, since: now, until: now + duration };
    }

    /// Stops where it is.
    pub fn halt(&mut self, now: Instant) {
        *self = Self::at_rest(self.at(now), now);
    }

    fn way(&self, now: Instant) -> f64 {
        if now >= self.until {
            return 1.0;
        }
        now.saturating_duration_since(self.since).as_secs_f64() / (self.until - self.since).as_secs_f64()
    }
}

/// Where a controller's arm truly is, for a plant that follows it.
#[derive(Clone)]
pub struct JointsAt(pub(super) Arc<Mutex<Arm>>);

impl JointsAt {
    /// Joint angles at a time, radians.
    pub fn joints_at(&self, now: Instant) -> [f64; JOINTS] {
        self.0.lock().unwrap().at(now)
    }
}
