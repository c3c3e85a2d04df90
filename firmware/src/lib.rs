//! The behaviour of the ball-bar's interface board, whole and portable: everything but the registers.
//!
//! ```text
//! sampling interrupt                          main loop
//! ──────────────────                          ─────────
//! EncoderBank ─┐                              ┌─▶ IndexCheck, SettleDetector
//! TriggeredAdc ├─ Sampler ──SampleQueue──▶ Board ─▶ Streamer ─▶ Outbox ─▶ Link
//! Clock ───────┘  (lock-free)                 └─▶ kinematics      ▲
//!                                    Link ─▶ FrameReader ─▶ commands ─▶ Slots (flash)
//! ```
//!
//! The interrupt latches and hands over, nothing else; whatever may take its time is in [`Board::poll`]. Time comes with the
//! samples, so that the slow side needs no clock, and a run is repeatable sample by sample on any machine.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

mod approach_watch;
mod board;
mod commands;
mod conversation;
mod crash;
mod hardware;
mod log;
mod memory_flash;
mod outbox;
mod parameters;
mod sampler;
mod self_test;
mod sensors;
mod slots;
mod streamer;

pub use board::Board;
pub use crash::CrashRecord;
pub use hardware::{
    BoardFacts, ENCODERS, EncoderBank, EncoderLatch, Hardware, Link, LvdtScan, MonotonicClock, ParameterFlash, TriggeredAdc,
};
pub use memory_flash::{MemoryFlash, MemoryFlashError};
pub use sampler::{LatchedSample, SampleQueue, Sampler};
pub use slots::{CommitError, SLOT_IMAGE_BYTES, Slots};

/// Lowest sampling rate, Hz.
pub const RATE_MIN_HZ: u16 = 100;
/// Highest sampling rate, Hz.
pub const RATE_MAX_HZ: u16 = 5_000;
/// Sampling rate after start, Hz.
pub const RATE_DEFAULT_HZ: u16 = 1_000;
