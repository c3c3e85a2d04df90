//! The messages of both directions.

use heapless::{String, Vec};
use postcard_schema::Schema;
use postcard_schema::key::Key;
use serde::{Deserialize, Serialize};

use super::batch::{PoseBatch, SampleBatch};
use super::parameter_set::{ParameterSet, ParameterSetError, SetIdentity};
use super::status::{SelfTest, Status};
use super::stream_selection::StreamSelection;
use super::tool_pose::ToolPose;
use crate::{Approach, LvdtCurve, MAX_JOINTS, SettledPose, StillnessCriteria};

/// The protocol that this crate speaks.
pub const PROTOCOL: ProtocolVersion = ProtocolVersion {
    number: 3,
    schema: {
        let (to_board, to_host) =
            (Key::for_path::<ToBoard>("to-board").to_bytes(), Key::for_path::<ToHost>("to-host").to_bytes());
        let mut both = [0; 8];
        let mut i = 0;
        while i < both.len() {
            both[i] = to_board[i] ^ to_host[i];
            i += 1;
        }
        both
    },
};

/// What an end speaks. The first field of both hellos, for ever.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct ProtocolVersion {
    /// Raised when the meaning of a message changes.
    pub number: u16,
    /// Hash of all messages' names, fields and types.
    pub schema: [u8; 8],
}

/// From host to board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[expect(clippy::large_enum_variant, reason = "there is no heap to box on, and one message at a time")]
pub enum ToBoard {
    /// Opens the conversation; until a hello of the same version the board refuses requests.
    Hello(HostHello),
    /// Something to do.
    Request(Request),
}

/// From board to host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum ToHost {
    /// The answer to a hello.
    Hello(BoardHello),
    /// The answer to a request.
    Reply(Reply),
    /// What was asked to be streamed.
    Stream(Stream),
    /// Never sent: the host writes it into the log of a session between the frames that it received.
    Mark(LogMark),
}

/// The host's half of the greeting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct HostHello {
    /// What the host speaks.
    pub version: ProtocolVersion,
}

/// The board's half of the greeting.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct BoardHello {
    /// What the board speaks.
    pub version: ProtocolVersion,
    /// Version of the firmware.
    pub firmware: String<16>,
    /// Kind of board.
    pub board: String<16>,
    /// A number of this very board.
    pub unique_id: [u8; 12],
    /// Encoders that it counts.
    pub encoders: u8,
    /// Lowest sampling rate, Hz.
    pub rate_min_hz: u16,
    /// Highest sampling rate, Hz.
    pub rate_max_hz: u16,
    /// From the first to the last encoder of a latch, at most, nanoseconds.
    pub encoder_skew_ns: u32,
    /// From the encoders' latch to the middle of the LVDT's scan, nanoseconds.
    pub lvdt_delay_ns: u32,
    /// Time since start, microseconds.
    pub uptime_us: u64,
    /// Why it started.
    pub reset: ResetReason,
    /// The parameters in use, when there are any.
    pub active: Option<SetIdentity>,
}

/// Why the board started.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum ResetReason {
    /// Power was switched on.
    PowerOn,
    /// The supply sagged.
    BrownOut,
    /// The reset pin.
    Pin,
    /// The host asked for it, or a debugger.
    Software,
    /// The main loop stood still for too long.
    Watchdog,
    /// The firmware met a state that it does not know; what it said.
    Panic(String<96>),
    /// The hardware does not say.
    Unknown,
}

/// A command and the number by which its reply is known. A number that repeats is a repetition: the board answers again, and does
/// nothing twice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Request {
    /// One more than the last request's, wrapping.
    pub id: u16,
    /// What to do.
    pub command: Command,
}

/// What the board can be asked to do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[expect(clippy::large_enum_variant, reason = "there is no heap to box on, and one message at a time")]
pub enum Command {
    /// Counters and states of everything.
    Status,
    /// Tests what can be tested without moving anything.
    SelfTest,
    /// Streams these, instead of what was streamed before.
    StartStream(StreamSelection),
    /// Ends the stream.
    StopStream,
    /// Sets the sampling rate.
    SetRate {
        /// Samples a second.
        rate_hz: u16,
    },
    /// Says what counts as standing still.
    SetStillness(StillnessCriteria),
    /// Declares that an encoder stands at this position now; the joint counts as homed.
    PresetEncoder {
        /// The joint, from 0.
        joint: u8,
        /// The position, counts.
        counts: i32,
    },
    /// Puts another LVDT curve into the staged parameters.
    SetLvdt(LvdtCurve),
    /// Stages parameters: they are checked and kept beside those in use.
    WriteParameters(ParameterSet),
    /// Reads parameters back.
    ReadParameters(WhichSet),
    /// Stores the staged parameters in flash and takes them into use. Nothing to do when they are in use already.
    Commit {
        /// CRC-32 of the staged set, so that both ends mean the same.
        crc: u32,
    },
    /// Forgets the staged parameters.
    Discard,
    /// The tool's pose now.
    CurrentPose,
    /// The tool's pose at given joint values.
    ForwardKinematics {
        /// By which parameters.
        set: WhichSet,
        /// Encoder outputs, radians or metres.
        q: Vec<f32, MAX_JOINTS>,
        /// From which sides the joints came there.
        approach: Approach,
    },
    /// Resets the board, after the answer has left.
    Reset,
    /// Reads the parameters that were in use before those that are: the other whole set in flash.
    ReadPrevious,
}

