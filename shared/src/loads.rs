//! What gravity does to each joint: its moment about a revolute joint's axis, its force along a prismatic one's.

use nalgebra::Scalar;
use serde::{Deserialize, Serialize};

use crate::kinematics::Kinematics;
use crate::{JointKind, JointVector, MAX_JOINTS, Number, Real, Vector3};

/// Acceleration of free fall that masses are weighed with, m/s² (3rd General Conference on Weights and Measures, 1901).
pub const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;

/// A body as gravity sees it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "S: Scalar + Serialize", deserialize = "S: Scalar + Deserialize<'de>"))]
pub struct Body<S> {
    /// Its mass, kilograms.
    pub mass_kg: S,
    /// Its centre of mass, metres.
    pub center_m: Vector3<S>,
}

/// The masses of an arm, and which way they fall.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "S: Scalar + Serialize", deserialize = "S: Scalar + Deserialize<'de>"))]
pub struct Masses<S> {
    /// Entry i is link i + 2, which joint i + 1 moves, in the frame that moves with that joint: the one in which the link's own
    /// translation is given. Link 1 stands still and loads no joint.
    pub links: [Body<S>; MAX_JOINTS],
    /// What the arm carries, in the tool frame.
    pub payload: Body<S>,
    /// Acceleration of free fall in the base frame, m/s².
    pub gravity_base_m_s2: Vector3<S>,
}

impl<S: Number> Body<S> {
    /// No body.
    pub fn none() -> Self {
        Self { mass_kg: S::zero(), center_m: Vector3::zeros() }
    }

    fn moment(&self) -> MassMoment<S> {
        MassMoment { mass_kg: self.mass_kg, first_kg_m: self.center_m * self.mass_kg }
    }
}

impl<S: Number> Masses<S> {
    /// An arm that weighs nothing, upright in its base frame.
    pub fn none() -> Self {
        let down = Vector3::new(S::zero(), S::zero(), -S::nearest(STANDARD_GRAVITY_M_S2));
        Self { links: [Body::none(); MAX_JOINTS], payload: Body::none(), gravity_base_m_s2: down }
    }

    /// Whether gravity pulls at anything behind joint `joint`, from 0.
    pub fn load_joint(&self, joint: usize) -> bool {
        let is_heavy = |body: &Body<S>| body.mass_kg != S::zero();
        let is_falling = self.gravity_base_m_s2 != Vector3::zeros();
        is_falling && (is_heavy(&self.payload) || self.links.iter().skip(joint).any(is_heavy))
    }
}

impl<S: Real> Body<S> {
    /// The same in another precision.
    pub fn cast<T: Real>(&self) -> Body<T> {
        Body { mass_kg: T::nearest(self.mass_kg.widen()), center_m: self.center_m.map(|value| T::nearest(value.widen())) }
    }
}

impl<S: Real> Masses<S> {
    /// The same in another precision.
    pub fn cast<T: Real>(&self) -> Masses<T> {
        Masses {
            links: self.links.map(|body| body.cast()),
            payload: self.payload.cast(),
            gravity_base_m_s2: self.gravity_base_m_s2.map(|value| T::nearest(value.widen())),
        }
    }
}

/// Mass and first moment of mass about a frame's origin: what adds up from link to link.
#[derive(Clone, Copy)]
struct MassMoment<S> {
    mass_kg: S,
    first_kg_m: Vector3<S>,
}

impl<S: Number> MassMoment<S> {
    fn plus(self, other: Self) -> Self {
        Self { mass_kg: self.mass_kg + other.mass_kg, first_kg_m: self.first_kg_m + other.first_kg_m }
    }
}

impl<S: Number> Kinematics<S> {
    /// The moment (Nm) or force (N) by which gravity pulls each joint the positive way at encoder outputs `q`: `−∂V/∂θ` of the
    /// potential energy `V = −Σ m g·c` of all that the joint moves. Of the rigid arm: at `θ = offset + scale · q`, since what the terms
    /// add to the angles changes the loads by their product with some 1e-3.
    pub fn gravity_loads(&self, masses: &Masses<S>, q: &JointVector<S>) -> JointVector<S> {
        let motions = self.rigid_motions(q);
        let joints = self.joints();
        // From the tool inwards: all that each joint moves, in the frame behind the joint.
        let mut behind = [masses.payload.moment(); MAX_JOINTS];
        let mut carried = masses.payload.moment();
        for i in (0..joints).rev() {
            let link = &self.links()[i + 1];
            carried.first_kg_m = link.rotation * carried.first_kg_m + link.translation_m * carried.mass_kg;
            carried = carried.plus(masses.links[i].moment());
            behind[i] = carried;
            carried.first_kg_m = motions[i].moved_moment(carried.first_kg_m, carried.mass_kg);
        }
        // From the base outwards: gravity in those frames.
        let mut loads = JointVector::zero();
        let mut gravity_m_s2 = masses.gravity_base_m_s2;
        for i in 0..joints {
            gravity_m_s2 = motions[i].direction_behind(self.links()[i].rotation.tr_mul(&gravity_m_s2));
            let MassMoment { mass_kg, first_kg_m } = behind[i];
            loads.0[i] = match self.joint_kind(i) {
                JointKind::Revolute => first_kg_m.x * gravity_m_s2.y - first_kg_m.y * gravity_m_s2.x,
                JointKind::Prismatic => mass_kg * gravity_m_s2.z,
            };
        }
        loads
    }
}
