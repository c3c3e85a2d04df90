//! What only a person may see to: the robot stands until somebody has looked and confirmed.

use super::collector::Collector;
use super::drive::Drive;
use super::errors::CollectError;
use super::operator::Event;
use super::talker::Talker;
use crate::robot_link::Intervention;
use crate::units::joints_text;

impl Drive<'_, '_, '_, '_> {
    /// Makes the controller ready for the next move. True when the operator wants to end instead.
    pub(super) fn recover(&mut self) -> Result<bool, CollectError> {
        self.robot.recover()?;
        self.attend()
    }

    /// Has a person see to what only a person may, again until nothing is left of it. No stop of the robot's safety is released without
    /// the person's confirmation. True when the operator wants to end instead.
    ///
    /// Whoever goes on has to look where the arm is now, and whether the bar is on: hands were at the robot.
    pub(super) fn attend(&mut self) -> Result<bool, CollectError> {
        let mut is_changed = false;
        while let Some(needed) = self.robot.intervention()? {
            if self.collector.ask_to_look(&needed, &mut self.robot)? {
                return Ok(true);
            }
            self.robot.release()?;
            is_changed = true;
        }
        if is_changed {
            // What was stopped or paused is not to go on by itself.
            self.robot.recover()?;
        }
        Ok(false)
    }
}

impl Collector<'_, '_> {
    /// True when the operator wants to end instead of confirming.
    fn ask_to_look(&mut self, needed: &Intervention, talker: &mut dyn Talker) -> Result<bool, CollectError> {
        let place = self.place()?;
        let Intervention { what, remedy } = needed;
        if !self.operator.is_present() {
            return Err(CollectError::NobodyToLook { place, what: what.clone(), remedy });
        }
        self.summary.troubles.push(format!("the robot stood {place}: {what}"));
        self.operator.tell(&Event::Inspect { place: &place, needed })?;
        if self.wait_for_confirmation(talker)? {
            return Ok(true);
        }
        self.trouble(format!("the operator has confirmed: {what}"))?;
        if self.is_bar_gone()? {
            self.lose_bar()?;
        }
        self.rearm()?;
        Ok(false)
    }

    /// Where the robot stands, for people.
    fn place(&mut self) -> Result<String, CollectError> {
        let q = self.board.ask()?.q;
        let joints = joints_text(self.cell.robot.chain.joint_kinds(), q.as_array());
        let row = self.goal.map(|row| &self.ledger.rows()[row]);
        Ok(row.map_or_else(|| format!("at {joints}"), |row| format!("on the way to line {} of the plan, at {joints}", row.line)))
    }
}
