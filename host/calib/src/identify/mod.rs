//! From measured lengths to parameters.
//!
//! ```text
//! Dataset, Unknowns ─▶ Observation (J, f at the start) ─▶ Identifiability (rank, independent subset, reasons)
//! Tolerances ─▶ ChainPrior ──────────────┐                      │ Hold
//!                                        ▼                      ▼
//!               ┌─────────────▶ Estimator: Beliefs, Objective ─▶ lm::solve ─▶ evidence (factor, σ), released parts
//!  rows that do │                                                 │ Estimate
//!  not stand out│                                                 ▼
//!               └──────────────────── robust (studentised residuals of all rows)
//!                                                                 │ nothing changes any more
//!                                                                 ▼
//!                                  Fit (deviations, residuals, rows left out, proofs by rows left out in turn)
//!                                                                 │
//!                                                                 ▼
//!                                  scores (what was not fitted and would explain the residuals)
//! ```
//!
//! `docs/identification.md` says how each decision is made and why.

mod advice;
mod beliefs;
mod cross_validation;
mod estimate;
mod evidence;
mod fit;
mod fit_remarks;
mod fitting;
mod freedom;
mod groups;
mod hold;
mod identifiability;
mod in_user_frames;
mod lines;
mod lm;
mod noise;
mod normality;
mod observation;
mod offsets;
mod options;
mod paying_unknowns;
mod pivoting;
mod postures;
mod prior;
mod reference;
mod residual;
mod residuals;
mod robust;
mod scores;
mod shared_errors;
mod spectrum;
mod tail;
mod trend;
mod uncertainty;

pub use advice::{bound_by_ends, bound_by_pairings, remarks};
pub use ballbar::{ConvergenceTest, LmOptions, Status};
pub use cross_validation::CrossValidation;
pub use fit::{Fit, FittedParameter, PriorFacts, Released};
pub use fit_remarks::FitRemark;
pub use fitting::fit;
pub use groups::{Group, GroupKind, LeftOutGroup};
pub use hold::{Held, Hold, HoldRule};
pub use identifiability::{Finding, Identifiability};
pub use lm::{Solution, explanation, solve_lengths};
pub use noise::NoiseTest;
pub use normality::{AndersonDarling, anderson_darling};
pub use observation::Observation;
pub use offsets::{Offset, farthest_offset};
pub use options::{FitError, FitOptions, Loss, PriorRule};
pub use paying_unknowns::{PayingUnknowns, TriedKind, fit_paying_unknowns};
pub use postures::postures;
pub(crate) use postures::{FEWEST_POSTURES, mean_and_error};
pub use prior::Part;
pub(crate) use residual::median;
pub use residual::{Residual, ResidualSummary};
pub use residuals::{ALIKE, Outlier, OutlierTest, PairingResiduals, by_pairing, neighbour_correlation, outliers, residuals};
pub use robust::WrongRow;
pub use scores::{NoScore, ScoreEstimate, UnknownScore, UnknownScores, unknown_scores};
pub use shared_errors::SharedErrors;
pub use spectrum::{RANK_THRESHOLD, Spectrum};
pub use trend::Trend;
pub use uncertainty::Uncertainty;
