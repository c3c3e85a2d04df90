//! One sample: what the sampling interrupt hands over.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::lvdt::LvdtReading;
use crate::MAX_JOINTS;

/// Encoder positions in counts, joint by joint.
pub type Counts = Vec<i32, MAX_JOINTS>;

/// All channels at one moment.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Sample {
    /// Number of the sampling interrupt since start, wrapping; a gap is an overrun.
    pub index: u32,
    /// Time of the encoders' latch since start, microseconds.
    pub t_us: u64,
    /// Encoder positions, counts.
    pub counts: Counts,
    /// The LVDT.
    pub lvdt: LvdtReading,
}
