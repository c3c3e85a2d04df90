//! Rigid transforms, and the angles by which files write their rotations.

use ballbar::{Matrix3, Pose, Vector3};
use nalgebra::Rotation3;

/// `a_from_c` of `a_from_b` and `b_from_c`.
pub fn compose(a_from_b: &Pose<f64>, b_from_c: &Pose<f64>) -> Pose<f64> {
    Pose {
        rotation: a_from_b.rotation * b_from_c.rotation,
        translation_m: a_from_b.rotation * b_from_c.translation_m + a_from_b.translation_m,
    }
}

/// `b_from_a` of `a_from_b`.
pub fn inverse(a_from_b: &Pose<f64>) -> Pose<f64> {
    Pose { rotation: a_from_b.rotation.transpose(), translation_m: -a_from_b.rotation.tr_mul(&a_from_b.translation_m) }
}

/// A link's transform `Trans(x, y, z) · Rz(alpha) · Ry(beta) · Rx(gamma)`; metres, and alpha, beta, gamma in radians.
pub fn from_link(translation_m: Vector3<f64>, [alpha, beta, gamma]: [f64; 3]) -> Pose<f64> {
    Pose { rotation: Rotation3::from_euler_angles(gamma, beta, alpha).into_inner(), translation_m }
}

/// The angles alpha, beta, gamma of a rotation `Rz(alpha) · Ry(beta) · Rx(gamma)`, radians, beta within ±π/2.
///
/// Where beta is a right angle only alpha ± gamma is told. Whatever rounding makes of alpha there, beta and gamma are taken from what
/// it leaves, so that the three always give the rotation back.
pub fn link_angles(rotation: &Matrix3<f64>) -> [f64; 3] {
    link_angles_about(rotation, rotation[(1, 0)].atan2(rotation[(0, 0)]))
}

/// The angles of a rotation whose alpha is known, half a turn from [`link_angles`]' or not: beta is then beyond a right angle.
pub(super) fn link_angles_about(rotation: &Matrix3<f64>, alpha: f64) -> [f64; 3] {
    let (sin, cos) = alpha.sin_cos();
    let beta = (-rotation[(2, 0)]).atan2(cos * rotation[(0, 0)] + sin * rotation[(1, 0)]);
    let row = |column: usize| cos * rotation[(1, column)] - sin * rotation[(0, column)];
    [alpha, beta, (-row(2)).atan2(row(1))]
}

/// How far two poses are apart: metres between their origins, radians of the turn between them.
pub fn apart(a: &Pose<f64>, b: &Pose<f64>) -> (f64, f64) {
    let turn = Rotation3::from_matrix_unchecked(a.rotation.tr_mul(&b.rotation)).into_inner();
    let skew = Vector3::new(turn[(2, 1)] - turn[(1, 2)], turn[(0, 2)] - turn[(2, 0)], turn[(1, 0)] - turn[(0, 1)]) / 2.0;
    ((a.translation_m - b.translation_m).norm(), skew.norm().atan2((turn.trace() - 1.0) / 2.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn angles_give_their_rotation_back_also_where_beta_is_a_right_angle() {
        for beta in [0.0, 0.4, -1.2, FRAC_PI_2, -FRAC_PI_2, FRAC_PI_2 - 1e-9, 1e-12 - FRAC_PI_2] {
            for (alpha, gamma) in [(0.0, 0.0), (0.7, -2.1), (-3.1, 1.9), (2.0, FRAC_PI_2)] {
                let rotation = from_link(Vector3::zeros(), [alpha, beta, gamma]).rotation;
                let again = from_link(Vector3::zeros(), link_angles(&rotation)).rotation;
                assert!((rotation - again).norm() < 1e-14, "{alpha} {beta} {gamma}");
            }
        }
    }

    #[test]
    fn a_pose_and_its_inverse_are_nothing() {
        let pose = from_link(Vector3::new(1.0, -2.0, 0.5), [0.3, -0.8, 2.0]);
        let nothing = compose(&pose, &inverse(&pose));
        let (off_m, turned_rad) = apart(&nothing, &from_link(Vector3::zeros(), [0.0; 3]));
        assert!(off_m < 1e-15 && turned_rad < 1e-15);
        assert!((apart(&pose, &from_link(pose.translation_m, [0.31, -0.8, 2.0])).1 - 0.01).abs() < 1e-12);
    }
}
