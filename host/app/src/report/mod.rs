//! A calibration as one page for people: is this robot calibrated, how good is it, how do we know.
//!
//! ```text
//! Robot, Rig, Dataset, Fit, Assessment ─▶ Facts ─┬───────────────────────────────┬─▶ page::html
//!                                                └─▶ figures::all (SVG, data) ───┘
//! ```
//!
//! [`Facts`] computes and draws nothing; a figure draws and computes nothing but its scales.

mod facts;
mod figures;
mod page;
mod tables;
mod workspace;

pub use facts::{Correlation, Facts, Inputs, RowFact, Shell, Singular};
pub use figures::{Drawing, Figure, FigureError, Table, all as figures};
pub use page::html;
pub use tables::parameters_table;
pub use workspace::{Slice, Workspace, WorkspacePoint};
