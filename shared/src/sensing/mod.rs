//! From hardware counters and converter codes to joint values and displacements, and when the arm stands still.

mod encoder;
mod joint_encoders;
mod lvdt;
mod sample;
mod settle;

pub use encoder::{CounterWidth, ExtendedCounter, IndexCheck};
pub use joint_encoders::{Coupling, Encoder, EncoderError, JointEncoders, MAX_COUPLINGS};
pub use lvdt::{LVDT_COEFFICIENTS, LvdtCurve, LvdtFault, LvdtReading};
pub use sample::{Counts, Sample};
pub use settle::{SettleDetector, SettledPose, Stillness, StillnessCriteria};
