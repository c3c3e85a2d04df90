//! One move, watched: what the controller says, what the encoders say, and whether the bar is where it should be.

use std::time::{Duration, Instant};

use ballbar::{JointKind, JointVector};

use super::board_watch::View;
use super::collector::Bar;
use super::drive::{Drive, nearest_on_way};
use super::errors::CollectError;
use super::operator::Event;
use super::track;
use crate::robot_link::MoveState;
use crate::units::ScreenUnit;

/// How a single move ended. But for the first two, the robot was stopped and stands.
pub(super) enum Go {
    /// Controller and encoders agree.
    Arrived,
    /// The controller did not begin it; its words.
    Refused(String),
    /// It ended on the way; why.
    Failed(String),
    /// The bar came off, or beyond its travel.
    BarOff,
    /// The operator wants to end.
    Quit,
}

/// How long the encoders may take to agree that the robot has arrived.
const AGREEMENT: Duration = Duration::from_secs(2);
/// The controller is asked no more often than this.
const POLL: Duration = Duration::from_millis(1);
/// A bar that hangs free does not change its length so far while the robot moves, metres.
const FREE_BAR_M: f64 = 2e-3;
/// An arm whose joints have not left this for so long, by the board's clock, stands (radians or metres).
const STANDS_WITHIN: f64 = 2e-4;
const STANDS_FOR_US: u64 = 200_000;
/// How long a robot may take to stop.
const STOPPING: Duration = Duration::from_secs(5);

impl Drive<'_, '_, '_, '_> {
    /// Before anything moves: the controller and the board have the robot at the same place.
    pub(super) fn compare_controller(&mut self) -> Result<(), CollectError> {
        let Some(said) = self.robot.joints()? else { return Ok(()) };
        let kinds = self.collector.cell.robot.chain.joint_kinds();
        let found = self.collector.board.ask()?.q;
        let (share, joint) = self.collector.options.near.worst(kinds, &said, &found);
        if share <= 1.0 {
            return Ok(());
        }
        let at = |q: &JointVector<f64>| in_unit(kinds[joint], q.as_array()[joint]);
        Err(CollectError::Disagree { joint: joint + 1, controller: at(&said), encoders: at(&found) })
    }

    /// Whether the arm is on the straight way in joint space between two joint vectors.
    pub(super) fn is_on_way(&mut self, from: &JointVector<f64>, to: &JointVector<f64>) -> Result<bool, CollectError> {
        let kinds = self.collector.cell.robot.chain.joint_kinds();
        let q = self.collector.board.ask()?.q;
        Ok(self.collector.options.near.holds(kinds, &nearest_on_way(from, to, &q), &q))
    }

    /// A move during which poses are taken, where that is wanted.
    pub(super) fn go_measuring(&mut self, q: &JointVector<f64>, row: usize) -> Result<Go, CollectError> {
        let options = self.collector.options.track.clone().filter(|_| matches!(self.collector.bar, Bar::On(_)));
        self.collector.board.track(options.is_some());
        let ended = self.go(q, row)?;
        let points = self.collector.board.track(false);
        if let (Some(options), Go::Arrived) = (options, &ended) {
            let poses = track::poses(&points, self.collector.cell.robot.chain.joint_kinds(), &options);
            self.collector.keep_moving(row, &poses)?;
        }
        Ok(ended)
    }

    /// One joint-interpolated move.
    pub(super) fn go(&mut self, q: &JointVector<f64>, row: usize) -> Result<Go, CollectError> {
        let from = self.collector.board.ask()?;
        self.collector.since_us = from.t_us;
        self.collector.goal = Some(row);
        let options = &self.collector.options;
        let speed = if matches!(self.collector.bar, Bar::On(_)) { options.speed } else { options.free_speed };
        self.robot.start_move(q, &speed)?;
        self.collector.board.be_watchful(true);
        let ended = self.watch(&from, q, row);
        self.collector.board.be_watchful(false);
        if let Ok(Go::Failed(_) | Go::BarOff | Go::Quit) = &ended {
            self.halt()?;
        }
        if let Ok(Go::BarOff) = &ended {
            self.collector.lose_bar()?;
        }
        ended
    }

