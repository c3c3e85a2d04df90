//! How far planning has come.

use std::cell::Cell;
use std::fmt;
use std::sync::{Mutex, PoisonError};

/// What is done one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Stage {
    /// Postures at the points of every shell, and paths between them; counted in points.
    Postures,
    /// Paths between shells' families of postures; counted in families.
    Families,
    /// The choice of poses.
    Choice,
    /// Tours of the chosen poses; counted in rounds of improvement.
    Tours,
    /// Moves from shell to shell, without the bar; counted in shells.
    Moves,
    /// Fine steps along the plan, and plausible robots; counted in rows and robots.
    Check,
}

impl Stage {
    /// All, in order.
    pub const ALL: [Self; 6] = [Self::Postures, Self::Families, Self::Choice, Self::Tours, Self::Moves, Self::Check];
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Postures => "postures and paths",
            Self::Families => "paths between families",
            Self::Choice => "choosing poses",
            Self::Tours => "ordering poses",
            Self::Moves => "moves between shells",
            Self::Check => "checking the plan",
        })
    }
}

/// How much of a stage is done. Stages come in their order; within one `total` stays and `done` grows to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Progress {
    /// Which.
    pub stage: Stage,
    /// So much of it.
    pub done: usize,
    /// When it is finished.
    pub total: usize,
}

/// Whom to tell of progress; called from several threads, but by one at a time.
pub type Tell<'a> = dyn Fn(Progress) + Sync + 'a;

/// A stage that is going on.
pub(super) struct Ongoing<'a> {
    stage: Stage,
    total: usize,
    done: Mutex<usize>,
    tell: &'a Tell<'a>,
}

impl<'a> Ongoing<'a> {
    pub(super) fn begin(stage: Stage, total: usize, tell: &'a Tell<'a>) -> Self {
        tell(Progress { stage, done: 0, total });
        Self { stage, total, done: Mutex::new(0), tell }
    }

    /// So much more is done; what would go beyond the total is not counted.
    pub(super) fn tick(&self, count: usize) {
        // A panic elsewhere leaves the count as it was, and the scope passes it on.
        let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        *done = (*done + count).min(self.total);
        (self.tell)(Progress { stage: self.stage, done: *done, total: self.total });
    }

    /// A part of the stage that takes an equal share of it: at most so many ticks, and exactly so many when it is dropped.
    pub(super) fn part(&self, ticks: usize) -> Part<'_> {
        Part { of: self, left: Cell::new(ticks) }
    }
}

/// See [`Ongoing::part`].
pub(super) struct Part<'a> {
    of: &'a Ongoing<'a>,
    left: Cell<usize>,
}

impl Part<'_> {
    /// One more is done; the last one waits for the end.
    pub(super) fn tick(&self) {
        let left = self.left.get();
        if left > 1 {
            self.left.set(left - 1);
            self.of.tick(1);
        }
    }
}

impl Drop for Part<'_> {
    fn drop(&mut self) {
        self.of.tick(self.left.get());
    }
}
