//! What travels between board and host: messages, and the frames that carry them.
//!
//! ```text
//! message ──postcard──▶ payload ──+ CRC-32──COBS──▶ frame, ended by 0x00
//! ```
//!
//! The first variant of both enums is the hello. Its beginning, the protocol's number and the schema's hash, never changes, so that
//! two ends of different versions can still tell each other what they are. All else may change with the number.

mod batch;
mod frame;
mod messages;
mod parameter_set;
mod status;
mod stream_selection;
mod term_numbers;
mod tool_pose;

pub use batch::{MAX_BATCH, MAX_POSE_BATCH, PoseBatch, SampleBatch, SampleStep, StreamedPose};
pub use frame::{FrameCounts, FrameError, FrameFault, FrameReader, MAX_FRAME, MAX_PAYLOAD, decode, encode};
pub use messages::{
    Answer, BoardHello, Command, CurrentPose, Event, HostHello, LogMark, PROTOCOL, ProtocolVersion, Refusal, Reply, Request,
    ResetReason, Stream, ToBoard, ToHost, WhichSet, hello_version,
};
pub use parameter_set::{CompiledParameters, MAX_REACH_M, MAX_SPAN_M, ParameterSet, ParameterSetError, SetIdentity};
pub use status::{Check, CheckResult, EncoderStatus, LinkCounts, SelfTest, SlotState, Status};
pub use stream_selection::StreamSelection;
pub use term_numbers::{MAX_TERM_NUMBERS, term_numbers};
pub use tool_pose::ToolPose;
