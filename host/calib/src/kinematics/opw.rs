//! Six-axis arms with a parallel base and a spherical wrist (ortho-parallel, "OPW"): recognised in a chain, and solved in closed
//! form by `rs-opw-kinematics` (M. Brandstötter, A. Angerer, M. Hofbaur, "An analytical solution of the inverse kinematics problem of
//! industrial serial manipulators with an ortho-parallel basis and a spherical wrist", Austrian Robotics Workshop 2014).

use ballbar::{JointKind, JointVector, Matrix3, Pose, Vector3};
use rs_opw_kinematics::glam::{DMat3, DQuat, DVec3};
use rs_opw_kinematics::kinematic_traits::{Kinematics as _, Pose as OpwPose};
use rs_opw_kinematics::kinematics_impl::OPWKinematics;
use rs_opw_kinematics::parameters::opw_kinematics::Parameters;

use super::axis::Axis;
use super::frames::compose;
use super::skeleton::Skeleton;

const JOINTS: usize = 6;

/// A chain's closed-form inverse.
#[derive(Clone, Debug)]
pub struct Opw {
    solver: OPWKinematics,
    /// Frame of the model (z along axis 1, y along axis 2 at encoders zero) in the base frame.
    base_from_model: Pose<f64>,
    /// The model's last frame in the tool frame.
    tool_from_flange: Pose<f64>,
    /// The model's angle is `zero + per_output · q`.
    zeros_rad: [f64; JOINTS],
    per_output: [f64; JOINTS],
}

impl Opw {
    /// Recognises a chain; `None` when it is not of this kind to within rounding.
    pub fn recognise(skeleton: &Skeleton) -> Option<Self> {
        let posture = skeleton.at(&JointVector::zero());
        let axes: &[Axis; JOINTS] = posture.axes().try_into().ok()?;
        if axes.iter().any(|axis| axis.kind != JointKind::Revolute) {
            return None;
        }
        let direction = |joint: usize| axes[joint - 1].direction;
        let (z, y) = (direction(1), direction(2));
        let right_angles = [(1, 2), (3, 4), (4, 5), (5, 6)];
        let are_right = right_angles.iter().all(|&(a, b)| direction(a).dot(&direction(b)).abs() < ROUNDING);
        let wrist_m = crossing(&axes[3], &axes[4])?;
        let meet = crossing(&axes[4], &axes[5]).is_some_and(|point_m| (point_m - wrist_m).norm() < ROUNDING);
        if !are_right || !meet || direction(3).cross(&y).norm() > ROUNDING {
            return None;
        }

        // At the height of axis 2 on axis 1, so that c1 = 0.
        let x = y.cross(&z);
        let shoulder_m = axes[1].point_m;
        let origin_m = axes[0].point_m + z * z.dot(&(shoulder_m - axes[0].point_m));
        let elbow_m = axes[2].point_m - y * y.dot(&(axes[2].point_m - shoulder_m));
        let upper_m = elbow_m - shoulder_m;
        let theta2 = upper_m.dot(&x).atan2(upper_m.dot(&z));

        let fore_m = wrist_m - elbow_m;
        let sign4 = if direction(4).dot(&fore_m) < 0.0 { -1.0 } else { 1.0 };
        let fore_z = direction(4) * sign4;
        let fore_x = y.cross(&fore_z);
        let theta23 = fore_z.dot(&x).atan2(fore_z.dot(&z));
        let theta4 = (-direction(5).dot(&fore_x)).atan2(direction(5).dot(&y));
        let bent_x = direction(5).cross(&fore_z);
        let theta5 = direction(6).dot(&bent_x).atan2(direction(6).dot(&fore_z));

        let parameters = Parameters {
            a1: (shoulder_m - origin_m).dot(&x),
            a2: fore_m.dot(&fore_x),
            b: (wrist_m - origin_m).dot(&y),
            c1: 0.0,
            c2: upper_m.norm(),
            c3: fore_m.dot(&fore_z),
            c4: 0.0,
            offsets: [0.0; JOINTS],
            sign_corrections: [1; JOINTS],
            dof: 6,
        };
        let signs = [1.0, 1.0, direction(3).dot(&y).signum(), sign4, 1.0, 1.0];
        let flange = Matrix3::from_columns(&[direction(5).cross(&direction(6)), direction(5), direction(6)]);
        let tool = &posture.base_from_tool;
        let closed = Self {
            solver: OPWKinematics::new(parameters),
            base_from_model: Pose { rotation: Matrix3::from_columns(&[x, y, z]), translation_m: origin_m },
            tool_from_flange: Pose {
                rotation: tool.rotation.tr_mul(&flange),
                translation_m: tool.rotation.tr_mul(&(wrist_m - tool.translation_m)),
            },
            zeros_rad: [0.0, theta2, theta23 - theta2, theta4, theta5, 0.0],
            per_output: std::array::from_fn(|joint| signs[joint] * axes[joint].scale),
        };
        closed.agrees_with(skeleton).then_some(closed)
    }

