//! Joint vectors by damped least-squares steps, for any chain.

use ballbar::{JointVector, MAX_JOINTS, Matrix3, Pose, Vector3};
use nalgebra::{Matrix6, Rotation3, SMatrix, Vector6};

use super::skeleton::{Posture, Skeleton};

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
        let mut q = *start;
        for _ in 0..STEPS {
            let posture = self.at(&q);
            let error = error_towards(target, &posture.base_from_tool, TURN_M);
            if error.norm() < TOLERANCE {
                return Some(q);
            }
            let damped = Matrix6::identity() * damping(&error);
            let gram = columns(&posture, TURN_M).fold(damped, |sum, column| sum + column * column.transpose());
            let pull = gram.cholesky()?.solve(&error);
            add_step(&mut q, columns(&posture, TURN_M).map(|column| column.dot(&pull)));
        }
        None
    }

    /// Joint vector that brings the tool to the position of a pose and as near to its orientation as the joints can, by steps from
    /// `start`, for arms of too few joints to do both; `None` when they do not get to the position. Limits are not looked at.
    pub fn approach_pose(&self, start: &JointVector<f64>, target: &Pose<f64>) -> Option<JointVector<f64>> {
        const STEPS: usize = 200;
        const AT_REST: f64 = 1e-12;
        /// So little that the orientation takes nothing from the position that could be seen.
        const TURN_M: f64 = 1e-3;
        const THERE_M: f64 = 1e-6;
        let mut q = *start;
        for _ in 0..STEPS {
            let posture = self.at(&q);
            let error = error_towards(target, &posture.base_from_tool, TURN_M);
            // By joints rather than by directions: of these some are out of reach, and their equations would be all damping.
            let mut gram = JointMatrix::identity() * damping(&error);
            let mut pull = JointMatrix::zeros().column(0).into_owned();
            for (i, column) in columns(&posture, TURN_M).enumerate() {
                pull[i] = column.dot(&error);
                columns(&posture, TURN_M).enumerate().for_each(|(j, other)| gram[(i, j)] += column.dot(&other));
            }
            let step = gram.cholesky()?.solve(&pull);
            add_step(&mut q, step.iter().copied().take(self.joints()));
            if step.amax() < AT_REST {
                let left_m = (target.translation_m - self.at(&q).base_from_tool.translation_m).norm();
                return (left_m < THERE_M).then_some(q);
            }
        }
        None
    }
}

type JointMatrix = SMatrix<f64, MAX_JOINTS, MAX_JOINTS>;

/// From a pose to a target: metres, and radians times `turn_m`.
fn error_towards(target: &Pose<f64>, pose: &Pose<f64>, turn_m: f64) -> Vector6<f64> {
    let off_m = target.translation_m - pose.translation_m;
    let turn = rotation_vector(&(target.rotation * pose.rotation.transpose()));
    Vector6::new(off_m.x, off_m.y, off_m.z, turn.x * turn_m, turn.y * turn_m, turn.z * turn_m)
}

/// How the tool moves with each joint: metres, and radians times `turn_m`.
fn columns(posture: &Posture, turn_m: f64) -> impl Iterator<Item = Vector6<f64>> + '_ {
    posture.axes().iter().map(move |axis| {
        let (shift, turn) = (axis.point_column(&posture.base_from_tool.translation_m), axis.turn_column() * turn_m);
        Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
    })
}

fn damping(error: &Vector6<f64>) -> f64 {
    const PER_SQUARE: f64 = 1e-2;
    const LEAST: f64 = 1e-14;
    PER_SQUARE * error.norm_squared() + LEAST
}

/// Adds a step, shortened to what the linear model holds for.
fn add_step(q: &mut JointVector<f64>, step: impl Iterator<Item = f64>) {
    /// Radians or metres of a joint.
    const LONGEST: f64 = 0.5;
    let step: heapless::Vec<f64, MAX_JOINTS> = step.collect();
    let longest = step.iter().fold(0.0_f64, |longest, step| longest.max(step.abs()));
    let share = (LONGEST / longest).min(1.0);
    for (value, step) in q.as_array_mut().iter_mut().zip(&step) {
        *value += share * step;
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
