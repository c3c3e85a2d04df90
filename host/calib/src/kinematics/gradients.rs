//! Gradients by a chain's parameters, as long as the chain has parameters.

use ballbar::{JointVector, Kinematics, MAX_PARAMETERS, Pairing, Quantity, Vector3};
use nalgebra::Matrix3xX;

/// What `of` makes of the bar's length between two ends, metres, and of its gradient, metres per metre, radian or one.
pub fn with_length_gradient<T>(
    kinematics: &Kinematics<f64>,
    q: &JointVector<f64>,
    pairing: &Pairing<f64>,
    of: impl FnOnce(f64, &[f64]) -> T,
) -> T {
    let mut row = [0.0; MAX_PARAMETERS];
    let length_m = kinematics.gradient(Quantity::Length, q, pairing, &mut row).value_m;
    of(length_m, &row[..kinematics.parameter_count()])
}

/// Position in the base frame of a point of the tool, metres, and its Jacobian, 3 × P for P parameters: metres per metre, radian or one.
pub fn position_jacobian(
    kinematics: &Kinematics<f64>,
    q: &JointVector<f64>,
    point_tool_m: &Vector3<f64>,
) -> (Vector3<f64>, Matrix3xX<f64>) {
    let mut rows = [[0.0; MAX_PARAMETERS]; 3];
    let position_m = kinematics.position_gradient(q, point_tool_m, &mut rows);
    (position_m, Matrix3xX::from_fn(kinematics.parameter_count(), |axis, parameter| rows[axis][parameter]))
}
