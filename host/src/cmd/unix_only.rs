//! What stands in for commands that this system cannot run, so that it can say why.

use clap::Args;
use miette::Diagnostic;
use thiserror::Error;

use super::outcome::{CommandError, Outcome};

/// Linux and macOS only: it needs a pseudo-terminal
#[derive(Args)]
pub(super) struct UnixOnlyArgs {
    /// Whatever it would be called with
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    _rest: Vec<String>,
}

#[derive(Debug, Error, Diagnostic)]
#[error("`host-cal {0}` needs a pseudo-terminal, which this system does not have")]
#[diagnostic(help("Run it on Linux or macOS, or on Windows in the Windows Subsystem for Linux."))]
struct UnixOnly(&'static str);

impl UnixOnlyArgs {
    pub(super) fn run(&self, command: &'static str) -> Result<Outcome, CommandError> {
        Err(UnixOnly(command).into())
    }
}
