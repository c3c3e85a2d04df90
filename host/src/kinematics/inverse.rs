//! Joint vectors by damped least-squares steps, for any chain.

use ballbar::{JointVector, Matrix3, Pose, Vector3};
use nalgebra::{Matrix6, Rotation3, Vector6};

use super::skeleton::Skeleton;

impl Skeleton {
    /// Joint vector that brings a point of the tool to `target_m`, by damped least-squares steps from `start`; `None` when they do
    /// not get there. Limits are not looked at.
    pub fn reach_point(
        &self,
        start: &JointVector<f64>,
        point_tool_m: &Vector3<f64>,
        target_m: &Vector3<f64>,
    ) -> Option<JointVector<f64>> {
        const STEPS: usize = 30;
        const TOLERANCE_M: f64 = 1e-9;
        const DAMPING: f64 = 1e-4;
        let mut q = *start;
        for _ in 0..STEPS {
            let posture = self.at(&q);
            let point_m = posture.point_in_base(point_tool_m);
            let error_m = target_m - point_m;
            if error_m.norm() < TOLERANCE_M {
                return Some(q);
            }
            let columns = posture.axes().iter().map(|axis| axis.point_column(&point_m));
            let gram = columns.clone().fold(Matrix3::identity() * DAMPING, |sum, column| sum + column * column.transpose());
            let pull = gram.cholesky()?.solve(&error_m);
            for (value, column) in q.as_array_mut().iter_mut().zip(columns) {
                *value += column.dot(&pull);
            }
        }
        None
    }

    /// Joint vector that brings the tool to a pose, as [`Skeleton::reach_point`]. The damping falls with the squared error
    /// (T. Sugihara, "Solvability-Unconcerned Inverse Kinematics by the Levenberg-Marquardt Method", IEEE Trans. Robotics 27(5), 2011),
    /// which gets through singularities on the way and converges quadratically at the end.
    pub fn reach_pose(&self, start: &JointVector<f64>, target: &Pose<f64>) -> Option<JointVector<f64>> {
        const STEPS: usize = 60;
        const TOLERANCE: f64 = 1e-11;
        /// A radian off weighs as much as this many metres off: about the reach of a wrist.
        const TURN_M: f64 = 0.3;
        const DAMPING_PER_SQUARE: f64 = 1e-2;
        const LEAST_DAMPING: f64 = 1e-14;
        /// The linear model holds no farther, in radians or metres of a joint.
        const LONGEST_STEP: f64 = 0.5;
        let mut q = *start;
        for _ in 0..STEPS {
            let posture = self.at(&q);
            let pose = &posture.base_from_tool;
            let off_m = target.translation_m - pose.translation_m;
            let turn = rotation_vector(&(target.rotation * pose.rotation.transpose()));
            let error = Vector6::new(off_m.x, off_m.y, off_m.z, turn.x * TURN_M, turn.y * TURN_M, turn.z * TURN_M);
            if error.norm() < TOLERANCE {
                return Some(q);
            }
            let columns = posture.axes().iter().map(|axis| {
                let (shift, turn) = (axis.point_column(&pose.translation_m), axis.turn_column() * TURN_M);
                Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
            });
            let damping = DAMPING_PER_SQUARE * error.norm_squared() + LEAST_DAMPING;
            let gram = columns.clone().fold(Matrix6::identity() * damping, |sum, column| sum + column * column.transpose());
            let pull = gram.cholesky()?.solve(&error);
            let step: heapless::Vec<f64, { ballbar::MAX_JOINTS }> = columns.map(|column| column.dot(&pull)).collect();
            let longest = step.iter().fold(0.0_f64, |longest, step| longest.max(step.abs()));
            let share = (LONGEST_STEP / longest).min(1.0);
            for (value, step) in q.as_array_mut().iter_mut().zip(&step) {
                *value += share * step;
            }
        }
        None
    }
}

/// Axis times angle of a turn, to rounding also where the angle is small: the cosine alone would lose half of its digits there.
fn rotation_vector(turn: &Matrix3<f64>) -> Vector3<f64> {
    const NO_SINE: f64 = 1e-6;
    let skew = Vector3::new(turn[(2, 1)] - turn[(1, 2)], turn[(0, 2)] - turn[(2, 0)], turn[(1, 0)] - turn[(0, 1)]) / 2.0;
    let (sine, cosine) = (skew.norm(), (turn.trace() - 1.0) / 2.0);
    match sine {
        sine if sine > NO_SINE => skew * (sine.atan2(cosine) / sine),
        _ if cosine > 0.0 => skew,
        _ => Rotation3::from_matrix_unchecked(*turn).scaled_axis(),
    }
}
