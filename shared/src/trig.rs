//! Sine and cosine in `f32`, by polynomials.
//!
//! `libm::sincosf` works in `f64` inside and costs some 2,100 instructions on a Cortex-M4F, whose FPU has `f32` only. A
//! calibrated pose needs six of these pairs a sample, so this is the difference between 13,600 and some 1,300 instructions.

use core::f32::consts::FRAC_2_PI;

/// 1.5·2²³: adding it to `|x| < 2²²` leaves `round(x)` in the low bits of the sum.
const ROUND_TO_INTEGER: f32 = 12_582_912.0;

/// π/2 in three parts (Cody and Waite, 1980). The first two have few enough bits that their products with a quadrant number
/// below 2¹³ are exact.
const HALF_PI_HIGH: f32 = 1.570_312_5;
const HALF_PI_MIDDLE: f32 = 4.837_513e-4;
const HALF_PI_LOW: f32 = 7.549_79e-8;

/// Beyond this many radians the three parts no longer suffice and `libm` takes over: 2¹³ quadrants.
const POLYNOMIAL_LIMIT_RAD: f32 = 12_800.0;

/// Sine and cosine of `x_rad`, in this order.
///
/// Maximum absolute error, measured against `f64` (see the tests, which assert these bounds): 8e-8 for `|x| ≤ 4π` (required:
/// 1.5e-7) and up to 12,800 rad; beyond, `libm::sincosf`. Not-a-number and infinities give not-a-number.
///
/// The polynomials are the minimax ones of Cephes' `sinf.c` and `cosf.c` (Moshier, 1989) on [−π/4, π/4].
#[inline]
pub fn sin_cos_f32(x_rad: f32) -> (f32, f32) {
    if !(-POLYNOMIAL_LIMIT_RAD..=POLYNOMIAL_LIMIT_RAD).contains(&x_rad) {
        return libm::sincosf(x_rad);
    }
    let shifted = x_rad * FRAC_2_PI + ROUND_TO_INTEGER;
    let quadrant = shifted.to_bits();
    let turns = shifted - ROUND_TO_INTEGER;
    let r = ((x_rad - turns * HALF_PI_HIGH) - turns * HALF_PI_MIDDLE) - turns * HALF_PI_LOW;

    let r2 = r * r;
    let sine = ((-1.951_529_6e-4 * r2 + 8.332_161e-3) * r2 - 1.666_665_5e-1) * r2 * r + r;
    let cosine = ((2.443_315_7e-5 * r2 - 1.388_731_6e-3) * r2 + 4.166_664_6e-2) * r2 * r2 - 0.5 * r2 + 1.0;

    let (sine, cosine) = if quadrant & 1 == 0 { (sine, cosine) } else { (cosine, -sine) };
    if quadrant & 2 == 0 { (sine, cosine) } else { (-sine, -cosine) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;

    fn worst_error(limit_rad: f64, samples: u32) -> f64 {
        (0..=samples)
            .map(|i| {
                let x = ((2.0 * f64::from(i) / f64::from(samples) - 1.0) * limit_rad) as f32;
                let (sine, cosine) = sin_cos_f32(x);
                let exact = f64::from(x);
                (f64::from(sine) - libm::sin(exact)).abs().max((f64::from(cosine) - libm::cos(exact)).abs())
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn error_stays_below_the_documented_bound_over_four_pi() {
        let worst = worst_error(4.0 * PI, 4_000_003);
        assert!(worst <= 8e-8, "worst error {worst:e}");
    }

    #[test]
    fn arguments_far_outside_are_reduced_as_well() {
        for limit_rad in [100.0, 1_000.0, 12_799.0, 20_000.0, 1e6, 1e9] {
            let worst = worst_error(limit_rad, 1_000_003);
            assert!(worst <= 8e-8, "worst error {worst:e} up to {limit_rad} rad");
        }
    }

    #[test]
    fn quadrant_boundaries_and_signs_are_exact_where_they_can_be() {
        assert_eq!(sin_cos_f32(0.0), (0.0, 1.0));
        for k in -64_i32..=64 {
            let x = (f64::from(k) * PI / 4.0) as f32;
            let (sine, cosine) = sin_cos_f32(x);
            assert!((f64::from(sine) - libm::sin(f64::from(x))).abs() <= 8e-8, "sine at {k} π/4");
            assert!((f64::from(cosine) - libm::cos(f64::from(x))).abs() <= 8e-8, "cosine at {k} π/4");
            let (negated_sine, same_cosine) = sin_cos_f32(-x);
            assert_eq!((negated_sine, same_cosine), (-sine, cosine), "symmetry at {k} π/4");
        }
    }

    #[test]
    fn the_parts_of_half_pi_add_up() {
        let sum = f64::from(HALF_PI_HIGH) + f64::from(HALF_PI_MIDDLE) + f64::from(HALF_PI_LOW);
        assert!((sum - PI / 2.0).abs() < 1e-14, "off by {:e}", sum - PI / 2.0);
    }

    #[test]
    fn numbers_that_are_none_stay_none() {
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let (sine, cosine) = sin_cos_f32(x);
            assert!(sine.is_nan() && cosine.is_nan());
        }
    }
}
