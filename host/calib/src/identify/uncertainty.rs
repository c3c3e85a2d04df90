//! Standard deviations of the fitted parameters.

use nalgebra::DMatrix;

use super::observation::Observation;
use super::spectrum::Spectrum;

/// The linear theory at the solution: `cov = σ² (JᵀWJ + σ²Λ)⁻¹`, where `Λ` is what is believed beforehand, zero for plain least squares.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Uncertainty {
    /// One an unknown that moves, in their order, SI: `None` where the data leave the parameter undetermined.
    pub std: Vec<Option<f64>>,
    /// Standard deviation of a length of weight 1 as the residuals show it, `√(Σ w f² / freedom)`, metres; `None` without redundancy.
    pub sigma_m: Option<f64>,
    /// Standard deviation of a length of weight 1 that deviations are made of, metres: what is stated, where beliefs count beside lengths that
    /// deviate no more, else what is seen.
    pub noise_m: Option<f64>,
    /// How many unknowns the lengths have decided: all that are free (or the rank of their columns) but for what beliefs had decided before.
    pub told: f64,
    /// Lengths less those: degrees of freedom that are left to the residuals.
    pub freedom: f64,
    /// Singular values of the f free columns, scaled, beliefs included.
    pub spectrum: Spectrum,
    /// Covariance of the unknowns that move, m × m in their order, SI units; only its entries between determined parameters mean anything.
    pub covariance: DMatrix<f64>,
}

/// A parameter with more than this part of its direction in the null space is undetermined.
const NULL_SHARE: f64 = 1e-10;

impl Uncertainty {
    /// By the columns at the indices `free` of an observation at the solution; σ is what the residuals show.
    pub fn new(observation: &Observation, free: &[usize]) -> Self {
        Self::with_noise(observation, free, |seen_m, _| seen_m)
    }

    /// The same with σ (metres) by what the residuals show, where they show anything, and their degrees of freedom.
    pub(super) fn with_noise(
        observation: &Observation,
        free: &[usize],
        noise_m: impl FnOnce(Option<f64>, f64) -> Option<f64>,
    ) -> Self {
        let spectrum = Spectrum::of_columns(&observation.jacobian, free);
        // (JᵀJ)⁺ = V S⁻² Vᵀ over the directions that count, with the column scales put back.
        let counting = spectrum.right.columns(0, spectrum.rank);
        let mut root = counting.into_owned();
        for (mut column, value) in root.column_iter_mut().zip(&spectrum.singular_values) {
            column /= *value;
        }
        for (mut line, scale) in root.row_iter_mut().zip(&spectrum.scales) {
            line /= *scale;
        }
        let believed = (observation.beliefs.select_columns(free) * &root).norm_squared();
        let told = (spectrum.rank as f64 - believed).max(0.0);
        let freedom = (observation.count as f64 - told).max(0.0);
        // Less than half a degree is the rounding of none.
        let sigma_m = (freedom > 0.5).then(|| (observation.square_m2 / freedom).sqrt());
        let noise_m = noise_m(sigma_m, freedom);
        root *= noise_m.unwrap_or(f64::NAN);
        let covariance = &root * root.transpose();
        let null = spectrum.right.columns(spectrum.rank, free.len() - spectrum.rank);
        let is_told = |i: usize| null.row(i).norm_squared() < NULL_SHARE && noise_m.is_some();
        let std = (0..free.len()).map(|i| is_told(i).then(|| covariance[(i, i)].sqrt())).collect();
        Self { std, sigma_m, noise_m, told, freedom, spectrum, covariance }
    }
}
