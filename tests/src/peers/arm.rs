//! The arm of an emulated controller: six joints that go straight, all together, at constant speed, or slower while something holds
//! them back.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Joints of every arm here.
pub const JOINTS: usize = 6;

/// An arm on its way, or at its end.
#[derive(Clone, Copy, Debug)]
pub struct Arm {
    from_rad: [f64; JOINTS],
    to_rad: [f64; JOINTS],
    /// What the whole way takes at full speed, seconds.
    way_s: f64,
    /// How much of it was done at `since`.
    done_s: f64,
    since: Instant,
    /// The fraction of its full speed that it goes at.
    fraction: f64,
}

impl Arm {
    /// Standing.
    pub fn at_rest(q_rad: [f64; JOINTS], now: Instant) -> Self {
        Self { from_rad: q_rad, to_rad: q_rad, way_s: 0.0, done_s: 0.0, since: now, fraction: 1.0 }
    }

    /// Joint angles at a time, radians.
    pub fn at(&self, now: Instant) -> [f64; JOINTS] {
        let share = self.share(now);
        std::array::from_fn(|i| self.from_rad[i] + share * (self.to_rad[i] - self.from_rad[i]))
    }

    /// Joint speeds at a time, radians per second.
    pub fn speed_at(&self, now: Instant) -> [f64; JOINTS] {
        if self.share(now) >= 1.0 {
            return [0.0; JOINTS];
        }
        std::array::from_fn(|i| self.fraction * (self.to_rad[i] - self.from_rad[i]) / self.way_s)
    }

    /// When the move is half done, and when it ends, if it goes on as it does.
    pub fn half_and_end(&self) -> (Instant, Instant) {
        let at = |share: f64| self.since + self.time_until(share);
        (at(0.5), at(1.0))
    }

    /// The share of the way that is done.
    pub fn share(&self, now: Instant) -> f64 {
        let done_s = self.done_s + self.fraction * now.saturating_duration_since(self.since).as_secs_f64();
        if done_s < self.way_s { done_s / self.way_s } else { 1.0 }
    }

    /// Sets out from where it is; at full speed all joints arrive after `duration`.
    pub fn go(&mut self, to_rad: [f64; JOINTS], duration: Duration, now: Instant) {
        let from_rad = self.at(now);
        *self = Self { from_rad, to_rad, way_s: duration.as_secs_f64(), done_s: 0.0, since: now, ..*self };
    }

    /// Ends elsewhere than where it was to go.
    pub fn divert(&mut self, to_rad: [f64; JOINTS], now: Instant) {
        let left_s = (1.0 - self.share(now)) * self.way_s;
        self.go(to_rad, Duration::from_secs_f64(left_s), now);
    }

    /// Where it ends.
    pub fn goal_rad(&self) -> [f64; JOINTS] {
        self.to_rad
    }

    /// Goes on at this fraction of its full speed; zero holds it where it is.
    pub fn slow_to(&mut self, fraction: f64, now: Instant) {
        (self.done_s, self.since) = (self.share(now) * self.way_s, now);
        self.fraction = fraction;
    }

    /// Stops where it is.
    pub fn halt(&mut self, now: Instant) {
        *self = Self { fraction: self.fraction, ..Self::at_rest(self.at(now), now) };
    }

    /// From `since` until a share is done; a day, for what is never.
    fn time_until(&self, share: f64) -> Duration {
        let left_s = (share * self.way_s - self.done_s).max(0.0);
        Duration::from_secs_f64((left_s / self.fraction.max(1e-9)).min(86_400.0))
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
