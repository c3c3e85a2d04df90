//! How a move of a Universal Robots controller stands, by its data packages.

use std::time::{Duration, Instant};

use super::rtde::{JOINTS, RobotState};
use super::{MoveState, Patience};

/// The robot is where it was sent when no joint is off by more: far more than a UR's servos leave, far less than any planned step.
const TOLERANCE_RAD: f64 = 0.05 * std::f64::consts::PI / 180.0;
/// A joint slower than this stands, radians per second.
const STANDING_RAD_S: f64 = 0.01;

/// The latest move.
pub(super) struct Course {
    goal_rad: [f64; JOINTS],
    sent: Instant,
    /// How long the move may take at the speed that it was sent with.
    allowed: Duration,
    /// How much of that has passed until `counted`: time while the robot is slowed down counts in proportion.
    spent: Duration,
    counted: Instant,
    /// Whether it was seen running.
    has_begun: bool,
    /// Since when the robot stands, without a program, elsewhere than at the goal.
    stands_since: Option<Instant>,
    /// Since when the robot stands because something holds the program, and what.
    held: Option<(Instant, &'static str)>,
    is_stopped_by_us: bool,
    /// The controller did not take the program.
    is_unheard: bool,
    state: MoveState,
}

impl Course {
    /// A move that is sent now, and may take so long at the speed that it is sent with.
    pub(super) fn new(goal_rad: [f64; JOINTS], allowed: Duration) -> Self {
        let now = Instant::now();
        Self {
            goal_rad,
            sent: now,
            allowed,
            spent: Duration::ZERO,
            counted: now,
            has_begun: false,
            stands_since: None,
            held: None,
            is_stopped_by_us: false,
            is_unheard: false,
            state: MoveState::Moving,
        }
    }

    /// It was sent only now.
    pub(super) fn restart(&mut self) {
        (self.sent, self.counted) = (Instant::now(), Instant::now());
    }

    /// It was not sent.
    pub(super) fn refuse(&mut self, why: String) {
        self.state = MoveState::Refused(why);
    }

    /// The robot was told to stop.
    pub(super) fn note_stop(&mut self) {
        self.is_stopped_by_us = true;
    }

    /// Whether the controller did not take the program.
    pub(super) fn is_unheard(&self) -> bool {
        self.is_unheard
    }

    /// Draws the conclusions of one data package.
    pub(super) fn follow(&mut self, robot: &RobotState, patience: &Patience, words: &[String]) {
        if self.state != MoveState::Moving {
            return;
        }
        self.count(robot.pace());
        let is_standing = robot.qd_rad_s.iter().all(|qd| qd.abs() < STANDING_RAD_S);
        self.held =
            robot.hold().filter(|_| is_standing).map(|what| (self.held.map_or_else(Instant::now, |(since, _)| since), what));
        self.has_begun |= robot.is_playing() || !is_standing;
        if let Some(obstacle) = robot.obstacle() {
            self.state = self.ended(with_words(obstacle, words));
            return;
        }
        let is_idle = is_standing && robot.is_stopped();
        let is_there = [&robot.q_rad, &robot.target_q_rad].iter().all(|q| largest(&self.goal_rad, q) < TOLERANCE_RAD);
        if is_idle && is_there {
            // A robot that was there already need not be seen moving.
            if self.has_begun || self.sent.elapsed() > patience.stand {
                self.state = MoveState::Reached;
            }
            return;
        }
        if !is_idle {
            self.stands_since = None;
            return;
        }
        let stands_for = self.stands_since.get_or_insert_with(Instant::now).elapsed();
        if self.has_begun && stands_for > patience.stand {
            let what = if self.is_stopped_by_us { "stopped as asked" } else { "the program ended before the robot was there" };
            self.state = self.ended(with_words(what.into(), words));
        } else if !self.has_begun && self.sent.elapsed() > patience.begin {
            let what = "the controller did not begin the move; is it in remote control?";
            self.state = self.ended(with_words(what.into(), words));
            self.is_unheard = true;
        }
    }

    /// Refused or Fault, as the move has begun or not.
    fn ended(&self, words: String) -> MoveState {
        if self.has_begun { MoveState::Fault(words) } else { MoveState::Refused(words) }
    }

    /// Counts the time since it was counted last, in which the robot went at this fraction of the speed asked for.
    fn count(&mut self, pace: f64) {
        let now = Instant::now();
        self.spent += now.saturating_duration_since(self.counted).mul_f64(pace);
        self.counted = now;
    }

    /// Ends a move that takes too long. Time in which nothing is heard counts in full.
    pub(super) fn lapse(&mut self) {
        if self.state == MoveState::Moving && self.spent + self.counted.elapsed() > self.allowed {
            self.state = MoveState::TimedOut(self.sent.elapsed());
        }
    }

    /// How the move stands, for others.
    pub(super) fn told(&self, patience: &Patience) -> MoveState {
        match self.held {
            Some((since, what)) if self.state == MoveState::Moving && since.elapsed() > patience.stand => {
                MoveState::Held(what.to_owned())
            }
            _ => self.state.clone(),
        }
    }
}

/// The largest difference of a joint, radians.
pub(super) fn largest(a: &[f64; JOINTS], b: &[f64; JOINTS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// With what the controller has told people.
pub(super) fn with_words(what: String, words: &[String]) -> String {
    if words.is_empty() { what } else { format!("{what} ({})", words.join("; ")) }
}
