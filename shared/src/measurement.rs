//! What is measured: between what, where the robot stood, and the force that its gradient is.

use serde::{Deserialize, Serialize};

use crate::{JointVector, Number, Real, Vector3};

/// Where the bar's two ends are: a chuck on the table and a sphere on the tool.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "S: Real + Serialize", deserialize = "S: Real + Deserialize<'de>"))]
pub struct Pairing<S> {
    /// Centre of the chuck `c` in the base frame, metres.
    pub chuck_base_m: Vector3<S>,
    /// Centre of the sphere `s` in the tool (end-effector) frame, metres.
    pub sphere_tool_m: Vector3<S>,
}

/// One settled length of the bar, and where the robot stood.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "S: Real + Serialize", deserialize = "S: Real + Deserialize<'de>"))]
pub struct Measurement<S> {
    /// The bar's two ends.
    pub pairing: Pairing<S>,
    /// Encoder outputs, radians or metres.
    pub q: JointVector<S>,
    /// What the joints' terms add to their angles there, radians or metres ([`crate::JointTerms::displacements`]); zero where there are none.
    pub joint_terms: JointVector<S>,
    /// Measured length d, metres.
    pub length_m: S,
    /// Weight of the squared residual; 1 when all lengths are equally good.
    pub weight: S,
}

impl<S: Number> Measurement<S> {
    /// A length of weight one (metres) between two ends, with the joints at `q` (radians or metres) and no terms.
    pub fn new(pairing: Pairing<S>, q: JointVector<S>, length_m: S) -> Self {
        Self { pairing, q, joint_terms: JointVector::zero(), length_m, weight: S::one() }
    }
}

/// One number that depends on where the sphere is, seen from the chuck.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A coordinate along the base frame's x.
    X = 0,
    /// A coordinate along the base frame's y.
    Y = 1,
    /// A coordinate along the base frame's z.
    Z = 2,
    /// The distance: what a ball-bar measures.
    Length,
}

impl Quantity {
    /// The three of a measured position.
    pub const COORDINATES: [Self; 3] = [Self::X, Self::Y, Self::Z];
}

/// A quantity, and its gradient by where the sphere is: a force there, of size one. All other gradients are what this force does. By the
/// sphere's place it is the force itself, by the chuck's the opposite one, by a joint's angle its moment about that joint's axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Force<S> {
    /// The quantity, metres.
    pub value_m: S,
    /// The force in the base frame. Zero where sphere and chuck coincide, where a length has no gradient.
    pub base: Vector3<S>,
    /// The same force in the tool frame.
    pub tool: Vector3<S>,
}
