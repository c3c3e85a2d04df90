//! What the tests in `tests/` share.

pub mod command;
pub mod data;
pub mod experiment;
pub mod naive;