/// Which parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum WhichSet {
    /// Those in flash, which are in use.
    Active,
    /// Those written and not yet committed.
    Staged,
}

/// The answer to a request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Reply {
    /// Number of the request.
    pub id: u16,
    /// What came of it.
    pub outcome: Result<Answer, Refusal>,
}

/// What a command brings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[expect(clippy::large_enum_variant, reason = "there is no heap to box on, and one message at a time")]
pub enum Answer {
    /// It is done.
    Done,
    /// To `Status`.
    Status(Status),
    /// To `SelfTest`.
    SelfTest(SelfTest),
    /// To `ReadParameters` and `ReadPrevious`.
    Parameters(ParameterSet),
    /// To `WriteParameters` and `SetLvdt`: CRC-32 of what is staged now.
    Staged {
        /// The CRC to commit with.
        crc: u32,
    },
    /// To `CurrentPose`.
    CurrentPose(CurrentPose),
    /// To `ForwardKinematics`.
    Pose(ToolPose),
}

/// Why a command was not carried out. Nothing has changed then.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Refusal {
    /// No hello of the same version came since the board started.
    HelloFirst,
    /// The frame was whole, but is no message of this version.
    NotUnderstood,
    /// The rate is out of range.
    Rate {
        /// Lowest, Hz.
        min_hz: u16,
        /// Highest, Hz.
        max_hz: u16,
    },
    /// The criteria hold for less than 10 ms or more than a minute.
    Stillness,
    /// Nothing was selected to stream.
    NothingSelected,
    /// There is no such encoder or joint.
    Joint {
        /// Encoders or joints that there are.
        joints: u8,
    },
    /// A value is no finite number, or the pose is none.
    NotFinite,
    /// The LVDT's curve is none: see [`LvdtCurve::is_valid`].
    LvdtCurve,
    /// The parameters cannot be used.
    Parameters(ParameterSetError),
    /// The robot has more joints than the board has encoders.
    TooManyJoints {
        /// Joints of the robot.
        joints: u8,
        /// Encoders of the board.
        encoders: u8,
    },
    /// The set asked for is not there.
    NoParameters,
    /// The staged set has another CRC.
    OtherCrc {
        /// The staged set's.
        staged: u32,
    },
    /// Storing would stall sampling, and a stream is running.
    Streaming,
    /// Storing would stall sampling, and an encoder moved a moment ago.
    Moving,
    /// The flash could not be erased, written or read back; the old parameters are still in use.
    Flash,
    /// No sample was taken yet.
    NoSample,
    /// Flash holds no other parameters than those in use.
    NoPrevious,
}

/// A stream message's frame of reference, and its content.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Stream {
    /// Number of this message since the board started, wrapping. Messages that the board dropped have numbers too.
    pub sequence: u32,
    /// Messages that the board dropped since it started because the link was slow, wrapping.
    pub dropped: u32,
    /// Samples lost since start because the main loop was slow, wrapping.
    pub overruns: u32,
    /// Bit i: encoder i was preset since start.
    pub homed: u8,
    /// The content.
    pub event: Event,
}

/// What is streamed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[expect(clippy::large_enum_variant, reason = "there is no heap to box on, and one message at a time")]
pub enum Event {
    /// Consecutive samples.
    Samples(SampleBatch),
    /// The arm has stood still.
    Settled(SettledPose),
    /// Corrected poses of the tool.
    Poses(PoseBatch),
}

/// The tool's pose at the latest sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct CurrentPose {
    /// Time of the sample, microseconds.
    pub t_us: u64,
    /// Bit i: encoder i was preset since start. A pose means little before all are.
    pub homed: u8,
    /// Encoder outputs, radians or metres.
    pub q: Vec<f32, MAX_JOINTS>,
    /// From which sides they were reached, as far as the board saw it.
    pub approach: Approach,
    /// Where the tool is.
    pub pose: ToolPose,
    /// Displacement of the bar from mid travel, metres; none when the LVDT is at fault.
    pub displacement_m: Option<f32>,
}

/// What the host notes between the frames of a session's log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum LogMark {
    /// Recording begins, or goes on after the program was started again.
    Opened {
        /// Milliseconds since 1970, UTC.
        unix_ms: u64,
    },
    /// The port was lost: what the board sent from here on is missing.
    Lost {
        /// Milliseconds since 1970, UTC.
        unix_ms: u64,
    },
    /// The port is back.
    Back {
        /// Milliseconds since 1970, UTC.
        unix_ms: u64,
    },
}

/// The version in a hello of either direction, of this or any other version; `None` when the payload is no hello.
pub fn hello_version(payload: &[u8]) -> Option<ProtocolVersion> {
    let (&variant, rest) = payload.split_first()?;
    let (version, _) = postcard::take_from_bytes(rest).ok()?;
    (variant == 0).then_some(version)
}
