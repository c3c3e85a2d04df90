//! The paper's estimate of the tool's position error from the ball-bar's: a Stewart platform of six bars.

use std::f64::consts::{FRAC_PI_3, TAU};

use ballbar::Vector3;
use nalgebra::{Matrix6, RowVector6};

/// Six bars between a base triangle of chucks and a plate of spheres above it, turned by 60°, each chuck to its two nearest
/// spheres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StewartPlatform {
    /// Side of the base's equilateral triangle, metres.
    pub base_side_m: f64,
    /// Side of the plate's, metres.
    pub plate_side_m: f64,
    /// Length of all bars, metres.
    pub bar_m: f64,
}

/// RMS position error of the plate's centre per RMS error of independent bar lengths; `None` where the bars do not reach or
/// leave the plate loose.
///
/// The leg Jacobian A has a row `(u, r × u)` for each bar, u along the bar and r from the plate's centre to its sphere, so
/// that `δlengths = A (δposition, δrotation)`; the position block of `(AᵀA)⁻¹` is the covariance for unit errors.
pub fn amplification(platform: &StewartPlatform) -> Option<f64> {
    let corner = |side_m: f64, angle: f64| side_m / 3.0_f64.sqrt() * Vector3::new(angle.cos(), angle.sin(), 0.0);
    let horizontal_m = (corner(platform.plate_side_m, FRAC_PI_3) - corner(platform.base_side_m, 0.0)).norm();
    if platform.bar_m <= horizontal_m {
        return None;
    }
    let height_m = (platform.bar_m.powi(2) - horizontal_m.powi(2)).sqrt();
    let mut legs = Matrix6::zeros();
    for chuck in 0..3 {
        let angle = TAU / 3.0 * f64::from(chuck);
        for (k, side) in [-FRAC_PI_3, FRAC_PI_3].into_iter().enumerate() {
            let sphere_from_centre = corner(platform.plate_side_m, angle + side);
            let bar = sphere_from_centre + Vector3::z() * height_m - corner(platform.base_side_m, angle);
            let along = bar.normalize();
            let moment = sphere_from_centre.cross(&along);
            let row = RowVector6::new(along.x, along.y, along.z, moment.x, moment.y, moment.z);
            legs.set_row(2 * chuck as usize + k, &row);
        }
    }
    let covariance = (legs.transpose() * legs).try_inverse()?;
    Some((0..3).map(|axis| covariance[(axis, axis)]).sum::<f64>().sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_platform_amplifies_nearly_four_times() {
        let platform = StewartPlatform { base_side_m: 0.2, plate_side_m: 0.1, bar_m: 0.46 };
        let factor = amplification(&platform).unwrap();
        assert!((factor - 3.8).abs() < 0.05, "{factor}");
    }

    #[test]
    fn bars_that_do_not_reach_have_no_answer() {
        assert_eq!(amplification(&StewartPlatform { base_side_m: 2.0, plate_side_m: 0.1, bar_m: 0.46 }), None);
    }
}
