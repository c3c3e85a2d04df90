//! What of a plan is done, and what comes next.

use std::collections::HashSet;

use ballbar_calib::model::PairingId;
use ballbar_calib::plan::{Cell, CheckedPlan, PlanRow, RowKind};

/// What became of a row so far.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RowState {
    /// The robot only goes through.
    Via,
    /// To be measured.
    Todo,
    /// In poses.csv.
    Measured,
    /// The operator does not want it.
    Skipped,
    /// It could not be measured in this run; another run tries again.
    Missed(String),
}

/// A plan and what is done of it.
#[derive(Clone, Debug)]
pub struct Ledger<'a> {
    plan: CheckedPlan<'a>,
    states: Vec<RowState>,
}

/// Which ends a bar joins, and its length at mid travel in metres.
pub(super) type Joined = (PairingId, f64);

impl<'a> Ledger<'a> {
    /// A plan of which the rows of these lines of plan.csv are measured, and those skipped.
    pub fn new(plan: CheckedPlan<'a>, measured: impl Iterator<Item = usize>, skipped: impl Iterator<Item = usize>) -> Self {
        let (measured, skipped): (HashSet<usize>, HashSet<usize>) = (measured.collect(), skipped.collect());
        let state = |row: &PlanRow| match row.kind {
            RowKind::Via => RowState::Via,
            RowKind::Measure if measured.contains(&row.line) => RowState::Measured,
            RowKind::Measure if skipped.contains(&row.line) => RowState::Skipped,
            RowKind::Measure => RowState::Todo,
        };
        Self { plan, states: plan.rows().iter().map(state).collect() }
    }

    /// The robot at its rig, for which the plan was checked.
    pub fn cell(&self) -> &'a Cell<'a> {
        self.plan.cell()
    }

    /// The rows.
    pub fn rows(&self) -> &'a [PlanRow] {
        self.plan.rows()
    }

    /// What became of a row.
    pub fn state(&self, row: usize) -> &RowState {
        &self.states[row]
    }

    /// Notes what became of a row that is to be measured.
    pub fn set(&mut self, row: usize, state: RowState) {
        if self.states[row] != RowState::Via {
            self.states[row] = state;
        }
    }

    /// The row of a line of plan.csv.
    pub fn row_of_line(&self, line: usize) -> Option<usize> {
        self.rows().iter().position(|row| row.line == line)
    }

    /// The row to measure next for an arm at row `here`: on its shell ahead, or else behind; then that of another shell that comes
    /// first.
    pub fn next(&self, here: usize) -> Option<usize> {
        let is_todo = |&row: &usize| self.states[row] == RowState::Todo;
        let shell = self.shell_of(here);
        let ahead = (here..shell.end).find(is_todo);
        let behind = || (shell.start..here).rev().find(is_todo);
        ahead.or_else(behind).or_else(|| self.first())
    }

    /// The first row to measure.
    pub fn first(&self) -> Option<usize> {
        self.states.iter().position(|state| *state == RowState::Todo)
    }

    /// Rows of one connection around a row, those without the bar before them among these.
    pub fn shell_of(&self, row: usize) -> std::ops::Range<usize> {
        let joined = joined(&self.rows()[row]);
        let is_other = |other: &PlanRow| self::joined(other) != joined;
        let start = self.rows()[..row].iter().rposition(is_other).map_or(0, |last| last + 1);
        let end = self.rows()[row..].iter().position(is_other).map_or(self.rows().len(), |first| row + first);
        start..end
    }

    /// Whether the bar stays on between two neighbouring rows, and where.
    pub fn stays_on(&self, a: usize, b: usize) -> Option<Joined> {
        let (a, b) = (&self.rows()[a], &self.rows()[b]);
        (a.bar.is_some() && b.bar.is_some() && joined(a) == joined(b)).then_some(joined(a))
    }

    /// Rows of a state.
    pub fn count(&self, state: &RowState) -> usize {
        self.states.iter().filter(|other| *other == state).count()
    }

    /// Rows that are measured, or were to be.
    pub fn measurable(&self) -> usize {
        self.states.len() - self.count(&RowState::Via)
    }

    /// Lines of plan.csv that could not be measured, and why.
    pub fn missed(&self) -> Vec<(usize, String)> {
        let missed = self.rows().iter().zip(&self.states).filter_map(|(row, state)| match state {
            RowState::Missed(why) => Some((row.line, why.clone())),
            _ => None,
        });
        missed.collect()
    }
}

/// Rows of a plan by connection, in order.
pub fn shells(rows: &[PlanRow]) -> impl Iterator<Item = std::ops::Range<usize>> + '_ {
    let mut start = 0;
    rows.chunk_by(|a, b| joined(a) == joined(b)).map(move |shell| {
        let shell = start..start + shell.len();
        start = shell.end;
        shell
    })
}

/// What the bar joins, or will join, at a row.
pub(super) fn joined(row: &PlanRow) -> Joined {
    (row.pairing, row.bar_m)
}
