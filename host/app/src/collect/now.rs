//! How a collection stands at a moment, for whoever watches it.

use std::time::Duration;

use ballbar::JointVector;

use super::board_watch::View;
use super::collector::{Bar, Collector};
use super::ledger::RowState;
use crate::board::StreamLosses;
use crate::session::Connection;

/// How things stand.
#[derive(Clone, Debug, PartialEq)]
pub struct Now {
    /// The arm at the latest sample.
    pub view: View,
    /// Ends of the LVDT's travel, from mid travel, metres.
    pub travel_m: (f64, f64),
    /// What the bar joins; `None` while it is off, or nobody knows.
    pub joined: Option<Connection>,
    /// Measured less computed length of the bar that is on, metres.
    pub residual_m: Option<f64>,
    /// Where the arm is to be.
    pub goal: Option<Goal>,
    /// Samples a second, by the board's clock.
    pub rate_hz: Option<f64>,
    /// Lost between board and host.
    pub losses: StreamLosses,
    /// Poses of the plan measured so far, over all runs.
    pub done: usize,
    /// Poses of the plan.
    pub all: usize,
    /// What is left to do, at the pace so far.
    pub left: Option<Duration>,
}

/// A row that the arm is to go to, or is at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Line of plan.csv.
    pub line: usize,
    /// Encoder outputs, radians or metres.
    pub q: JointVector<f64>,
}

impl Collector<'_, '_> {
    /// `None` before the first sample.
    pub(super) fn now(&self) -> Option<Now> {
        let view = *self.board.latest()?;
        let (least_m, most_m) = self.board.robot().set().lvdt.travel_m::<f64>();
        let joined = if let Bar::On(joined) = self.bar { Some(joined) } else { None };
        let residual_m = joined.zip(view.displacement_m).map(|((pairing, bar_m), displacement_m)| {
            let (computed_m, _) = self.cell.length(&view.q, &self.cell.rig.pairing(pairing));
            bar_m + displacement_m - computed_m
        });
        let goal = self.goal.map(|row| {
            let planned = &self.ledger.rows()[row];
            Goal { line: planned.line, q: planned.q }
        });
        Some(Now {
            view,
            travel_m: (least_m, most_m),
            joined: joined.map(|joined| self.connection(joined)),
            residual_m,
            goal,
            rate_hz: self.board.rate_hz(),
            losses: self.board.losses(),
            done: self.ledger.count(&RowState::Measured),
            all: self.ledger.measurable(),
            left: self.time_left(),
        })
    }
}
