//! `host-cal completions`: what a shell needs to complete this command.

use clap::{Args, Command};
use clap_complete::Shell;
use serde::Serialize;

use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print};
use crate::help::completion_script;

/// Print a completion script for a shell
#[derive(Args)]
#[command(
    after_help = "Examples:\n  host-cal completions bash > ~/.local/share/bash-completion/completions/host-cal\n  host-cal completions zsh > ~/.zfunc/_host-cal\n  host-cal completions fish > ~/.config/fish/completions/host-cal.fish\n\nFor zsh, ~/.zfunc has to be in fpath before compinit runs. bash completes names of built-in robots and rigs beside files."
)]
pub(super) struct CompletionsArgs {
    /// Shell to write it for
    #[arg(value_enum)]
    shell: Shell,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct CompletionsReport {
    shell: String,
    script: String,
}

impl CompletionsArgs {
    /// Prints the script for `command`, which is the whole of `host-cal`.
    pub(super) fn run(&self, command: Command) -> Result<Outcome, CommandError> {
        let script = completion_script(command, self.shell);
        print(&CompletionsReport { shell: self.shell.to_string(), script }, self.output.json)?;
        Ok(Outcome::Good)
    }
}

impl Report for CompletionsReport {
    fn text(&self) -> String {
        self.script.clone()
    }

    fn is_document(&self) -> bool {
        true
    }
}
