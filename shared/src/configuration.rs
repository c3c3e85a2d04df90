//! A chain in one configuration: joint values, and the sides from which they were reached.

use crate::kinematics::Motion;
use crate::{Approach, JointVector, Kinematics, MAX_JOINTS, Pairing, Pose, Real, Row, Vector3};

/// A chain at encoder outputs q, approached from known sides or not. Made by [`Kinematics::configuration`]; the joints' sines,
/// cosines and terms are computed once for all that is asked of it.
#[derive(Clone, Copy)]
pub struct Configuration<'a, S> {
    kinematics: &'a Kinematics<S>,
    q: &'a JointVector<S>,
    motions: [Motion<S>; MAX_JOINTS],
}

impl<'a, S: Real> Configuration<'a, S> {
    pub(crate) fn new(kinematics: &'a Kinematics<S>, q: &'a JointVector<S>, approach: Approach) -> Self {
        Self { kinematics, q, motions: kinematics.motions_approached(q, approach) }
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
        (self.point_in_base(&pairing.sphere_tool_m) - pairing.chuck_base_m).norm()
    }

    /// As [`Kinematics::length_gradient`].
    pub fn length_gradient(&self, pairing: &Pairing<S>, row: &mut Row<S>) -> S {
        let bar_m = self.point_in_base(&pairing.sphere_tool_m) - pairing.chuck_base_m;
        let length_m = bar_m.norm();
        let along_bar = if length_m > S::zero() { bar_m / length_m } else { Vector3::zeros() };
        self.wrench_columns(along_bar, pairing.chuck_base_m.cross(&along_bar), row);
        length_m
    }

    /// As [`Kinematics::wrench_columns`].
    pub fn wrench_columns(&self, force_base: Vector3<S>, moment_base: Vector3<S>, row: &mut Row<S>) {
        self.kinematics.sweep_wrench(self.q, &self.motions, force_base, moment_base, row);
    }
}
