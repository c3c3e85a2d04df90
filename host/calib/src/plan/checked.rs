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
    /// A joint leaves its limits.
    #[error("a joint beyond its limits")]
    Limits,
    /// The bar would be pulled out of its travel, or pressed.
    #[error("the bar beyond its travel")]
    Travel,
    /// Two things meet.
    #[error("{contact} in one another, on the way to line {line}")]
    Contact {
        /// Which.
        contact: Contact,
        /// Of the plan's text.
        line: usize,
    },
}

impl<'a> CheckedPlan<'a> {
    /// Looks at fine steps along a plan. Margins may be gone, but nothing more.
    ///
    /// # Errors
    /// [`UnsafePlan`] when a joint leaves its limits, the bar its travel, or two solids meet.
    pub fn new(cell: &'a Cell<'a>, rows: &'a [PlanRow]) -> Result<Self, UnsafePlan> {
        /// Of a joint, radians or metres.
        const STEP: f64 = 0.02;
        let found = check(cell, rows, STEP, 0, 0, &|_| ());
        if found.limit_rad < 0.0 || found.limit_m < 0.0 {
            Err(UnsafePlan::Limits)
        } else if found.travel_m < 0.0 {
            Err(UnsafePlan::Travel)
        } else if found.clearance_m < 0.0 {
            let line = rows.get(found.nearest_row).map_or(0, |row| row.line);
            Err(UnsafePlan::Contact { contact: found.nearest, line })
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
