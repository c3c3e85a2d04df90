//! What a robot, a rig and a measurement are: plain types, made from numbers, and no algorithm.

mod calibration;
mod dataset;
mod hold_out;
mod limits;
mod rig;
mod robot;
mod solids;

pub use calibration::{Calibration, CalibrationVerdict};
pub use dataset::{Dataset, MixedSigma, Motion, PoseRow, RowWarning};
pub use hold_out::{Choice, Condition, HeldOut, HoldOutError};
pub use limits::{BeyondLimits, JointLimits};
pub use rig::{Bar, NamedPoint, PairingId, Rig};
pub use robot::{EncoderFacts, Robot, Standing};
pub use solids::Solids;
