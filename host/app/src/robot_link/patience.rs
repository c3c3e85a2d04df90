//! How long a link waits for a controller.

use std::time::Duration;

/// How long the answer to a stop is waited for: the robot stops whether or not somebody hears of it.
pub(super) const STOP_WAIT: Duration = Duration::from_millis(500);

/// How long a link waits before it draws its conclusions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// Until a connection stands, or a request is answered.
    pub answer: Duration,
    /// Until a move that was asked for is seen to begin.
    pub begin: Duration,
    /// A robot that has stood still elsewhere for so long is not on its way any more.
    pub stand: Duration,
    /// Added to the time that a move takes by its speed.
    pub margin: Duration,
    /// Until a controller has recovered, or released a stop after a person has confirmed it.
    pub recover: Duration,
}

impl Default for Patience {
    /// For controllers on the same network or line. A UR releases a protective stop five seconds after it, not earlier.
    fn default() -> Self {
        Self {
            answer: Duration::from_secs(3),
            begin: Duration::from_secs(3),
            stand: Duration::from_millis(500),
            margin: Duration::from_secs(5),
            recover: Duration::from_secs(8),
        }
    }
}

impl Patience {
    /// The longest that a move may take which takes `duration_s` seconds by its speed: half as much again, and the margin.
    pub(super) fn allowed(&self, duration_s: f64) -> Duration {
        // A day is longer than any move; what is not a number is none either.
        let duration_s = if duration_s.is_finite() { duration_s.clamp(0.0, 86_400.0) } else { 86_400.0 };
        self.margin + Duration::from_secs_f64(1.5 * duration_s)
    }
}
