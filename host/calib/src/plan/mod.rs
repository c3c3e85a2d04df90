//! Which poses to measure, and the way between them, from the nominal robot alone.
//!
//! ```text
//! Grid ─▶ posture::find (tool orientations, inverse kinematics, margins) ─▶ ShellRoads (choice, ways) ─▶ tour ─▶ PlanRow
//!                         Cell: limits, singularity, travel, Scene ◀─┘             │
//!                                                                  d_optimal ◀─────┴─────▶ Quality
//! ```
//!
//! `docs/planning.md` says how each choice is made and why.

mod bodies;
mod cause;
mod cell;
mod check;
mod checked;
mod choice;
mod contact;
mod cores;
mod experience;
mod fixtures;
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
mod rows;
mod scene;
mod shell;
mod swing;
mod transfer;
mod way;

pub use cause::Cause;
pub use cell::{Cell, LimitMargin, Margins, Pace, RESERVED_DEVIATIONS, plausible_deviation};
pub use check::{Found as CheckFound, check};
pub use checked::{CheckedPlan, UnsafePlan};
pub use contact::{Contact, Nearest};
pub use fixtures::FixturesOverlap;
pub use geometry::{Core, Disc, Segment};
pub use grid::{Crossing, Grid};
pub use optimal::d_optimal;
pub use planner::{Comparison, Plan, PlanError, PlanOptions, ShellSummary, plan};
pub use posture::Hindrance;
pub use progress::{Progress, Stage, Tell};
pub use quality::{Expectation, Quality, Unfit};
pub use rows::{BarAt, PlanRow, RowKind, RowMargins};
pub use scene::Scene;
pub use swing::Swing;
pub use transfer::way_between;
