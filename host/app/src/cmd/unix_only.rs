//! What stands in for commands that this system cannot run, under the same names, so that it can say why.

use clap::Args;
use miette::Diagnostic;
use thiserror::Error;

use super::outcome::{CommandError, Outcome};

pub(super) mod virtual_board {
    use super::*;

    /// Linux and macOS only: it needs a pseudo-terminal
    #[derive(Args)]
    pub(in crate::cmd) struct VirtualBoardArgs {
        #[command(flatten)]
        _whatever: Whatever,
    }

    impl VirtualBoardArgs {
        pub(in crate::cmd) fn run(&self) -> Result<Outcome, CommandError> {
            Err(UnixOnly("virtual-board").into())
        }
    }
}

pub(super) mod demo {
    use super::*;

    /// Linux and macOS only: it needs a pseudo-terminal
    #[derive(Args)]
    pub(in crate::cmd) struct DemoArgs {
        #[command(flatten)]
        _whatever: Whatever,
    }

    impl DemoArgs {
        pub(in crate::cmd) fn run(&self) -> Result<Outcome, CommandError> {
            Err(UnixOnly("demo").into())
        }
    }
}

#[derive(Args)]
struct Whatever {
    /// Whatever it would be called with
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    _rest: Vec<String>,
}

#[derive(Debug, Error, Diagnostic)]
#[error("`host-cal {0}` needs a pseudo-terminal, which this system does not have")]
#[diagnostic(help("Run it on Linux or macOS, or on Windows in the Windows Subsystem for Linux."))]
struct UnixOnly(&'static str);
