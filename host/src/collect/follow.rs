//! Measuring while somebody drives the robot with the teach pendant, or a program runs at its controller: every pose at which the arm
//! stands still counts for the row that it is near.

use super::Nearness;
use super::board_watch::Stand;
use super::collector::{Collector, Ended};
use super::errors::CollectError;
use super::ledger::{Joined, RowState, joined};
use super::operator::Event;

impl Collector<'_, '_> {
    pub(super) fn follow_all(&mut self, near: Nearness, load: &mut dyn FnMut(Joined)) -> Result<Ended, CollectError> {
        while let Some(row) = self.ledger.first() {
            let shell = self.ledger.shell_of(row);
            let joined = joined(&self.ledger.rows()[row]);
            load(joined);
            if self.detach()? {
                return Ok(Ended::Quit);
            }
            self.tell_where(row)?;
            if self.attach(joined)? {
                return Ok(Ended::Quit);
            }
            let mut told = row;
            while let Some(target) = shell.clone().find(|&row| *self.ledger.state(row) == RowState::Todo) {
                if told != target {
                    told = target;
                    self.tell_where(target)?;
                }
                if self.obey(Some(target))? {
                    return Ok(Ended::Quit);
                }
                self.listen()?;
                if let Some(stand) = self.board.take_stand() {
                    self.take_followed(shell.clone(), near, stand)?;
                }
            }
        }
        Ok(Ended::Done)
    }

    fn tell_where(&mut self, row: usize) -> Result<(), CollectError> {
        let planned = &self.ledger.rows()[row];
        Ok(self.operator.tell(&Event::Drive { line: planned.line, q: &planned.q })?)
    }

    /// Keeps a pose for the row of a shell that is nearest to it, if one is near.
    fn take_followed(&mut self, shell: std::ops::Range<usize>, near: Nearness, stand: Stand) -> Result<(), CollectError> {
        let kinds = self.cell.robot.chain.joint_kinds();
        let off = |&row: &usize| near.worst(kinds, &self.ledger.rows()[row].q, &stand.q).0;
        let todo = shell.filter(|&row| *self.ledger.state(row) == RowState::Todo);
        let Some(row) = todo.min_by(|a, b| off(a).total_cmp(&off(b))) else { return Ok(()) };
        if off(&row) > 1.0 {
            let line = self.ledger.rows()[row].line;
            let words = format!("the arm stands at no planned pose; the nearest is line {line}, {:.1} times too far", off(&row));
            return Ok(self.operator.tell(&Event::Trouble(&words))?);
        }
        self.keep(row, Some(stand))
    }
}
