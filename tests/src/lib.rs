//! What the tests in `tests/` share.

pub mod any_message;
pub mod arms;
pub mod at_length;
#[cfg(unix)]
pub mod bridge;
pub mod command;
#[cfg(unix)]
pub mod crew;
pub mod data;
#[cfg(unix)]
pub mod emulator;
pub mod experiment;
pub mod exports;
#[cfg(unix)]
pub mod f405_emulator;
pub mod fake_board;
pub mod fake_hardware;
pub mod frames;
pub mod naive;
pub mod parameter_sets;
pub mod peers;
pub mod plans;
pub mod power_cut;
pub mod raw_payload;
pub mod readers;
#[cfg(unix)]
pub mod scenarios;
pub mod shells;
#[cfg(unix)]
pub mod simulated_cell;
pub mod solids;
#[cfg(unix)]
pub mod tampered_line;
#[cfg(unix)]
pub mod terminal;
pub mod tool;
pub mod wire_schema;
pub mod workbench;
pub mod workspace;
