//! From measured lengths to parameters.
//!
//! ```text
//! Dataset ─▶ Observation (J, f at the start) ─▶ Identifiability (rank, independent subset, reasons)
//!                                                     │ Hold
//!                                                     ▼
//!                                    FreeParameters ─▶ lm::solve ─▶ Fit (deviations, residuals, outliers, held-out RMS)
//! ```
//!
//! `docs/identification.md` says how each decision is made and why.

mod advice;
mod fit;
mod fit_remarks;
mod hold;
mod identifiability;
mod lm;
mod normality;
mod observation;
mod offsets;
mod pivoting;
mod postures;
mod residual;
mod residuals;
mod spectrum;
mod trend;
mod uncertainty;

pub use advice::{bound_by_ends, bound_by_pairings, remarks};
pub use fit::{CrossValidation, Fit, FitError, FitOptions, FittedParameter, fit};
pub use fit_remarks::FitRemark;
pub use hold::{Held, Hold, HoldRule};
pub use identifiability::{Finding, Identifiability, plausible_error};
pub use lm::{ConvergenceTest, LmOptions, Solution, Status, solve};
pub use normality::{AndersonDarling, anderson_darling};
pub use observation::Observation;
pub use offsets::{Offset, farthest_offset};
pub use postures::postures;
pub(crate) use residual::median;
pub use residual::{Residual, ResidualSummary};
pub use residuals::{
    ALIKE, Outlier, OutlierTest, PairingResiduals, by_pairing, neighbour_correlation, outliers, residuals, residuals_by,
};
pub use spectrum::{RANK_THRESHOLD, Spectrum};
pub use trend::Trend;
pub use uncertainty::Uncertainty;
