//! A chain in one configuration: joint values, and the sides from which they were reached.

use crate::kinematics::Motion;
use crate::{Approach, Force, JointVector, Kinematics, MAX_JOINTS, Number, Pairing, Pose, Quantity, Row, Vector3};

/// A chain at encoder outputs q, approached from known sides or not. Made by [`Kinematics::configuration`]; the joints' sines,
/// cosines and terms are computed once for all that is asked of it.
#[derive(Clone, Copy)]
pub struct Configuration<'a, S> {
    kinematics: &'a Kinematics<S>,
    q: &'a JointVector<S>,
    motions: [Motion<S>; MAX_JOINTS],
}

impl<'a, S: Number> Configuration<'a, S> {
    pub(crate) fn new(kinematics: &'a Kinematics<S>, q: &'a JointVector<S>, approach: Approach) -> Self {
        Self { kinematics, q, motions: kinematics.motions_approached(q, approach) }
    }

    /// With displacements that somebody else has made of the joints' terms, radians or metres.
    pub(crate) fn displaced(kinematics: &'a Kinematics<S>, q: &'a JointVector<S>, displacements: &JointVector<S>) -> Self {
        Self { kinematics, q, motions: kinematics.displaced_motions(q, displacements) }
    }

    /// Pose of the tool.
    pub fn base_from_tool(&self) -> Pose<S> {
        self.kinematics.tool_pose(&self.motions)
    }

    /// Position in the base frame of a point of the tool, metres.
    pub fn point_in_base(&self, point_tool_m: &Vector3<S>) -> Vector3<S> {
        self.kinematics.sweep_out(&self.motions, point_tool_m)
    }

    /// Computed length `d = |T·s − c|`, metres.
    pub fn length(&self, pairing: &Pairing<S>) -> S {
        let bar_m = self.point_in_base(&pairing.sphere_tool_m) - pairing.chuck_base_m;
        bar_m.dot(&bar_m).square_root()
    }

    /// As [`Kinematics::gradient`].
    pub fn gradient(&self, quantity: Quantity, pairing: &Pairing<S>, row: &mut Row<S>) -> Force<S> {
        self.kinematics.gradient_at(&self.motions, quantity, self.q, pairing, row)
    }
}
