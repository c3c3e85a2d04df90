//! Where every link stands, and which joint vectors bring the tool to a place.
//!
//! `ballbar`'s kinematics carries single points and wrenches as fast as a fit needs it. Planning asks for more: the origins and axes of
//! all joints, for solids and for Jacobians with respect to `q`, and the way back from a pose to joint vectors.

mod branches;
mod inverse;
mod opw;
mod skeleton;

pub use branches::{Branches, InverseKinematics, Thoroughness};
pub use opw::Opw;
pub use skeleton::{Axis, Posture, Skeleton};
