//! Moving the robot along a plan.
//!
//! The plan is a line: between neighbouring rows joint interpolation was found clear, in either direction. The arm is always at one of
//! its rows, or was stopped between two; it goes to the next row to measure row by row.

use std::time::{Duration, Instant};

use ballbar::{JointKind, JointVector};

use super::board_watch::Stand;
use super::collector::{Collector, Ended};
use super::errors::CollectError;
use super::ledger::Joined;
use super::operator::Event;
use super::track;
use crate::plan;
use crate::robot_link::{JointSpeed, MoveState, RobotLink};
use crate::units::{ScreenUnit, joints_text};

/// A collector that moves the robot.
pub(super) struct Drive<'c, 'a, 'o, 'r> {
    pub(super) collector: &'c mut Collector<'a, 'o>,
    robot: &'r mut dyn RobotLink,
    /// How often the bar came off on the way to this row.
    bar_off: usize,
}

/// How a move to a row ended.
enum Step {
    Arrived,
    /// The controller will not; its words.
    Blocked(String),
    /// The operator wants to end.
    Quit,
}

/// How a single move ended.
pub(super) enum Go {
    Arrived,
    Refused(String),
    Failed(String),
    BarOff,
}

/// Moves that fail are tried again so often.
const RETRIES: usize = 2;
/// How long the encoders may take to agree that the robot has arrived.
const AGREEMENT: Duration = Duration::from_secs(2);
/// The controller is asked no more often than this.
const POLL: Duration = Duration::from_millis(1);
/// So long without a bar within its travel is no jolt, by the board's clock.
const OFF_US: u64 = 100_000;
/// Times that the bar is attached again on the way to one row before somebody has to look.
const BAR_OFF_TIMES: usize = 2;
/// Seed of ways that have to be searched for.
const SEED: u64 = 0;

impl<'c, 'a, 'o, 'r> Drive<'c, 'a, 'o, 'r> {
    pub(super) fn new(collector: &'c mut Collector<'a, 'o>, robot: &'r mut dyn RobotLink) -> Self {
        Self { collector, robot, bar_off: 0 }
    }

    /// Measures all that is left; on an error the robot is stopped.
    pub(super) fn run(mut self) -> Result<Ended, CollectError> {
        let ended = self.compare_controller().and_then(|()| self.walk());
        if ended.is_err() {
            // The error is what matters; a controller that is gone cannot be told.
            let _ = self.robot.stop();
        }
        ended
    }

    /// Before anything moves: the controller and the board have the robot at the same place.
    fn compare_controller(&mut self) -> Result<(), CollectError> {
        let Some(said) = self.robot.joints()? else { return Ok(()) };
        let kinds = self.collector.cell.robot.chain.joint_kinds();
        let found = self.collector.board.view()?.q;
        let (share, joint) = self.collector.options.way.worst(kinds, &said, &found);
        if share <= 1.0 {
            return Ok(());
        }
        let at = |q: &JointVector<f64>| in_unit(kinds[joint], q.as_array()[joint]);
        Err(CollectError::Disagree { joint: joint + 1, controller: at(&said), encoders: at(&found) })
    }

    fn walk(&mut self) -> Result<Ended, CollectError> {
        let Some(first) = self.collector.ledger.first() else { return Ok(Ended::Done) };
        let Some(mut here) = self.find_place(first)? else { return Ok(Ended::Quit) };
        let mut repeated = None;
        loop {
            let next = self.collector.ledger.next(here);
            if self.collector.obey(next)? {
                return Ok(Ended::Quit);
            }
            let next = self.collector.ledger.next(here);
            let shell = self.collector.ledger.shell_of(here);
            let stays = next.is_some_and(|next| shell.contains(&next));
            if !stays && repeated.as_ref() != Some(&shell) && self.collector.options.repeat {
                repeated = Some(shell);
                self.repeat(here)?;
                continue;
            }
            let Some(target) = next else { return Ok(Ended::Done) };
            if target == here {
                if self.measure(here)? {
                    return Ok(Ended::Quit);
                }
                continue;
            }
            let neighbour = if target > here { here + 1 } else { here - 1 };
            match self.step(here, neighbour)? {
                Step::Arrived => here = neighbour,
                Step::Blocked(why) => here = self.go_past(here, neighbour, target, &why)?,
                Step::Quit => return Ok(Ended::Quit),
            }
        }
    }

