//! Which poses to measure, and the way between them, from the nominal robot alone.
//!
//! ```text
//! Grid ─▶ posture::find (tool orientations, inverse kinematics, margins) ─▶ ShellRoads (choice, ways) ─▶ tour ─▶ PlanRow
//!                         Cell: limits, singularity, travel, Scene ◀─┘             │
//!                                                                  d_optimal ◀─────┴─────▶ Quality
//! ```
//!
//! `docs/planning.md` says how each choice is made and why.

mod cell;
mod check;
mod choice;
mod contact;
mod cores;
mod experience;
mod geometry;
mod grid;
mod growth;
mod information;
mod optimal;
mod order;
mod planner;
mod posture;
mod progress;
mod quality;
mod scene;
mod shell;
mod transfer;
mod way;

pub use cell::{Cell, LimitMargin, Margins, Pace, RESERVED_DEVIATIONS, plausible_deviation};
pub use check::{Found as CheckFound, check};
pub use contact::{Contact, Nearest};
pub use geometry::{Disc, Segment};
pub use grid::{Crossing, Grid};
pub use optimal::d_optimal;
pub use planner::{Comparison, Plan, PlanError, PlanOptions, ShellSummary, plan};
pub use posture::Hindrance;
pub use progress::{Progress, Stage, Tell};
pub use quality::{Expectation, Quality, Unfit};
pub use scene::{FixturesOverlap, Scene};
pub use transfer::way_between;
