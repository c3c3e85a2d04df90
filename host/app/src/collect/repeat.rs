//! Does the robot come back to the same length? A pose of every shell is returned to before the bar is taken off.

use super::board_watch::Stand;
use super::collector::Collector;
use super::errors::CollectError;
use super::operator::Event;

/// A pose that was returned to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeat {
    /// Line of plan.csv.
    pub line: usize,
    /// Second length less the first, metres; what the encoders' difference explains by the model is taken out.
    pub difference_m: f64,
}

impl Collector<'_, '_> {
    /// How the arm stood at a row when it was measured in this run.
    pub(super) fn reference(&self, row: usize) -> Option<Stand> {
        self.stands.get(&row).copied()
    }

    /// Compares two poses at one row.
    pub(super) fn compare(&mut self, row: usize, before: &Stand, now: &Stand) -> Result<(), CollectError> {
        let (Some(before_m), Some(now_m)) = (before.displacement_m, now.displacement_m) else { return Ok(()) };
        let planned = &self.ledger.rows()[row];
        let pairing = self.cell.rig.pairing(planned.pairing);
        let computed_m = |stand: &Stand| self.cell.length(&stand.q, &pairing).0;
        let difference_m = (now_m - before_m) - (computed_m(now) - computed_m(before));
        self.summary.repeats.push(Repeat { line: planned.line, difference_m });
        Ok(self.operator.tell(&Event::Repeated(difference_m))?)
    }
}
