//! Standard deviations of the fitted parameters.

use nalgebra::DMatrix;

use super::observation::Observation;
use super::spectrum::Spectrum;

/// The linear theory at the solution: `cov = s² (JᵀWJ)⁻¹`, `s² = Σ w f² / (n − r)`, for n lengths (beliefs included), f free unknowns and rank r.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Uncertainty {
    /// One an unknown that moves, in their order, SI: `None` where the data leave the parameter undetermined.
    pub std: Vec<Option<f64>>,
    /// Estimated standard deviation s of a length of weight 1, metres; `None` without redundancy.
    pub sigma_m: Option<f64>,
    /// Singular values of the f free columns, scaled.
    pub spectrum: Spectrum,
    /// Covariance of the unknowns that move, m × m in their order, SI units; only its entries between determined parameters mean anything.
    pub covariance: DMatrix<f64>,
}

/// A parameter with more than this part of its direction in the null space is undetermined.
const NULL_SHARE: f64 = 1e-10;

impl Uncertainty {
    /// By the columns at the indices `free` of an observation at the solution.
    pub fn new(observation: &Observation, free: &[usize]) -> Self {
        let spectrum = Spectrum::of_columns(&observation.jacobian, free);
        let freedom = observation.count.saturating_sub(spectrum.rank);
        let sigma_m = (freedom > 0).then(|| (observation.residual_m.norm_squared() / freedom as f64).sqrt());

        // (JᵀJ)⁺ = V S⁻² Vᵀ over the directions that count, with the column scales put back.
        let counting = spectrum.right.columns(0, spectrum.rank);
        let mut root = counting.into_owned();
        for (mut column, value) in root.column_iter_mut().zip(&spectrum.singular_values) {
            column /= *value;
        }
        for (mut line, scale) in root.row_iter_mut().zip(&spectrum.scales) {
            line *= sigma_m.unwrap_or(f64::NAN) / scale;
        }
        let covariance = &root * root.transpose();
        let null = spectrum.right.columns(spectrum.rank, free.len() - spectrum.rank);
        let std = (0..free.len())
            .map(|i| (null.row(i).norm_squared() < NULL_SHARE && sigma_m.is_some()).then(|| covariance[(i, i)].sqrt()))
            .collect();
        Self { std, sigma_m, spectrum, covariance }
    }
}
