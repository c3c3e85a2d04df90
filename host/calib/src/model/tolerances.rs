//! How well a design's numbers are known.

use ballbar::JointKind;

/// How well a link's transform is known: standard deviations, the same in every direction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LinkTolerance {
    /// Of each coordinate of its displacement, metres.
    pub displacement_m: f64,
    /// Of each component of its rotation vector, radians.
    pub rotation_rad: f64,
}

/// How well a joint's line `offset + scale · q` is known: standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct JointTolerance {
    /// Of its offset, radians or metres.
    pub offset: f64,
    /// Of its scale, without a unit.
    pub scale: f64,
}

/// How well the numbers of a robot's file are known: standard deviations, SI. Zero: exactly, and no fit changes it.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Tolerances {
    /// One for each link; the first says where the robot stands, the last how the tool is mounted.
    pub links: Vec<LinkTolerance>,
    /// One for each joint.
    pub joints: Vec<JointTolerance>,
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;

impl LinkTolerance {
    /// Where a robot stands in a rig that was put up beside it: 50 mm, 5°.
    pub const OF_BASE: Self = Self { displacement_m: 50e-3, rotation_rad: 5.0 * DEGREE };
    /// How a tool is mounted: 5 mm, 2°.
    pub const OF_TOOL: Self = Self { displacement_m: 5e-3, rotation_rad: 2.0 * DEGREE };
    /// Inside an arm, as it is made: 1 mm, 0.5°.
    pub const INSIDE: Self = Self { displacement_m: 1e-3, rotation_rad: 0.5 * DEGREE };
}

impl JointTolerance {
    /// As joints are made and mastered: 0.5° or 1 mm, 5e-4.
    pub const fn usual(kind: JointKind) -> Self {
        let offset = match kind {
            JointKind::Revolute => 0.5 * DEGREE,
            JointKind::Prismatic => 1e-3,
        };
        Self { offset, scale: 5e-4 }
    }
}

impl Tolerances {
    /// Of a robot whose maker says nothing of them.
    pub fn usual(kinds: &[JointKind]) -> Self {
        let mut links = vec![LinkTolerance::INSIDE; kinds.len() + 1];
        if let [first, .., last] = links.as_mut_slice() {
            (*first, *last) = (LinkTolerance::OF_BASE, LinkTolerance::OF_TOOL);
        }
        Self { links, joints: kinds.iter().map(|&kind| JointTolerance::usual(kind)).collect() }
    }

    /// Whether they are those of so many joints, and all finite and not below zero.
    pub fn are_of(&self, joints: usize) -> bool {
        let links = self.links.iter().flat_map(|link| [link.displacement_m, link.rotation_rad]);
        let mut all = links.chain(self.joints.iter().flat_map(|joint| [joint.offset, joint.scale]));
        self.links.len() == joints + 1
            && self.joints.len() == joints
            && all.all(|tolerance| tolerance.is_finite() && tolerance >= 0.0)
    }
}