    /// Measures at the row at which the arm is. True when the operator wants to end.
    fn measure(&mut self, row: usize) -> Result<bool, CollectError> {
        let collector = &mut *self.collector;
        let planned = &collector.ledger.rows()[row];
        let joined = super::ledger::joined(planned);
        if collector.attached != Some(joined) && collector.attach(joined)? {
            return Ok(true);
        }
        let stand = collector.stand_at(&planned.q)?;
        collector.keep(row, stand)?;
        Ok(false)
    }

    /// Goes from a row to a neighbouring one, the bar on or off as the plan has it.
    fn step(&mut self, here: usize, next: usize) -> Result<Step, CollectError> {
        let stays_on = self.collector.ledger.stays_on(here, next);
        if stays_on.is_none() && self.collector.detach()? {
            return Ok(Step::Quit);
        }
        let mut words = String::new();
        for attempt in 0..=RETRIES {
            if let Some(joined) = stays_on
                && self.collector.attached != Some(joined)
                && self.collector.attach(joined)?
            {
                return Ok(Step::Quit);
            }
            let q = self.collector.ledger.rows()[next].q;
            match self.go_measuring(&q, next)? {
                Go::Arrived => {
                    self.bar_off = 0;
                    return Ok(Step::Arrived);
                }
                Go::Refused(why) => return Ok(Step::Blocked(why)),
                Go::Failed(why) => words = why,
                Go::BarOff => {
                    self.count_bar_off(next)?;
                    words = "the bar came off".into();
                }
            }
            if attempt < RETRIES {
                let line = self.collector.ledger.rows()[next].line;
                self.collector.trouble(format!("on the way to line {line}: {words}; trying again"))?;
                self.robot.recover()?;
            }
        }
        Ok(Step::Blocked(words))
    }

    fn count_bar_off(&mut self, row: usize) -> Result<(), CollectError> {
        self.collector.attached = None;
        self.collector.board.recorder().connect(None);
        self.bar_off += 1;
        if self.bar_off > BAR_OFF_TIMES {
            return Err(CollectError::BarOff { line: self.collector.ledger.rows()[row].line });
        }
        Ok(())
    }

    /// A move during which poses are taken, where that is wanted.
    fn go_measuring(&mut self, q: &JointVector<f64>, row: usize) -> Result<Go, CollectError> {
        let options = self.collector.options.track.clone().filter(|_| self.collector.attached.is_some());
        self.collector.board.track(options.is_some());
        let ended = self.go(q, row)?;
        let points = self.collector.board.track(false);
        if let (Some(options), Go::Arrived) = (options, &ended) {
            let poses = track::poses(&points, self.collector.cell.robot.chain.joint_kinds(), &options);
            self.collector.keep_moving(row, &poses)?;
        }
        Ok(ended)
    }

    /// One joint-interpolated move, watched.
    pub(super) fn go(&mut self, q: &JointVector<f64>, row: usize) -> Result<Go, CollectError> {
        self.collector.since_us = self.collector.board.now_us()?;
        let from = self.collector.board.view()?;
        let options = &self.collector.options;
        let speed: JointSpeed = if self.collector.attached.is_some() { options.speed } else { options.free_speed };
        self.robot.start_move(q, &speed)?;
        let mut polled = Instant::now();
        loop {
            self.collector.listen()?;
            if self.is_bar_off()? {
                self.robot.stop()?;
                return Ok(Go::BarOff);
            }
            self.check_way(&from.q, q, row)?;
            if polled.elapsed() < POLL {
                continue;
            }
            polled = Instant::now();
            match self.robot.poll()? {
                MoveState::Moving => {}
                MoveState::Reached => break,
                MoveState::Refused(why) => return Ok(Go::Refused(why)),
                MoveState::Fault(why) => return Ok(Go::Failed(why)),
                MoveState::TimedOut(time) => {
                    return Ok(Go::Failed(format!("the controller said nothing for {:.0} s", time.as_secs_f64())));
                }
            }
        }
        self.confirm_arrival(q, row)?;
        Ok(Go::Arrived)
    }

