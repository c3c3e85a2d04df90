//! Is a fit good? The one place that judges it, from facts alone.
//!
//! ```text
//! Evidence (robot, rig, poses, fit, unseen poses) ─┬─▶ proofs ──────▶ refusals ──▶ mistakes (what may be wrong with the data)
//!                                                  └─▶ order, by pairing ─▶ reservations
//!                                          Assessment { answer, reasons } ◀── all of it
//! ```
//!
//! `docs/identification.md` says what each answer takes and why.

mod assessment;
mod by_group;
mod causes;
mod evidence;
mod mistake;
mod order;
mod plausibility;
mod proof;
mod reach;
mod refusals;
mod reservations;
mod suspicion;

pub use assessment::{Answer, Assessment};
pub use by_group::{GroupProof, GroupProofs};
pub use causes::{AngleUnit, Cause, CauseKind, FittedRows, LengthUnit, RowsOf, causes};
pub use evidence::Evidence;
pub use mistake::Mistake;
pub use order::Order;
pub use plausibility::Change;
pub use proof::{Proof, ProofKind};
pub use refusals::{Refusal, RmsGround, RmsLimit};
pub use suspicion::Suspicion;
