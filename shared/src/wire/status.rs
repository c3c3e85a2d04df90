//! What the board says about itself.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::parameter_set::SetIdentity;
use super::stream_selection::StreamSelection;
use crate::{LvdtReading, MAX_JOINTS, Stillness, StillnessCriteria};

/// Counters and states of everything. Counters count since start and wrap.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Status {
    /// Time since start, microseconds.
    pub uptime_us: u64,
    /// Sampling rate, Hz.
    pub rate_hz: u16,
    /// What is streamed; none when nothing is.
    pub streaming: Option<StreamSelection>,
    /// Samples taken by the sampling interrupt.
    pub samples: u32,
    /// Samples lost because the main loop was slow.
    pub overruns: u32,
    /// Stream messages made.
    pub stream_messages: u32,
    /// Of these, dropped because the link was slow.
    pub dropped: u32,
    /// What arrived from the host.
    pub link: LinkCounts,
    /// Encoders, joint by joint.
    pub encoders: Vec<EncoderStatus, MAX_JOINTS>,
    /// The latest reading of the LVDT.
    pub lvdt: LvdtReading,
    /// Samples whose LVDT was saturated, or whose conversion was not done in time.
    pub lvdt_faults: u32,
    /// Whether the arm stands still.
    pub stillness: Stillness,
    /// What counts as standing still.
    pub criteria: StillnessCriteria,
    /// The parameters in use.
    pub active: Option<SetIdentity>,
    /// CRC-32 of the parameters written and not committed.
    pub staged: Option<u32>,
    /// The two places in flash.
    pub slots: [SlotState; 2],
    /// Bytes of the stack that were never used.
    pub stack_unused_bytes: u32,
    /// What was in use before, and still stands in flash; none where both places hold the same.
    pub previous: Option<SetIdentity>,
}

/// Frames from the host, by their fate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct LinkCounts {
    /// Whole ones.
    pub good: u32,
    /// Thrown away: wrong CRC.
    pub crc: u32,
    /// Thrown away: overlong or malformed.
    pub malformed: u32,
    /// Requests that are missing between the numbers of two that came.
    pub missing: u32,
}

/// One encoder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct EncoderStatus {
    /// Position, counts.
    pub counts: i32,
    /// Preset since start.
    pub is_homed: bool,
    /// Index pulses.
    pub index_pulses: u32,
    /// Index pulses that were not whole turns from the one before: counts were lost.
    pub index_errors: u32,
}

/// What stands in one of the two places for parameters in flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum SlotState {
    /// Nothing was ever written, or it was erased.
    Empty,
    /// Something that is no whole set of this layout.
    Damaged,
    /// A whole set.
    Good {
        /// Counts the commits; the higher of two is the newer.
        sequence: u32,
        /// CRC-32 of the set.
        crc: u32,
    },
}

/// What the self-test found.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct SelfTest {
    /// Every test, in order.
    pub results: Vec<CheckResult, 8>,
}

/// One test and what it found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct CheckResult {
    /// Which.
    pub check: Check,
    /// Whether it passed.
    pub passed: bool,
}

/// What the self-test tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Check {
    /// Samples arrive.
    Sampling,
    /// No sample was lost.
    Overruns,
    /// The LVDT's signal is off the ends of the converter's range.
    LvdtSignal,
    /// No index pulse was out of place.
    Index,
    /// Parameters are in use, and what stands in flash is what is in use.
    Parameters,
    /// Both places in flash hold a whole set, so that one may be lost.
    Slots,
    /// The kinematics gives what was computed elsewhere for a built-in arm.
    Kinematics,
    /// At least a quarter of the stack was never used.
    Stack,
}