    /// All joint vectors of a tool pose that a real arm without limits has, each joint at one of its turns.
    pub fn solve(&self, base_from_tool: &Pose<f64>) -> Vec<JointVector<f64>> {
        let flange = compose(base_from_tool, &self.tool_from_flange);
        let rotation = self.base_from_model.rotation.tr_mul(&flange.rotation);
        let position_m = self.base_from_model.rotation.tr_mul(&(flange.translation_m - self.base_from_model.translation_m));
        let column = |i: usize| DVec3::new(rotation[(0, i)], rotation[(1, i)], rotation[(2, i)]);
        let quaternion = DQuat::from_mat3(&DMat3::from_cols(column(0), column(1), column(2)));
        let Ok(pose) = OpwPose::try_from_parts(DVec3::new(position_m.x, position_m.y, position_m.z), quaternion) else {
            return Vec::new();
        };
        let outputs = |angles: [f64; JOINTS]| {
            let mut q = JointVector::zero();
            for (joint, value) in q.as_array_mut().iter_mut().take(JOINTS).enumerate() {
                *value = (angles[joint] - self.zeros_rad[joint]) / self.per_output[joint];
            }
            q
        };
        self.solver.inverse(&pose).into_iter().map(outputs).collect()
    }

    /// Whether the model's forward kinematics is the chain's, away from any special posture.
    fn agrees_with(&self, skeleton: &Skeleton) -> bool {
        const TRIALS: [[f64; JOINTS]; 2] = [[0.3, -0.7, 0.9, 1.1, -0.5, 0.8], [-1.2, 0.4, -0.6, -0.9, 1.3, -2.1]];
        TRIALS.iter().all(|trial| {
            let mut q = JointVector::zero();
            q.as_array_mut()[..JOINTS].copy_from_slice(trial);
            let angles: [f64; JOINTS] =
                std::array::from_fn(|joint| self.zeros_rad[joint] + self.per_output[joint] * trial[joint]);
            let Ok(flange) = self.solver.try_forward(&angles) else { return false };
            let at = flange.translation;
            let ours = compose(&skeleton.at(&q).base_from_tool, &self.tool_from_flange);
            let theirs_m = self.base_from_model.rotation * Vector3::new(at.x, at.y, at.z) + self.base_from_model.translation_m;
            let axis = flange.rotation * DVec3::X;
            let theirs_x = self.base_from_model.rotation * Vector3::new(axis.x, axis.y, axis.z);
            (ours.translation_m - theirs_m).norm() < ROUNDING && (ours.rotation.column(0) - theirs_x).norm() < ROUNDING
        })
    }
}

/// Angles and metres below this are rounding of a file's decimals.
const ROUNDING: f64 = 1e-7;

/// Where two axes meet; `None` when they pass by one another or are parallel.
fn crossing(a: &Axis, b: &Axis) -> Option<Vector3<f64>> {
    let normal = a.direction.cross(&b.direction);
    let between_m = b.point_m - a.point_m;
    if normal.norm() < ROUNDING || between_m.dot(&normal).abs() > ROUNDING {
        return None;
    }
    Some(a.point_m + a.direction * (between_m.cross(&b.direction).dot(&normal) / normal.norm_squared()))
}
