//! An operator for tests.

use std::collections::VecDeque;

use host_cal::collect::{Event, Operator, Wish};
use host_cal::robot_link::LinkError;
use host_cal::robot_link::sim::{SimHand, SimRequest};
use host_cal::session::Connection;

use crate::simulated_cell::SimulatedCell;

/// The simulation's hand, with wishes that come when so many poses were measured, and a grip that may be wrong.
pub struct Crew {
    hand: SimHand,
    is_done: bool,
    /// Poses measured so far.
    pub measured: usize,
    /// With how many poses measured they come.
    pub wishes: VecDeque<(usize, Wish)>,
    /// How often the bar is attached to the wrong sphere before it is attached as asked for.
    wrong: usize,
    /// How often it is left on when it should come off.
    left_on: usize,
    /// Whether somebody looks at the robot and confirms.
    is_looking: bool,
    /// All that it was told.
    pub told: Vec<String>,
}

impl Crew {
    /// Does as it is asked.
    pub fn new(cell: &SimulatedCell) -> Self {
        let (wishes, told) = (VecDeque::new(), Vec::new());
        Self { hand: cell.hand(), is_done: false, measured: 0, wishes, wrong: 0, left_on: 0, is_looking: false, told }
    }

    /// With wishes, and how many poses are measured when they come.
    pub fn wishing(cell: &SimulatedCell, wishes: &[(usize, Wish)]) -> Self {
        Self { wishes: wishes.iter().copied().collect(), ..Self::new(cell) }
    }

    /// Attaches the bar to the wrong chuck so many times.
    #[must_use]
    pub fn wrong(self, times: usize) -> Self {
        Self { wrong: times, ..self }
    }

    /// Leaves it on so many times when it should come off.
    #[must_use]
    pub fn left_on(self, times: usize) -> Self {
        Self { left_on: times, ..self }
    }

    /// Looks at the robot when it is asked to, and confirms.
    #[must_use]
    pub fn looking(self) -> Self {
        Self { is_looking: true, ..self }
    }

    fn attach(&mut self, bar: &Connection) -> Result<(), LinkError> {
        let is_wrong = self.wrong > 0;
        self.wrong = self.wrong.saturating_sub(1);
        let chuck = if is_wrong { "B".to_owned() } else { bar.chuck.clone() };
        self.hand.act(&SimRequest::Attach { chuck, sphere: bar.sphere.clone(), mid_m: bar.bar_m })
    }
}

impl Operator for Crew {
    fn tell(&mut self, event: &Event<'_>) -> Result<(), LinkError> {
        match event {
            Event::Attach(bar) => {
                self.attach(bar)?;
                self.is_done = true;
            }
            Event::Detach(_) => {
                if self.left_on > 0 {
                    self.left_on -= 1;
                } else {
                    self.hand.act(&SimRequest::Detach)?;
                }
                self.is_done = true;
            }
            Event::Inspect { .. } => self.is_done = self.is_looking,
            Event::Measured(_) => self.measured += 1,
            Event::Now(_) => return Ok(()),
            _ => {}
        }
        self.told.push(format!("{event:?}"));
        Ok(())
    }

    fn is_present(&self) -> bool {
        self.is_looking
    }

    fn wish(&mut self) -> Option<Wish> {
        if std::mem::take(&mut self.is_done) {
            return Some(Wish::Confirm);
        }
        let is_due = self.wishes.front().is_some_and(|(measured, _)| self.measured >= *measured);
        if is_due { self.wishes.pop_front().map(|(_, wish)| wish) } else { None }
    }
}
