//! Measurements without hardware: poses on hemispherical shells, simulated lengths, and how far off the tool is.

mod shells;
mod workspace;

pub use shells::{ShellError, ShellPose, Shells};
pub use workspace::{ToolError, tool_error};
