//! A calibration as one page for people: is this robot calibrated, how good is it, how do we know.
//!
//! ```text
//! Robot, Rig, Dataset, Fit ─▶ Facts ─▶ figures::all (SVG, data) ─▶ page::html
//! ```
//!
//! [`Facts`] computes and draws nothing; a figure draws and computes nothing but its scales.

mod facts;
mod figures;
mod page;
mod workspace;

pub use facts::{Correlation, Facts, Inputs, Proof, RowFact, Singular};
pub use figures::{Figure, FigureError, Table, all as figures};
pub use page::html;
pub use workspace::{Slice, Workspace, WorkspacePoint};
