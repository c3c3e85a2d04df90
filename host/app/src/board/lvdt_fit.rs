//! The LVDT's curve from lengths that are known.

use ballbar::{LVDT_COEFFICIENTS, LvdtCurve};
use miette::Diagnostic;
use nalgebra::{DMatrix, DVector};
use thiserror::Error;

use super::verify::larger;

/// A length that was set, as a displacement from mid travel, and the code that was read there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LvdtPoint {
    /// Known displacement, metres.
    pub displacement_m: f64,
    /// Mean code.
    pub code: f64,
}

/// Why no curve was found.
#[derive(Clone, Debug, PartialEq, Error, Diagnostic)]
pub enum LvdtFitError {
    /// Fewer points than the polynomial needs to be checked by at least one.
    #[error("{found} lengths, but a polynomial of degree {degree} needs at least {needed}")]
    #[diagnostic(help("Measure more lengths, or ask for a lower --degree."))]
    TooFew {
        /// Points.
        found: usize,
        /// Degree asked for.
        degree: usize,
        /// Points needed: one more than coefficients.
        needed: usize,
    },
    /// Two lengths gave the same code, or all lie together.
    #[error("the codes of the lengths do not lie apart: from {min:.1} to {max:.1}")]
    #[diagnostic(help("Did the bar move between the lengths, and is the LVDT connected?"))]
    NoSpread {
        /// Lowest code.
        min: f64,
        /// Highest code.
        max: f64,
    },
    /// The code does not rise or fall throughout.
    #[error("the fitted curve turns back within the codes measured")]
    #[diagnostic(help("Was every length set as it was asked for? A lower --degree is steadier."))]
    NotMonotonic,
}

/// Codes between the highest and the lowest that a curve must be measured over.
const LEAST_SPREAD: f64 = 256.0;
/// The curve may be used a little beyond the codes that it was measured at, as a part of their spread.
const MARGIN: f64 = 0.01;

/// A curve, and how well it fits: only [`fit_lvdt`] makes one.
#[derive(Clone, Debug, PartialEq)]
pub struct LvdtFit {
    curve: LvdtCurve,
    residuals_m: Vec<f64>,
}

impl LvdtFit {
    /// The curve, rounded to the board's f32.
    pub fn curve(&self) -> &LvdtCurve {
        &self.curve
    }

    /// Known displacements less those of this curve, metres; not a number where a code lies beyond the curve.
    pub fn residuals_m(&self) -> &[f64] {
        &self.residuals_m
    }

    /// RMS residual, metres.
    pub fn rms_m(&self) -> f64 {
        let squares: f64 = self.residuals_m.iter().map(|m| m * m).sum();
        (squares / self.residuals_m.len() as f64).sqrt()
    }

    /// Largest residual, without its sign, metres; infinite where one is not a number.
    pub fn largest_m(&self) -> f64 {
        self.residuals_m.iter().fold(0.0, |max, m| larger(max, m.abs()))
    }

    /// Whether every residual is a number and none is larger.
    pub fn is_within(&self, tolerance_m: f64) -> bool {
        self.residuals_m.iter().all(|m| m.abs() <= tolerance_m)
    }
}

/// Fits a polynomial of `degree` by least squares.
///
/// # Errors
/// [`LvdtFitError`].
pub fn fit_lvdt(points: &[LvdtPoint], degree: usize) -> Result<LvdtFit, LvdtFitError> {
    check_lvdt_points(points.len(), degree)?;
    let terms = degree.min(LVDT_COEFFICIENTS - 1) + 1;
    let codes = points.iter().map(|point| point.code);
    let (min, max) = codes.clone().fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), code| (min.min(code), max.max(code)));
    let spread = max - min;
    if spread.is_nan() || spread < LEAST_SPREAD {
        return Err(LvdtFitError::NoSpread { min, max });
    }
    let u: Vec<f64> = codes.map(LvdtCurve::normalised).collect();
    let powers = DMatrix::from_fn(points.len(), terms, |row, power| u[row].powi(power as i32));
    let displacements = DVector::from_iterator(points.len(), points.iter().map(|point| point.displacement_m));
    let qr = powers.qr();
    let solution = qr.r().solve_upper_triangular(&(qr.q().transpose() * displacements));
    let solution = solution.ok_or(LvdtFitError::NoSpread { min, max })?;
    let mut coefficients_m = [0.0; LVDT_COEFFICIENTS];
    for (coefficient, &fitted) in coefficients_m.iter_mut().zip(solution.iter()) {
        *coefficient = fitted as f32;
    }
    let to_code = |code: f64| code.round().clamp(0.0, 65_535.0) as u16;
    let margin = MARGIN * spread;
    let curve = LvdtCurve { code_min: to_code(min - margin), code_max: to_code(max + margin), coefficients_m };
    if !is_monotonic(&curve) {
        return Err(LvdtFitError::NotMonotonic);
    }
    let at = |code: f64| curve.displacement_of_code_m::<f64>(code).unwrap_or(f64::NAN);
    let residuals_m = points.iter().map(|point| point.displacement_m - at(point.code)).collect();
    Ok(LvdtFit { curve, residuals_m })
}

