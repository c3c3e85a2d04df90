//! Where every link stands, and which joint vectors bring the tool to a place.
//!
//! `ballbar`'s kinematics carries single points and wrenches as fast as a fit needs it. Planning asks for more: the origins and axes of
//! all joints, for solids and for Jacobians with respect to `q`, and the way back from a pose to joint vectors.

mod axis;
mod branches;
mod canonical;
mod compensation;
mod dh;
mod frames;
mod gradients;
mod inverse;
mod opw;
mod skeleton;

pub use axis::Axis;
pub use branches::{Branches, InverseKinematics, Thoroughness};
pub use canonical::CanonicalFrames;
pub use compensation::{Compensation, Compensator, FarTurn, Goal, NothingAllowed, Unreached};
pub use dh::{Convention, DhRow, DhTable, NearlyParallel};
pub use frames::{apart, compose, from_link, inverse, link_angles};
pub use gradients::{position_jacobian, with_length_gradient};
pub use opw::Opw;
pub use skeleton::{Posture, Skeleton};
