//! How much lengths deviate.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::uncertainty::Uncertainty;
use crate::model::Dataset;

/// As good ball-bars have it, metres.
const USUAL_M: f64 = 5e-5;
/// One in a thousand sets of lengths that deviate as they are said to looks so.
const SURELY_NOT: f64 = 1e-3;

/// As it is stated, or as good ball-bars have it, metres.
pub(super) fn believed_sigma_m(dataset: &Dataset) -> f64 {
    dataset.stated_sigma_m().unwrap_or(USUAL_M)
}

/// What residuals say of a stated deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NoiseTest {
    /// `Σ f²/σ²`.
    pub chi2: f64,
    /// Degrees of freedom: lengths less the unknowns that they have decided.
    pub freedom: f64,
    /// Probability that lengths which deviate as stated leave more.
    pub p_more: f64,
}

impl NoiseTest {
    /// Of the deviation seen beside the one that is stated; `None` where there is too little to see.
    pub fn new(seen_m: f64, stated_m: f64, freedom: f64) -> Option<Self> {
        let chi2 = freedom * (seen_m / stated_m).powi(2);
        let p_more = ChiSquared::new(freedom).ok()?.sf(chi2);
        Some(Self { chi2, freedom, p_more })
    }

    /// Whether lengths deviate by more than is stated.
    pub fn is_more(&self) -> bool {
        self.p_more < SURELY_NOT / 2.0
    }

    /// Whether they deviate by less.
    pub fn is_less(&self) -> bool {
        self.p_more > 1.0 - SURELY_NOT / 2.0
    }
}

impl Uncertainty {
    /// What the residuals say of a stated deviation (metres); `None` where they say nothing.
    pub fn noise_test(&self, stated_m: f64) -> Option<NoiseTest> {
        NoiseTest::new(self.sigma_m?, stated_m, self.freedom)
    }

    /// The deviation seen, where it is surely more than what is stated.
    pub(super) fn beyond_stated_m(&self, stated_m: Option<f64>) -> Option<f64> {
        self.sigma_m.filter(|_| stated_m.and_then(|stated_m| self.noise_test(stated_m)).is_some_and(|test| test.is_more()))
    }
}