/// Whether so many lengths are enough for a polynomial of `degree`; asked before any of them is measured.
///
/// # Errors
/// [`LvdtFitError::TooFew`].
pub fn check_lvdt_points(found: usize, degree: usize) -> Result<(), LvdtFitError> {
    let needed = degree.min(LVDT_COEFFICIENTS - 1) + 2;
    if found < needed { Err(LvdtFitError::TooFew { found, degree, needed }) } else { Ok(()) }
}

fn is_monotonic(curve: &LvdtCurve) -> bool {
    const STEPS: usize = 256;
    let (first, last) = (f64::from(curve.code_min), f64::from(curve.code_max));
    let at = |i: usize| curve.displacement_of_code_m::<f64>(first + (last - first) * i as f64 / STEPS as f64).unwrap_or(f64::NAN);
    let steps: Vec<f64> = (0..STEPS).map(|i| at(i + 1) - at(i)).collect();
    steps.iter().all(|&step| step > 0.0) || steps.iter().all(|&step| step < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(curve: impl Fn(f64) -> f64, count: usize) -> Vec<LvdtPoint> {
        let codes = (0..count).map(|i| 2_000.0 + 61_500.0 * i as f64 / (count - 1) as f64);
        codes.map(|code| LvdtPoint { displacement_m: curve(LvdtCurve::normalised(code)), code }).collect()
    }

    #[test]
    fn a_cubic_is_found_again_to_the_resolution_of_f32() {
        let cubic = |u: f64| 0.0003 + 0.0400 * u - 0.0002 * u * u + 0.0015 * u.powi(3);
        let LvdtFit { curve, residuals_m: residuals } = fit_lvdt(&points(cubic, 9), 3).unwrap();
        assert!(residuals.iter().all(|residual| residual.abs() < 5e-9), "{residuals:?}");
        for (found, expected) in curve.coefficients_m.iter().zip([0.0003, 0.04, -0.0002, 0.0015, 0.0, 0.0]) {
            assert!((found - expected).abs() < 1e-8, "{found} {expected}");
        }
        assert_eq!((curve.code_min, curve.code_max), (1_385, 64_115));
    }

    #[test]
    fn one_wrong_length_shows_in_the_residuals() {
        let mut measured = points(|u| 0.04 * u, 7);
        measured[3].displacement_m += 0.001;
        let residuals = fit_lvdt(&measured, 1).unwrap().residuals_m;
        assert!(residuals[3] > 0.0008 && residuals.iter().enumerate().all(|(i, r)| i == 3 || r.abs() < 0.0002));
    }

    #[test]
    fn a_length_whose_code_the_curve_does_not_reach_is_within_no_tolerance() {
        let mut measured = points(|u| 0.04 * u, 7);
        measured[6].code = 70_000.0;
        let fit = fit_lvdt(&measured, 1).unwrap();
        assert!(fit.residuals_m[6].is_nan());
        assert_eq!(fit.largest_m(), f64::INFINITY);
        assert!(!fit.is_within(1.0) && !fit.is_within(f64::INFINITY));
    }

    #[test]
    fn what_makes_no_curve_is_refused() {
        assert!(matches!(fit_lvdt(&points(|u| u, 4), 3), Err(LvdtFitError::TooFew { needed: 5, .. })));
        let same = [LvdtPoint { displacement_m: 0.0, code: 30_000.0 }; 5];
        assert!(matches!(fit_lvdt(&same, 1), Err(LvdtFitError::NoSpread { .. })));
        assert!(matches!(fit_lvdt(&points(|u| u * u, 9), 2), Err(LvdtFitError::NotMonotonic)));
    }
}
