//! Moving the robot along a plan.
//!
//! The plan is a line: between neighbouring rows joint interpolation was found clear, in either direction. The arm is always at one of
//! its rows, or was stopped between two; it goes to the next row to measure row by row.

use ballbar::JointVector;
use ballbar_calib::plan;

use super::board_watch::Stand;
use super::collector::{Bar, Collector, Ended, Rest};
use super::errors::CollectError;
use super::go::Go;
use super::ledger::{Joined, joined};
use crate::robot_link::RobotLink;
use crate::units::joints_text;

/// A collector that moves the robot.
pub(super) struct Drive<'c, 'a, 'o, 'r> {
    pub(super) collector: &'c mut Collector<'a, 'o>,
    pub(super) robot: &'r mut dyn RobotLink,
}

/// How a move to a row ended.
enum Step {
    Arrived,
    /// The controller will not; its words.
    Blocked(String),
    /// The operator wants to end.
    Quit,
}

/// How a way that was searched for ended.
enum Clear {
    Arrived,
    /// There is none.
    NoWay,
    /// The robot stopped on it, or did not begin; why.
    Failed(String),
    Quit,
}

/// Moves that fail are tried again so often.
const RETRIES: usize = 2;
/// Seed of ways that have to be searched for.
const SEED: u64 = 0;

impl<'c, 'a, 'o, 'r> Drive<'c, 'a, 'o, 'r> {
    pub(super) fn new(collector: &'c mut Collector<'a, 'o>, robot: &'r mut dyn RobotLink) -> Self {
        Self { collector, robot }
    }

    /// Measures all that is left; on an error the robot is stopped.
    pub(super) fn run(mut self) -> Result<Ended, CollectError> {
        let ended = self.compare_controller().and_then(|()| self.walk());
        self.collector.board.be_watchful(false);
        if ended.is_err() {
            // The error is what matters; a controller that is gone cannot be told.
            let _ = self.robot.stop();
        }
        ended
    }

    fn walk(&mut self) -> Result<Ended, CollectError> {
        let Some(first) = self.collector.ledger.first() else { return Ok(Ended::Done) };
        if self.attend()? {
            return Ok(Ended::Quit);
        }
        let Some(mut here) = self.find_place(first)? else { return Ok(Ended::Quit) };
        let mut repeated = None;
        loop {
            if self.collector.obey(|ledger| ledger.next(here), &mut self.robot)? {
                return Ok(Ended::Quit);
            }
            let next = self.collector.ledger.next(here);
            let shell = self.collector.ledger.shell_of(here);
            let stays = next.is_some_and(|next| shell.contains(&next));
            if !stays && repeated.as_ref() != Some(&shell) && self.collector.options.repeat {
                repeated = Some(shell);
                if self.repeat(here)? {
                    return Ok(Ended::Quit);
                }
                continue;
            }
            let Some(target) = next else { return Ok(Ended::Done) };
            if target == here {
                if self.measure(here)? {
                    return Ok(Ended::Quit);
                }
                continue;
            }
            if !stays && !self.is_next_door(here, target) {
                match self.leap(target)? {
                    Clear::Arrived => {
                        here = target;
                        continue;
                    }
                    Clear::Quit => return Ok(Ended::Quit),
                    // By the plan's own way, shell by shell.
                    Clear::NoWay | Clear::Failed(_) => {}
                }
            }
            let neighbour = if target > here { here + 1 } else { here - 1 };
            match self.step(here, neighbour)? {
                Step::Arrived => here = neighbour,
                Step::Quit => return Ok(Ended::Quit),
                Step::Blocked(why) => match self.go_past(here, neighbour, target, &why)? {
                    Some(row) => here = row,
                    None => return Ok(Ended::Quit),
                },
            }
        }
    }