    fn is_bar_off(&mut self) -> Result<bool, CollectError> {
        let view = self.collector.board.view()?;
        let is_off = view.off_since_us.is_some_and(|since_us| view.t_us - since_us >= OFF_US);
        Ok(is_off && self.collector.attached.is_some())
    }

    /// The encoders are on the straight way in joint space.
    fn check_way(&mut self, from: &JointVector<f64>, to: &JointVector<f64>, row: usize) -> Result<(), CollectError> {
        let view = self.collector.board.view()?;
        let nearest = nearest_on_way(from, to, &view.q);
        let kinds = self.collector.cell.robot.chain.joint_kinds();
        let (share, joint) = self.collector.options.way.worst(kinds, &nearest, &view.q);
        if share <= 1.0 {
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
            if share <= 1.0 {
                return Ok(());
            }
            if began.elapsed() > AGREEMENT {
                let at = |q: &JointVector<f64>| in_unit(kinds[joint], q.as_array()[joint]);
                let line = self.collector.ledger.rows()[row].line;
                return Err(CollectError::Elsewhere { line, joint: joint + 1, sent: at(q), found: at(&view.q) });
            }
            self.collector.listen()?;
        }
    }

    /// Leaves out rows that the controller will not go to, by a way of its own to one behind them.
    fn go_past(&mut self, here: usize, blocked: usize, target: usize, why: &str) -> Result<usize, CollectError> {
        let line = self.collector.ledger.rows()[blocked].line;
        self.collector.trouble(format!("line {line} cannot be reached: {why}"))?;
        self.collector.miss(blocked, why)?;
        let shell = self.collector.ledger.shell_of(here);
        let behind: Vec<usize> =
            if target > here { (blocked + 1..shell.end).collect() } else { (shell.start..blocked).rev().collect() };
        for row in behind {
            let q = self.collector.ledger.rows()[row].q;
            let joined = self.collector.ledger.stays_on(here, row);
            if joined.is_some() && joined == self.collector.attached && self.go_clear(joined, &q, row)? {
                return Ok(row);
            }
        }
        Err(CollectError::Blocked { line, why: why.to_owned() })
    }

    /// By a way that is searched for; false when there is none, or the controller will not go it.
    pub(super) fn go_clear(&mut self, joined: Option<Joined>, q: &JointVector<f64>, row: usize) -> Result<bool, CollectError> {
        let from = self.collector.board.view()?.q;
        let Some(vias) = plan::way_between(self.collector.cell, joined, &from, q, SEED) else { return Ok(false) };
        for q in vias.iter().chain([q]) {
            match self.go(q, row)? {
                Go::Arrived => {}
                Go::BarOff => {
                    self.count_bar_off(row)?;
                    return Ok(false);
                }
                Go::Refused(_) | Go::Failed(_) => return Ok(false),
            }
        }
        Ok(true)
    }

    /// Where on the plan the arm is, brought there if need be; the nearest to row `target`. `None` when the operator wants to end.
    fn find_place(&mut self, target: usize) -> Result<Option<usize>, CollectError> {
        let collector = &mut *self.collector;
        let q = collector.board.view()?.q;
        let (kinds, near) = (collector.cell.robot.chain.joint_kinds(), collector.options.near);
        let rows = collector.ledger.rows();
        let is_at = |&row: &usize| near.holds(kinds, &rows[row].q, &q);
        let is_between = |&row: &usize| near.holds(kinds, &nearest_on_way(&rows[row].q, &rows[row + 1].q, &q), &q);
        let away = |row: &usize| row.abs_diff(target);
        let at = (0..rows.len()).filter(is_at).min_by_key(away);
        if let Some(row) = at {
            collector.find_bar(super::ledger::joined(&rows[row]), rows[row].bar.is_some())?;
            collector.rearm()?;
            return Ok(Some(row));
        }
        if let Some(row) = (0..rows.len().saturating_sub(1)).filter(is_between).min_by_key(away) {
            let joined = collector.ledger.stays_on(row, row + 1);
            collector.find_bar(super::ledger::joined(&rows[row]), joined.is_some())?;
            let end = if target > row { row + 1 } else { row };
            if joined.is_none() || joined == collector.attached {
                return match self.go(&rows[end].q, end)? {
                    Go::Arrived => Ok(Some(end)),
                    Go::Refused(why) | Go::Failed(why) => Err(CollectError::Blocked { line: rows[end].line, why }),
                    Go::BarOff => Err(CollectError::BarOff { line: rows[end].line }),
                };
            }
        }
        self.approach(target)
    }

