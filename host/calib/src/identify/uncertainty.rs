//! Standard deviations of the fitted parameters.

use nalgebra::DMatrix;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use super::observation::Observation;
use super::residual::median;
use super::shared_errors::{Found, SharedErrors};
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
    /// Errors that lengths of one configuration share: `None` where no configuration has two lengths, or these show none. Deviations and covariance
    /// count them; the values are those of independent lengths.
    pub shared: Option<SharedErrors>,
    /// Degrees of freedom with which deviations are known: few where few lengths had to show how much they scatter. `None` where that is stated.
    pub deviations_known: Option<f64>,
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
        Self::with_noise(observation, free, None)
    }

    /// The same with σ (metres) as it is stated, or else by what the residuals show, where they show anything.
    pub(super) fn with_noise(observation: &Observation, free: &[usize], stated_m: Option<f64>) -> Self {
        let spectrum = Spectrum::of_columns(&observation.jacobian, free);
        let mut root = inverse_root(&spectrum);
        let believed = (observation.beliefs.select_columns(free) * &root).norm_squared();
        let told = (spectrum.rank as f64 - believed).max(0.0);
        let freedom = (observation.count as f64 - told).max(0.0);
        // Less than half a degree is the rounding of none.
        let sigma_m = (freedom > 0.5).then(|| (observation.square_m2 / freedom).sqrt());
        let noise_m = stated_m.or(sigma_m);
        root *= noise_m.unwrap_or(f64::NAN);
        let covariance = &root * root.transpose();
        let null = spectrum.right.columns(spectrum.rank, free.len() - spectrum.rank);
        let is_told = |i: usize| null.row(i).norm_squared() < NULL_SHARE && noise_m.is_some();
        let std = (0..free.len()).map(|i| is_told(i).then(|| covariance[(i, i)].sqrt())).collect();
        let deviations_known = stated_m.is_none().then_some(freedom);
        Self { std, sigma_m, noise_m, told, freedom, shared: None, deviations_known, spectrum, covariance }
    }

    /// The same with errors that lengths of one configuration share: `H⁻¹ (Jᵀ V J + σ⁴Λ) H⁻¹`, `H = JᵀWJ + σ²Λ`.
    pub(super) fn with_shared_errors(self, found: Found) -> Self {
        let root = inverse_root(&self.spectrum);
        let covariance = &root * found.covariance * root.transpose();
        let of_shared = &root * found.of_shared * root.transpose();
        let told: Vec<usize> = (0..self.std.len()).filter(|&i| self.std[i].is_some_and(|std| std > 0.0)).collect();
        let mut std = self.std;
        let middle = |of: &dyn Fn(usize) -> f64| median(told.iter().map(|&i| of(i)).collect());
        let factor = middle(&|i| covariance[(i, i)].sqrt() / std[i].unwrap_or(f64::NAN));
        let share = middle(&|i| of_shared[(i, i)] / covariance[(i, i)]);
        // F. E. Satterthwaite, Biometrics Bulletin 2, 1946.
        let own = self.deviations_known.map_or(0.0, |freedom| (1.0 - share).powi(2) / freedom.max(1.0));
        let deviations_known = 1.0 / (own + share.powi(2) / found.errors.freedom);
        told.iter().for_each(|&i| std[i] = Some(covariance[(i, i)].max(0.0).sqrt()));
        let shared = Some(SharedErrors { factor, ..found.errors });
        Self { std, covariance, shared, deviations_known: Some(deviations_known), ..self }
    }

    /// How many deviations on either side of a value make an interval that holds the truth with this probability: Student's t with
    /// [`Uncertainty::deviations_known`].
    ///
    /// ```
    /// # use ballbar_calib::{designs, identify::{Observation, Uncertainty}, simulate::Shells};
    /// # let (design, rig) = (designs::puma560(), designs::triangles());
    /// # let pairings = rig.all_pairings();
    /// # let shells = Shells {
    /// #     planned_with: &design, truth: &design, rig: &rig, pairings: &pairings, bar_m: 0.46, per_pairing: 7, sigma_m: 50e-6, seed: 1,
    /// # };
    /// # let lengths: Vec<_> = shells.simulate(|| ())?.into_iter().map(|pose| pose.row.measurement).collect();
    /// // 63 lengths for eight parameters: 55 degrees of freedom are left.
    /// let free: Vec<usize> = (8..16).collect();
    /// let uncertainty = Uncertainty::new(&Observation::new(&design.chain, &lengths), &free);
    /// assert!((uncertainty.interval(0.95) - 2.004).abs() < 1e-3);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn interval(&self, coverage: f64) -> f64 {
        let upper = f64::midpoint(1.0, coverage);
        let students = self.deviations_known.and_then(|freedom| StudentsT::new(0.0, 1.0, freedom).ok());
        students.map_or_else(|| Normal::standard().inverse_cdf(upper), |students| students.inverse_cdf(upper))
    }
}

/// `R` with `R Rᵀ = (JᵀJ)⁺ = V S⁻² Vᵀ` over the directions that count, with the column scales put back.
pub(super) fn inverse_root(spectrum: &Spectrum) -> DMatrix<f64> {
    let counting = spectrum.right.columns(0, spectrum.rank);
    let mut root = counting.into_owned();
    for (mut column, value) in root.column_iter_mut().zip(&spectrum.singular_values) {
        column /= *value;
    }
    for (mut line, scale) in root.row_iter_mut().zip(&spectrum.scales) {
        line /= *scale;
    }
    root
}