    /// Measures at the row at which the arm is. True when the operator wants to end.
    fn measure(&mut self, row: usize) -> Result<bool, CollectError> {
        let collector = &mut *self.collector;
        let planned = &collector.ledger.rows()[row];
        let joined = joined(planned);
        if collector.bar != Bar::On(joined) && collector.attach(joined, &mut self.robot)? {
            return Ok(true);
        }
        match collector.rest_at(&planned.q, &mut self.robot)? {
            Rest::Still(stand) => collector.keep(row, stand)?,
            Rest::Never => collector.miss(row, "the arm did not come to stand still there")?,
            Rest::BarOff => {
                collector.trouble(format!("line {}: the bar came off", planned.line))?;
                collector.lose_bar()?;
            }
            Rest::Quit => return Ok(true),
        }
        Ok(false)
    }

    /// Goes from a row to a neighbouring one, the bar on or off as the plan has it.
    fn step(&mut self, here: usize, next: usize) -> Result<Step, CollectError> {
        let stays_on = self.collector.ledger.stays_on(here, next);
        if stays_on.is_none() && self.collector.detach(&mut self.robot)? {
            return Ok(Step::Quit);
        }
        let (from_q, q) = (self.collector.ledger.rows()[here].q, self.collector.ledger.rows()[next].q);
        let line = self.collector.ledger.rows()[next].line;
        let (mut words, mut times_off) = (String::new(), 0);
        for attempt in 0..=RETRIES {
            if let Some(joined) = stays_on
                && self.collector.bar != Bar::On(joined)
                && self.collector.attach(joined, &mut self.robot)?
            {
                return Ok(Step::Quit);
            }
            if !self.is_on_way(&from_q, &q)? && !self.bring_back(stays_on, here)? {
                return Ok(Step::Quit);
            }
            match self.go_measuring(&q, next)? {
                Go::Arrived => return Ok(Step::Arrived),
                Go::Refused(why) => return Ok(Step::Blocked(why)),
                Go::Quit => return Ok(Step::Quit),
                Go::Failed(why) => words = why,
                Go::BarOff => {
                    times_off += 1;
                    words = "the bar came off".into();
                }
            }
            if attempt < RETRIES {
                if self.recover()? {
                    return Ok(Step::Quit);
                }
                self.collector.trouble(format!("on the way to line {line}: {words}; trying again"))?;
            }
        }
        if times_off > RETRIES { Err(CollectError::BarOff { line }) } else { Ok(Step::Blocked(words)) }
    }

    /// Somebody has moved the arm since: back to the row where it was. False when the operator wants to end.
    fn bring_back(&mut self, stays_on: Option<Joined>, here: usize) -> Result<bool, CollectError> {
        let row = &self.collector.ledger.rows()[here];
        self.collector.trouble(format!("the robot was moved; it is brought back to line {}", row.line))?;
        match self.go_clear(stays_on, &row.q, here)? {
            Clear::Arrived => Ok(true),
            Clear::Quit => Ok(false),
            Clear::NoWay | Clear::Failed(_) => Err(CollectError::Moved { line: row.line, target: self.words(&row.q) }),
        }
    }

    /// Whether the plan itself leads from here to a row of another shell, without another one between.
    fn is_next_door(&self, here: usize, target: usize) -> bool {
        let (here, target) = (self.collector.ledger.shell_of(here), self.collector.ledger.shell_of(target));
        here.end == target.start
    }

    /// To a row of another shell, with the bar off, by a way that is searched for.
    fn leap(&mut self, target: usize) -> Result<Clear, CollectError> {
        let q = self.collector.ledger.rows()[target].q;
        let from = self.collector.board.ask()?.q;
        if plan::way_between(self.collector.cell, None, &from, &q, SEED).is_none() {
            return Ok(Clear::NoWay);
        }
        if self.collector.detach(&mut self.robot)? {
            return Ok(Clear::Quit);
        }
        self.go_clear(None, &q, target)
    }

