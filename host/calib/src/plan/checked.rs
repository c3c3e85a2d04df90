//! What a robot may be moved along.

use thiserror::Error;

use super::cell::Cell;
use super::check::check;
use super::contact::Contact;
use crate::plan::PlanRow;

/// A plan that this process has looked at, with the cell in which the robot is to move. All that moves a robot takes one, and it comes
/// from [`CheckedPlan::new`] alone: whoever wrote or edited a plan, it does not lead into something.
#[derive(Clone, Copy, Debug)]
pub struct CheckedPlan<'a> {
    cell: &'a Cell<'a>,
    rows: &'a [PlanRow],
}

/// Why nothing may move along a plan.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum UnsafePlan {
    /// A joint value or the bar's length is no finite number.
    #[error("a number that is none in row {row}")]
    NotFinite {
        /// Of the plan, from 1.
        row: usize,
    },
    /// The pairing is of another rig.
    #[error("a chuck or a sphere that this rig has not, in row {row}")]
    OtherRig {
        /// Of the plan, from 1.
        row: usize,
    },
    /// A joint leaves its limits.
    #[error("a joint beyond its limits")]
    Limits,
    /// The bar would be pulled out of its travel, or pressed.
    #[error("the bar beyond its travel")]
    Travel,
    /// Two things meet.
    #[error("{contact} in one another, on the way to row {row}")]
    Contact {
        /// Which.
        contact: Contact,
        /// Of the plan, from 1.
        row: usize,
    },
}

impl<'a> CheckedPlan<'a> {
    /// Looks at fine steps along a plan. Margins may be gone, but nothing more.
    ///
    /// # Errors
    /// [`UnsafePlan`] when a number is none, a pairing of another rig, a joint leaves its limits, the bar its travel, or two solids meet.
    pub fn new(cell: &'a Cell<'a>, rows: &'a [PlanRow]) -> Result<Self, UnsafePlan> {
        /// Of a joint, radians or metres.
        const STEP: f64 = 0.02;
        let is_finite = |row: &PlanRow| row.bar_m.is_finite() && row.q.as_array().iter().all(|q| q.is_finite());
        for (row, each) in (1..).zip(rows) {
            if !is_finite(each) {
                return Err(UnsafePlan::NotFinite { row });
            }
            if !cell.rig.has(each.pairing) {
                return Err(UnsafePlan::OtherRig { row });
            }
        }
        let found = check(cell, rows, STEP, 0, 0, &|_| ());
        // What cannot be told to be kept is not kept: no number is neither above zero nor below it.
        let is_kept = |margin: f64| margin >= 0.0;
        if !is_kept(found.limit_rad) || !is_kept(found.limit_m) {
            Err(UnsafePlan::Limits)
        } else if !is_kept(found.travel_m) {
            Err(UnsafePlan::Travel)
        } else if !is_kept(found.clearance_m) {
            Err(UnsafePlan::Contact { contact: found.nearest, row: found.nearest_row + 1 })
        } else {
            Ok(Self { cell, rows })
        }
    }

    /// The robot at its rig.
    pub fn cell(&self) -> &'a Cell<'a> {
        self.cell
    }

    /// The rows.
    pub fn rows(&self) -> &'a [PlanRow] {
        self.rows
    }
}