    /// Until the move is over.
    fn watch(&mut self, from: &View, q: &JointVector<f64>, row: usize) -> Result<Go, CollectError> {
        let mut polled = Instant::now();
        let mut held = None;
        loop {
            self.collector.listen(&mut self.robot)?;
            if self.collector.wants_to_end() {
                return Ok(Go::Quit);
            }
            if self.collector.is_bar_gone()? {
                return Ok(Go::BarOff);
            }
            self.check_free_bar(from)?;
            self.check_way(&from.q, q, row)?;
            if polled.elapsed() < POLL {
                continue;
            }
            polled = Instant::now();
            match self.robot.poll()? {
                MoveState::Moving => {
                    if held.take().is_some() {
                        self.collector.operator.tell(&Event::Trouble("the robot goes on"))?;
                    }
                }
                // However long it takes: it is in somebody's hand.
                MoveState::Held(what) => {
                    if held.as_ref() != Some(&what) {
                        self.collector.trouble(format!("the robot waits: {what}"))?;
                        held = Some(what);
                    }
                }
                MoveState::Reached => {
                    self.confirm_arrival(q, row)?;
                    return self.check_free_bar(from).map(|()| Go::Arrived);
                }
                // The row is not to blame for what only a person may see to.
                MoveState::Refused(why) if self.robot.intervention()?.is_some() => return Ok(Go::Failed(why)),
                MoveState::Refused(why) => return Ok(Go::Refused(why)),
                MoveState::Fault(why) => return Ok(Go::Failed(why)),
                MoveState::TimedOut(time) => {
                    return Ok(Go::Failed(format!("the controller said nothing for {:.0} s", time.as_secs_f64())));
                }
            }
        }
    }

    /// Stops the robot, and waits until it stands: hands may be needed at the bar.
    fn halt(&mut self) -> Result<(), CollectError> {
        self.robot.stop()?;
        let began = Instant::now();
        let mut stood = self.collector.board.ask()?;
        while began.elapsed() < STOPPING {
            self.collector.listen(&mut self.robot)?;
            let view = self.collector.board.view()?;
            let moved = stood.q.as_array().iter().zip(view.q.as_array()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if moved > STANDS_WITHIN {
                stood = view;
            } else if view.t_us.saturating_sub(stood.t_us) >= STANDS_FOR_US {
                break;
            }
        }
        Ok(())
    }

    /// A bar that should be off does not follow the robot.
    fn check_free_bar(&mut self, from: &View) -> Result<(), CollectError> {
        let view = self.collector.board.view()?;
        let now_m = view.displacement_m.filter(|_| view.t_us > from.t_us);
        let is_followed = from.displacement_m.zip(now_m).is_some_and(|(from_m, now_m)| (now_m - from_m).abs() > FREE_BAR_M);
        if is_followed && self.collector.bar == Bar::Off {
            return Err(CollectError::StillOn { why: "its length changes as the robot moves".into() });
        }
        Ok(())
    }

    /// The encoders are on the straight way in joint space.
    fn check_way(&mut self, from: &JointVector<f64>, to: &JointVector<f64>, row: usize) -> Result<(), CollectError> {
        let view = self.collector.board.view()?;
        let nearest = nearest_on_way(from, to, &view.q);
        let kinds = self.collector.cell.robot.chain.joint_kinds();
        let (share, joint) = self.collector.options.way.worst(kinds, &nearest, &view.q);
        if share <= 1.0 || view.t_us < self.collector.since_us {
            return Ok(());
        }
        let off = (nearest.as_array()[joint] - view.q.as_array()[joint]).abs();
        let line = self.collector.ledger.rows()[row].line;
        Err(CollectError::OffTheWay { line, joint: joint + 1, off: in_unit(kinds[joint], off) })
    }

    /// The encoders agree with the controller.
    fn confirm_arrival(&mut self, q: &JointVector<f64>, row: usize) -> Result<(), CollectError> {
        let kinds = self.collector.cell.robot.chain.joint_kinds();
        let began = Instant::now();
        loop {
            let view = self.collector.board.view()?;
            let (share, joint) = self.collector.options.near.worst(kinds, &view.q, q);
            if share <= 1.0 && view.t_us > self.collector.since_us {
                return Ok(());
            }
            if began.elapsed() > AGREEMENT {
                let at = |q: &JointVector<f64>| in_unit(kinds[joint], q.as_array()[joint]);
                let line = self.collector.ledger.rows()[row].line;
                return Err(CollectError::Elsewhere { line, joint: joint + 1, sent: at(q), found: at(&view.q) });
            }
            self.collector.listen(&mut self.robot)?;
        }
    }
}

/// A joint's value for people.
fn in_unit(kind: JointKind, value: f64) -> String {
    let unit = ScreenUnit::from(kind);
    format!("{:.3} {}", unit.from_si(value), unit.name())
}
