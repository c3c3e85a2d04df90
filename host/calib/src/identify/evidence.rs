//! How much the tolerances inside an arm are to be trusted, by what the lengths say of them all together.

use nalgebra::{DMatrix, DVector};

/// Free unknowns, linear about some values: what lengths say of their change from the start.
pub(super) struct Linear {
    /// `√w J`, or its triangle; metres per SI unit.
    pub(super) jacobian: DMatrix<f64>,
    /// Residuals at the start, as the linear model has them, seen from the rows of `jacobian`.
    pub(super) residual_m: DVector<f64>,
    /// Lengths.
    pub(super) count: usize,
}

/// The factor of tolerances, and the deviation of a length, under which the lengths are likeliest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Likeliest {
    pub(super) factor: f64,
    pub(super) sigma_m: f64,
}

/// The common factor lies within a tenth of what is stated and three times as much.
const FACTORS: (f64, f64) = (0.1, 3.0);
/// Steps over that range before the best one is refined.
const COARSE: usize = 7;
/// A nanometre: below it, residuals are the rounding of a file's digits.
const LEAST_SIGMA_M: f64 = 1e-9;

/// Maximises the evidence `p(lengths | factor, σ)`, the parameters integrated out (D. J. C. MacKay, "Bayesian interpolation", Neural Computation
/// 4(3), 1992), over both, or over the factor alone where σ is known. `precision` gives `Λ` for a factor.
pub(super) fn likeliest(linear: &Linear, precision: impl Fn(f64) -> DMatrix<f64>, known_m: Option<f64>) -> Option<Likeliest> {
    let at = |log_factor: f64| Rotated::new(linear, &precision(log_factor.exp()))?.likeliest_sigma(known_m);
    let (low, high) = (FACTORS.0.ln(), FACTORS.1.ln());
    let step = (high - low) / (COARSE - 1) as f64;
    let coarse = (0..COARSE).map(|i| low + step * i as f64);
    let (best, _) = coarse.filter_map(|log| Some((log, at(log)?.1))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let cost = |log: f64| at(log).map_or(f64::INFINITY, |(_, evidence)| -evidence);
    let log_factor = golden_section(cost, (best - step).max(low), (best + step).min(high), 0.02);
    Some(Likeliest { factor: log_factor.exp(), sigma_m: at(log_factor)?.0 })
}

/// The linear model in coordinates in which the prior is the identity and the lengths' information is diagonal.
struct Rotated {
    /// Information of each direction, square metres.
    information: DVector<f64>,
    /// Squared pull of the lengths along each, metres⁴.
    pull2: DVector<f64>,
    square_m2: f64,
    count: usize,
}

impl Rotated {
    fn new(linear: &Linear, precision: &DMatrix<f64>) -> Option<Self> {
        if precision.is_empty() {
            return None;
        }
        let root = precision.clone().cholesky()?;
        // L⁻¹ JᵀJ L⁻ᵀ for Λ = L Lᵀ.
        let whitened = root.l().solve_lower_triangular(&linear.jacobian.transpose())?;
        let eigen = (&whitened * whitened.transpose()).symmetric_eigen();
        let pull = eigen.eigenvectors.transpose() * (whitened * &linear.residual_m);
        Some(Self {
            information: eigen.eigenvalues.map(|value| value.max(0.0)),
            pull2: pull.map(|value| value * value),
            square_m2: linear.residual_m.norm_squared(),
            count: linear.count,
        })
    }

    /// σ and the logarithm of the evidence there.
    fn likeliest_sigma(&self, known_m: Option<f64>) -> Option<(f64, f64)> {
        let sigma_m = known_m.unwrap_or_else(|| {
            let highest_m = (self.square_m2 / self.count.max(1) as f64).sqrt().max(10.0 * LEAST_SIGMA_M);
            golden_section(|log| -self.evidence(log.exp()), LEAST_SIGMA_M.ln(), highest_m.ln(), 1e-3).exp()
        });
        let evidence = self.evidence(sigma_m);
        evidence.is_finite().then_some((sigma_m, evidence))
    }

    /// `ln p`, but for a constant.
    fn evidence(&self, sigma_m: f64) -> f64 {
        let variance = sigma_m * sigma_m;
        let (mut spread, mut explained) = (self.count as f64 * variance.ln(), 0.0);
        for (information, pull2) in self.information.iter().zip(self.pull2.iter()) {
            spread += (information / variance).ln_1p();
            explained += pull2 / (information + variance);
        }
        -0.5 * (spread + (self.square_m2 - explained).max(0.0) / variance)
    }
}

/// Where a function of one argument that falls and then rises is smallest, to within `width`.
pub(super) fn golden_section(cost: impl Fn(f64) -> f64, mut low: f64, mut high: f64, width: f64) -> f64 {
    const RATIO: f64 = 0.618_033_988_749_894_9;
    let inner = |low: f64, high: f64| (high - RATIO * (high - low), low + RATIO * (high - low));
    let (mut left, mut right) = inner(low, high);
    let (mut at_left, mut at_right) = (cost(left), cost(right));
    while high - low > width {
        if at_left <= at_right {
            (high, right, at_right) = (right, left, at_left);
            left = inner(low, high).0;
            at_left = cost(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = inner(low, high).1;
            at_right = cost(right);
        }
    }
    f64::midpoint(low, high)
}
