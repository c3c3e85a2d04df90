//! Which of a controller's axes each joint of a chain is.
//!
//! Controllers count the arm's own axes (A1 or J1, up to six) and external ones (E1, `eax_a`) apart. Prismatic joints in front of the
//! arm are a rail, which carries the arm and is an external axis; so is what comes after the arm's sixth joint. Prismatic joints
//! elsewhere, as the quill of a SCARA robot, are the arm's.

use std::fmt;

use ballbar::JointKind;

/// Axes that an arm has at most.
pub(super) const ARM_AXES: usize = 6;

/// One of a controller's axes; both kinds are counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Axis {
    Arm(usize),
    External(usize),
}

/// What a joint is to a controller, at one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AxisValue {
    pub(super) axis: Axis,
    pub(super) kind: JointKind,
    /// Degrees or millimetres.
    pub(super) value: f64,
}

/// The axes of a chain's joints, in the chain's order.
pub(super) fn axes(kinds: &[JointKind]) -> Vec<Axis> {
    let rails = kinds.iter().take_while(|kind| **kind == JointKind::Prismatic).count();
    let axis = |joint: usize| match joint {
        joint if joint < rails => Axis::External(joint + 1),
        joint if joint < rails + ARM_AXES => Axis::Arm(joint - rails + 1),
        joint => Axis::External(joint - ARM_AXES + 1),
    };
    (0..kinds.len()).map(axis).collect()
}

impl fmt::Display for Axis {
    /// As KRL has it: `A1`, `E1`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Arm(number) => write!(f, "A{number}"),
            Self::External(number) => write!(f, "E{number}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rail_is_external_and_a_quill_is_not() {
        use JointKind::{Prismatic as P, Revolute as R};
        let text = |kinds: &[JointKind]| axes(kinds).iter().map(Axis::to_string).collect::<Vec<_>>().join(" ");
        assert_eq!(text(&[R; 6]), "A1 A2 A3 A4 A5 A6");
        assert_eq!(text(&[P, R, R, R, R, R, R]), "E1 A1 A2 A3 A4 A5 A6");
        assert_eq!(text(&[P, P, R, R, R, R]), "E1 E2 A1 A2 A3 A4");
        assert_eq!(text(&[R, R, P, R]), "A1 A2 A3 A4");
        assert_eq!(text(&[P, R, R, R, R, R, R, R]), "E1 A1 A2 A3 A4 A5 A6 E2");
        assert_eq!(text(&[R, R, R, R, R, R, P]), "A1 A2 A3 A4 A5 A6 E1");
    }
}