    /// Brings an arm without the bar to a row.
    fn approach(&mut self, target: usize) -> Result<Option<usize>, CollectError> {
        let row = &self.collector.ledger.rows()[target];
        let off_the_plan = |kinds: &[JointKind], why: &str| {
            let target = joints_text(kinds, row.q.as_array());
            Err(CollectError::OffThePlan { line: row.line, why: why.to_owned(), target })
        };
        let kinds = self.collector.cell.robot.chain.joint_kinds();
        if self.collector.board.view()?.displacement_m.is_some() {
            return off_the_plan(kinds, "a bar is attached");
        }
        if !self.go_clear(None, &row.q, target)? {
            return off_the_plan(kinds, "something is always in the way");
        }
        Ok(Some(target))
    }

    /// Returns to a pose that was measured on this shell, the earlier the better, and back.
    fn repeat(&mut self, here: usize) -> Result<(), CollectError> {
        let joined = super::ledger::joined(&self.collector.ledger.rows()[here]);
        if self.collector.attached != Some(joined) {
            return Ok(());
        }
        let back_q = self.collector.ledger.rows()[here].q;
        let Some((row, before)) = self.returnable(here, joined) else { return Ok(()) };
        let q = self.collector.ledger.rows()[row].q;
        if !self.go_clear(Some(joined), &q, row)? {
            return self.return_to(joined, &back_q, here);
        }
        if let Some(stand) = self.collector.stand_at(&q)? {
            self.collector.compare(row, &before, &stand)?;
        }
        self.return_to(joined, &back_q, here)
    }

    /// The first row measured on this shell in this run to which a way leads, and how the arm stood there.
    fn returnable(&self, here: usize, joined: Joined) -> Option<(usize, Stand)> {
        let rows = self.collector.ledger.rows();
        let has_way =
            |row: usize| plan::way_between(self.collector.cell, Some(joined), &rows[here].q, &rows[row].q, SEED).is_some();
        let measured = self.collector.ledger.shell_of(here).filter(|&row| row != here);
        measured.filter_map(|row| Some((row, self.collector.reference(row)?))).find(|(row, _)| has_way(*row))
    }

    fn return_to(&mut self, joined: Joined, q: &JointVector<f64>, row: usize) -> Result<(), CollectError> {
        if self.collector.attached == Some(joined) && self.go_clear(Some(joined), q, row)? {
            return Ok(());
        }
        let line = self.collector.ledger.rows()[row].line;
        Err(CollectError::Blocked { line, why: "the way back from a repeated pose failed".into() })
    }
}

impl Collector<'_, '_> {
    /// Believes that the bar of a row is on, if it should be and the LVDT shows it.
    fn find_bar(&mut self, joined: Joined, may_be_on: bool) -> Result<(), CollectError> {
        if may_be_on && self.is_plausible(joined)? {
            let connection = self.connection(joined);
            self.attached = Some(joined);
            self.board.recorder().connect(Some(connection.clone()));
            self.operator.tell(&Event::Attached(&connection))?;
        }
        Ok(())
    }
}

/// The joint vector between two that is nearest to a third, joints taken alike.
fn nearest_on_way(from: &JointVector<f64>, to: &JointVector<f64>, q: &JointVector<f64>) -> JointVector<f64> {
    let joints = || from.as_array().iter().zip(to.as_array()).zip(q.as_array());
    let square: f64 = joints().map(|((from, to), _)| (to - from).powi(2)).sum();
    let along: f64 = joints().map(|((from, to), q)| (q - from) * (to - from)).sum();
    let share = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.0 };
    let mut nearest = *from;
    for (value, to) in nearest.as_array_mut().iter_mut().zip(to.as_array()) {
        *value += share * (to - *value);
    }
    nearest
}

/// A joint's value for people.
fn in_unit(kind: JointKind, value: f64) -> String {
    let unit = ScreenUnit::from(kind);
    format!("{:.3} {}", unit.from_si(value), unit.name())
}
