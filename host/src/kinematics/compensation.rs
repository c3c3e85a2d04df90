//! Commands for a controller that keeps its nominal model: what to tell it so that the real robot goes where it should.

use ballbar::{JointVector, Kinematics, Pose};

use super::frames::apart;
use super::skeleton::Skeleton;
use crate::files::{Robot, Target};

/// A calibrated robot beside the model that its controller has.
#[derive(Clone, Debug)]
pub struct Compensator {
    calibrated: Skeleton,
    nominal: Kinematics<f64>,
}

/// What to command for one target. Differences are metres and radians, as the calibrated robot predicts them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compensation {
    /// Joints to command, radians or metres.
    pub q: JointVector<f64>,
    /// The pose that the controller believes to reach by them.
    pub nominal_base_from_tool: Pose<f64>,
    /// From the target, if the controller goes to the joints of the file.
    pub before: (f64, f64),
    /// From the target, if it goes to `q`.
    pub left: (f64, f64),
}

impl Compensator {
    /// A calibrated robot and its controller's model; both have the same joints.
    pub fn new(calibrated: &Robot, nominal: &Robot) -> Self {
        Self { calibrated: Skeleton::new(&calibrated.chain), nominal: Kinematics::new(&nominal.chain) }
    }

    /// Joints by which the calibrated robot is at the target, on the branch of the target's own joints; `None` when they cannot be
    /// brought there. The target is the pose of the row, or else the pose that the nominal model has at its joints. `rounded` is what
    /// becomes of joints on their way to the controller.
    pub fn compensate(&self, target: &Target, rounded: impl Fn(JointVector<f64>) -> JointVector<f64>) -> Option<Compensation> {
        let wanted = target.base_from_tool.unwrap_or_else(|| self.nominal.base_from_tool(&target.q));
        let q = rounded(self.calibrated.reach_pose(&target.q, &wanted)?);
        let from_target = |q: &JointVector<f64>| apart(&wanted, &self.calibrated.at(q).base_from_tool);
        Some(Compensation {
            q,
            nominal_base_from_tool: self.nominal.base_from_tool(&q),
            before: from_target(&target.q),
            left: from_target(&q),
        })
    }
}
