//! Random arms for property tests, nothing about them aligned.

use std::f64::consts::PI;

use ballbar::{Chain, JointKind, JointVector, Pairing, Vector3};
use proptest::prelude::*;

/// A chain and a joint vector, as proptest shows them.
#[derive(Clone, Debug)]
pub struct Arm {
    /// The chain.
    pub chain: Chain<f64>,
    /// Encoder outputs, radians or metres.
    pub q: Vec<f64>,
}

impl Arm {
    /// The encoder outputs, as the chain takes them.
    pub fn q(&self) -> JointVector<f64> {
        self.chain.joint_vector(&self.q).unwrap()
    }
}

/// 1 to 8 joints of either kind, nothing aligned: metres ±1, radians ±π, scales ±(0.5 … 1.5).
pub fn arms() -> impl Strategy<Value = Arm> {
    let joint = prop_oneof![
        (Just(JointKind::Revolute), scales(), -PI..PI, -PI..PI),
        (Just(JointKind::Prismatic), scales(), -1.0..1.0, -1.0..1.0),
    ];
    let link = (prop::array::uniform3(-1.0..1.0), prop::array::uniform3(-PI..PI));
    (prop::collection::vec((link.clone(), joint), 1..=8), link).prop_map(|(pairs, last)| {
        let (mut kinds, mut parameters, mut q) = (Vec::new(), Vec::new(), Vec::new());
        for ((translation, rotation), (kind, scale, offset, value)) in pairs {
            kinds.push(kind);
            parameters.extend(translation.into_iter().chain(rotation).chain([offset, scale]));
            q.push(value);
        }
        parameters.extend(last.0.into_iter().chain(last.1));
        Arm { chain: Chain::new(&kinds, &parameters).unwrap(), q }
    })
}

fn scales() -> impl Strategy<Value = f64> {
    prop_oneof![0.5..1.5, -1.5..-0.5]
}

/// Points in a cube about the origin.
pub fn points(reach_m: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-reach_m..reach_m).prop_map(Vector3::from)
}

/// A chuck within a metre and a sphere within 0.3 m of their frames' origins.
pub fn pairings() -> impl Strategy<Value = Pairing<f64>> {
    (points(1.0), points(0.3)).prop_map(|(chuck_base_m, sphere_tool_m)| Pairing { chuck_base_m, sphere_tool_m })
}

/// A failure prints the case; a file of seeds beside the test would only be one more thing to keep.
pub fn config() -> ProptestConfig {
    ProptestConfig { failure_persistence: None, ..ProptestConfig::default() }
}
