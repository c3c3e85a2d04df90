//! The simulated LVDT: its curve, and the code that it gives at a displacement.

use ballbar::LvdtCurve;

/// Codes at the two ends of the travel.
const CODE_MIN: u16 = 2_000;
const CODE_MAX: u16 = 63_500;
/// Share of the curve that is cubic: it bends by 0.4 % of the travel, as a plain LVDT does.
const CUBIC_SHARE: f64 = 0.01;
/// Newton steps: the curve is almost straight, so that each gains four digits and more.
const NEWTON_STEPS: usize = 4;

/// Curve of a slightly cubic LVDT with this travel from end to end, metres.
pub fn lvdt_curve(travel_m: f64) -> LvdtCurve {
    let end: f64 = LvdtCurve::normalised(f64::from(CODE_MAX));
    let scale_m = travel_m / 2.0 / (end * (1.0 - CUBIC_SHARE) + end.powi(3) * CUBIC_SHARE);
    let (linear_m, cubic_m) = (scale_m * (1.0 - CUBIC_SHARE), scale_m * CUBIC_SHARE);
    LvdtCurve { code_min: CODE_MIN, code_max: CODE_MAX, coefficients_m: [0.0, linear_m as f32, 0.0, cubic_m as f32, 0.0, 0.0] }
}

/// The code, with its fraction, at a displacement from mid travel in metres; `None` beyond the travel.
pub(super) fn code_at(curve: &LvdtCurve, displacement_m: f64) -> Option<f64> {
    let c = curve.coefficients_m.map(f64::from);
    let value = |u: f64| c.iter().rev().fold(0.0, |sum, c| sum * u + c);
    let slope = |u: f64| (1..c.len()).rev().fold(0.0, |sum, k| sum * u + c[k] * k as f64);
    let mut u = (displacement_m - c[0]) / c[1];
    for _ in 0..NEWTON_STEPS {
        u -= (value(u) - displacement_m) / slope(u);
    }
    let code = 32_768.0 * (1.0 + u);
    (f64::from(curve.code_min)..=f64::from(curve.code_max)).contains(&code).then_some(code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_travel_ends_at_the_end_codes() {
        let (low_m, high_m) = lvdt_curve(0.075).travel_m::<f64>();
        assert!((high_m - 0.0375).abs() < 1e-8, "{high_m}");
        assert!((low_m + 0.0375).abs() < 1e-4, "{low_m}");
    }

    #[test]
    fn a_code_leads_back_to_its_displacement() {
        let curve = lvdt_curve(0.075);
        for step in -37..=37 {
            let displacement_m = f64::from(step) * 1e-3;
            let code = code_at(&curve, displacement_m).unwrap();
            assert!((curve.displacement_of_code_m(code).unwrap() - displacement_m).abs() < 1e-12);
        }
        assert_eq!(code_at(&curve, 0.0376), None);
        assert_eq!(code_at(&curve, -0.0376), None);
    }
}