    /// Leaves out rows that the controller will not go to, by a way of its own to one behind them. `None` when the operator wants to
    /// end.
    fn go_past(&mut self, here: usize, blocked: usize, target: usize, why: &str) -> Result<Option<usize>, CollectError> {
        let line = self.collector.ledger.rows()[blocked].line;
        self.collector.trouble(format!("line {line} cannot be reached: {why}"))?;
        self.collector.miss(blocked, why)?;
        if self.recover()? {
            return Ok(None);
        }
        let shell = self.collector.ledger.shell_of(here);
        let behind: Vec<usize> =
            if target > here { (blocked + 1..shell.end).collect() } else { (shell.start..blocked).rev().collect() };
        for row in behind {
            let stays_on = self.collector.ledger.stays_on(here, row);
            let is_as_planned = match stays_on {
                Some(joined) => self.collector.bar == Bar::On(joined),
                None => self.collector.bar == Bar::Off,
            };
            if !is_as_planned {
                continue;
            }
            let q = self.collector.ledger.rows()[row].q;
            match self.go_clear(stays_on, &q, row)? {
                Clear::Arrived => return Ok(Some(row)),
                Clear::Quit => return Ok(None),
                Clear::Failed(_) if self.recover()? => return Ok(None),
                Clear::NoWay | Clear::Failed(_) => {}
            }
        }
        Err(CollectError::Blocked { line, why: why.to_owned() })
    }

    /// By a way that is searched for, anew from where the robot stands when it has failed.
    fn go_clear(&mut self, joined: Option<Joined>, q: &JointVector<f64>, row: usize) -> Result<Clear, CollectError> {
        let mut ended = self.try_clear(joined, q, row)?;
        for _ in 0..RETRIES {
            let Clear::Failed(why) = &ended else { break };
            let what = format!("{why}; trying again");
            if self.recover()? {
                return Ok(Clear::Quit);
            }
            // It may have come off on the way, or in somebody's hands.
            if joined.is_some_and(|joined| self.collector.bar != Bar::On(joined)) {
                break;
            }
            self.collector.trouble(what)?;
            ended = self.try_clear(joined, q, row)?;
        }
        Ok(ended)
    }

    fn try_clear(&mut self, joined: Option<Joined>, q: &JointVector<f64>, row: usize) -> Result<Clear, CollectError> {
        let from = self.collector.board.ask()?.q;
        let Some(vias) = plan::way_between(self.collector.cell, joined, &from, q, SEED) else { return Ok(Clear::NoWay) };
        for q in vias.iter().chain([q]) {
            match self.go(q, row)? {
                Go::Arrived => {}
                Go::Quit => return Ok(Clear::Quit),
                Go::BarOff => return Ok(Clear::Failed("the bar came off".into())),
                Go::Refused(why) | Go::Failed(why) => return Ok(Clear::Failed(why)),
            }
        }
        Ok(Clear::Arrived)
    }

    /// Where on the plan the arm is, brought there if need be; the nearest to row `target`. `None` when the operator wants to end.
    fn find_place(&mut self, target: usize) -> Result<Option<usize>, CollectError> {
        let q = self.collector.board.ask()?.q;
        let rows = self.collector.ledger.rows();
        let (kinds, near) = (self.collector.cell.robot.chain.joint_kinds(), self.collector.options.near);
        let away = |row: &usize| row.abs_diff(target);
        let is_at = |&row: &usize| near.holds(kinds, &rows[row].q, &q);
        if let Some(row) = (0..rows.len()).filter(is_at).min_by_key(away) {
            self.find_bar(rows[row].bar.is_some().then_some(joined(&rows[row])))?;
            self.collector.rearm()?;
            return Ok(Some(row));
        }
        let is_between = |&row: &usize| near.holds(kinds, &nearest_on_way(&rows[row].q, &rows[row + 1].q, &q), &q);
        if let Some(row) = (0..rows.len().saturating_sub(1)).filter(is_between).min_by_key(away) {
            let stays_on = self.collector.ledger.stays_on(row, row + 1);
            self.find_bar(stays_on)?;
            // The step sees to the bar, on this way as on any.
            let (here, next) = if target > row { (row, row + 1) } else { (row + 1, row) };
            return match self.step(here, next)? {
                Step::Arrived => Ok(Some(next)),
                Step::Blocked(why) => Err(CollectError::Blocked { line: rows[next].line, why }),
                Step::Quit => Ok(None),
            };
        }
        self.approach(target)
    }

