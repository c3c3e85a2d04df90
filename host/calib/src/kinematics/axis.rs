//! A joint's axis, and how it carries what is behind the joint.

use ballbar::{JointKind, Vector3};

/// A joint's axis in the base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Revolute or prismatic.
    pub kind: JointKind,
    /// A point of the axis, metres.
    pub point_m: Vector3<f64>,
    /// Unit vector that the joint turns about or slides along.
    pub direction: Vector3<f64>,
    /// Joint value per encoder output.
    pub scale: f64,
}

impl Axis {
    /// `∂point/∂q` of a point behind the joint, base frame: metres per radian or metre.
    pub fn point_column(&self, point_m: &Vector3<f64>) -> Vector3<f64> {
        match self.kind {
            JointKind::Revolute => self.direction.cross(&(point_m - self.point_m)) * self.scale,
            JointKind::Prismatic => self.direction * self.scale,
        }
    }

    /// How fast what is behind the joint turns with `q`, base frame: radians per radian, or zero.
    pub fn turn_column(&self) -> Vector3<f64> {
        match self.kind {
            JointKind::Revolute => self.direction * self.scale,
            JointKind::Prismatic => Vector3::zeros(),
        }
    }
}
