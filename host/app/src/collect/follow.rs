//! Measuring while somebody drives the robot with the teach pendant, or a program runs at its controller: every pose at which the arm
//! stands still counts for the row that it is near.

use std::ops::Range;

use super::Nearness;
use super::board_watch::Stand;
use super::collector::{Collector, Ended};
use super::errors::CollectError;
use super::ledger::{Ledger, RowState, joined, shells};
use super::operator::Event;
use super::talker::Nobody;

/// What somebody is told who moves the robot.
#[derive(Clone, Debug, PartialEq)]
pub enum Guide {
    /// Where to drive.
    Hand,
    /// Which programs to start, for each shell of the plan.
    Programs(Vec<ShellPrograms>),
}

/// Programs of one shell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShellPrograms {
    /// Brings the robot, without the bar, to where the bar is attached.
    pub approach: String,
    /// Goes over the shell.
    pub measure: String,
}

impl Collector<'_, '_> {
    pub(super) fn follow_all(&mut self, near: Nearness, guide: &Guide) -> Result<Ended, CollectError> {
        let shells: Vec<Range<usize>> = shells(self.ledger.rows()).collect();
        for (number, shell) in shells.into_iter().enumerate() {
            let Some(first) = self.todo(&shell) else { continue };
            let programs = match guide {
                Guide::Hand => None,
                Guide::Programs(programs) => programs.get(number),
            };
            if self.detach(&mut Nobody)? {
                return Ok(Ended::Quit);
            }
            match programs {
                None => self.tell_where(first)?,
                Some(programs) => {
                    // Where the shell before ends: from there its first row was found clear, and there its program begins.
                    if self.wait_near(shell.start.saturating_sub(1))? {
                        return Ok(Ended::Quit);
                    }
                    self.goal = Some(first);
                    self.operator.tell(&Event::Start(&programs.approach))?;
                }
            }
            if self.attach(joined(&self.ledger.rows()[first]), &mut Nobody)? {
                return Ok(Ended::Quit);
            }
            if let Some(programs) = programs {
                self.operator.tell(&Event::Start(&programs.measure))?;
            }
            if self.follow_shell(&shell, near, programs.is_none())? {
                return Ok(Ended::Quit);
            }
        }
        Ok(Ended::Done)
    }

    /// Until nothing of a shell is left. True when the operator wants to end.
    fn follow_shell(&mut self, shell: &Range<usize>, near: Nearness, by_hand: bool) -> Result<bool, CollectError> {
        let mut told = self.todo(shell);
        while let Some(target) = self.todo(shell) {
            self.goal = Some(target);
            if by_hand && told != Some(target) {
                told = Some(target);
                self.tell_where(target)?;
            }
            let next = |ledger: &Ledger<'_>| shell.clone().find(|&row| *ledger.state(row) == RowState::Todo);
            if self.obey(next, &mut Nobody)? {
                return Ok(true);
            }
            self.listen(&mut Nobody)?;
            let since_us = self.since_us;
            if let Some(stand) = self.board.take_stand().filter(|stand| stand.began_us >= since_us) {
                self.take_followed(shell, near, stand)?;
            }
        }
        Ok(false)
    }

    /// Waits until the arm is near a row; says where to, if it is not. True when the operator wants to end.
    fn wait_near(&mut self, goal: usize) -> Result<bool, CollectError> {
        let kinds = self.cell.robot.chain.joint_kinds();
        let mut is_told = false;
        loop {
            let q = self.board.view()?.q;
            if self.options.near.holds(kinds, &self.ledger.rows()[goal].q, &q) {
                return Ok(false);
            }
            if !is_told {
                is_told = true;
                self.tell_where(goal)?;
            }
            if self.wants_to_end() {
                return Ok(true);
            }
            self.listen(&mut Nobody)?;
        }
    }

    fn todo(&self, shell: &Range<usize>) -> Option<usize> {
        shell.clone().find(|&row| *self.ledger.state(row) == RowState::Todo)
    }

    fn tell_where(&mut self, row: usize) -> Result<(), CollectError> {
        let planned = &self.ledger.rows()[row];
        self.goal = Some(row);
        Ok(self.operator.tell(&Event::Drive { line: planned.line, q: &planned.q })?)
    }

    /// Keeps a pose for the row of a shell that is nearest to it, if one is near.
    fn take_followed(&mut self, shell: &Range<usize>, near: Nearness, stand: Stand) -> Result<(), CollectError> {
        let kinds = self.cell.robot.chain.joint_kinds();
        let off = |&row: &usize| near.worst(kinds, &self.ledger.rows()[row].q, &stand.q).0;
        let is_planned = |&row: &usize| *self.ledger.state(row) != RowState::Via;
        let Some(row) = shell.clone().filter(is_planned).min_by(|a, b| off(a).total_cmp(&off(b))) else { return Ok(()) };
        if off(&row) > 1.0 {
            let line = self.ledger.rows()[row].line;
            let words = format!("the arm stands at no planned pose; the nearest is line {line}, {:.1} times too far", off(&row));
            return Ok(self.operator.tell(&Event::Trouble(&words))?);
        }
        if *self.ledger.state(row) != RowState::Todo {
            return Ok(());
        }
        self.keep(row, stand)
    }
}
