//! What a robot, a rig and a measurement are: plain types, made from numbers, and no algorithm.

mod calibration;
mod dataset;
mod hold_out;
mod limits;
mod rig;
mod robot;
mod solids;
#[cfg(feature = "serde")]
mod stored;
mod tolerances;

pub use calibration::{Calibration, CalibrationVerdict};
pub use dataset::{Dataset, MixedSigma, Motion, PoseError, PoseRow, RowWarning};
pub use hold_out::{Choice, Condition, HeldOut, HoldOutError};
pub use limits::{BeyondLimits, JointLimits};
pub use rig::{Bar, End, NamedPoint, PairingId, Rig, RigError};
pub use robot::{EncoderFacts, Robot, RobotError, Standing};
pub use solids::Solids;
pub use tolerances::{JointTolerance, LinkTolerance, Tolerances};