    /// Believes that a bar is on, if it should be and the LVDT shows it.
    fn find_bar(&mut self, joined: Option<Joined>) -> Result<(), CollectError> {
        if let Some(joined) = joined
            && self.collector.is_plausible(joined)?
        {
            self.collector.believe_on(joined)?;
        }
        Ok(())
    }

    /// Brings an arm that stands off the plan, its bar off, to a row.
    fn approach(&mut self, target: usize) -> Result<Option<usize>, CollectError> {
        let row = &self.collector.ledger.rows()[target];
        if self.collector.detach(&mut self.robot)? {
            return Ok(None);
        }
        let why = match self.go_clear(None, &row.q, target)? {
            Clear::Arrived => return Ok(Some(target)),
            Clear::Quit => return Ok(None),
            Clear::NoWay => "something is always in the way".into(),
            Clear::Failed(why) => why,
        };
        Err(CollectError::OffThePlan { line: row.line, why, target: self.words(&row.q) })
    }

    /// Returns to a pose that was measured on this shell, the earlier the better, and back. True when the operator wants to end.
    fn repeat(&mut self, here: usize) -> Result<bool, CollectError> {
        let joined = joined(&self.collector.ledger.rows()[here]);
        if self.collector.bar != Bar::On(joined) {
            return Ok(false);
        }
        let Some((row, before)) = self.returnable(here, joined) else { return Ok(false) };
        let (back_q, q) = (self.collector.ledger.rows()[here].q, self.collector.ledger.rows()[row].q);
        match self.go_clear(Some(joined), &q, row)? {
            Clear::Arrived => match self.collector.rest_at(&q, &mut self.robot)? {
                Rest::Still(stand) => self.collector.compare(row, &before, &stand)?,
                Rest::Quit => return Ok(true),
                Rest::Never | Rest::BarOff => {}
            },
            Clear::Quit => return Ok(true),
            Clear::NoWay | Clear::Failed(_) => {
                if self.recover()? {
                    return Ok(true);
                }
            }
        }
        if self.collector.bar != Bar::On(joined) && self.collector.attach(joined, &mut self.robot)? {
            return Ok(true);
        }
        match self.go_clear(Some(joined), &back_q, here)? {
            Clear::Arrived => Ok(false),
            Clear::Quit => Ok(true),
            Clear::NoWay | Clear::Failed(_) => {
                let row = &self.collector.ledger.rows()[here];
                Err(CollectError::Moved { line: row.line, target: self.words(&row.q) })
            }
        }
    }

    /// The first row measured on this shell in this run to which a way leads, and how the arm stood there.
    fn returnable(&self, here: usize, joined: Joined) -> Option<(usize, Stand)> {
        let rows = self.collector.ledger.rows();
        let cell = self.collector.cell;
        let has_way = |row: usize| plan::way_between(cell, Some(joined), &rows[here].q, &rows[row].q, SEED).is_some();
        let measured = self.collector.ledger.shell_of(here).filter(|&row| row != here);
        measured.filter_map(|row| Some((row, self.collector.reference(row)?))).find(|(row, _)| has_way(*row))
    }

    fn words(&self, q: &JointVector<f64>) -> String {
        joints_text(self.collector.cell.robot.chain.joint_kinds(), q.as_array())
    }
}

/// The joint vector between two that is nearest to a third, joints taken alike.
pub(super) fn nearest_on_way(from: &JointVector<f64>, to: &JointVector<f64>, q: &JointVector<f64>) -> JointVector<f64> {
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
