//! `host-cal completions`: what a shell needs to complete this command.

use clap::{Args, Command, ValueHint};
use clap_complete::Shell;
use serde::Serialize;

use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print};
use crate::files::{RIGS, ROBOTS};

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
        let mut command = with_names(command, self.shell);
        let name = command.get_name().to_owned();
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut command, name, &mut script);
        let mut script = String::from_utf8_lossy(&script).into_owned();
        if self.shell == Shell::Bash {
            // The generator spells a hyphen in the command's own name in two ways, and completes nothing behind a subcommand then
            // (https://github.com/clap-rs/clap/issues/6421).
            script = script.replace("host__subcmd__cal__", "host__cal__");
        }
        print(&CompletionsReport { shell: self.shell.to_string(), script }, self.output.json)?;
        Ok(Outcome::Good)
    }
}

/// Says of every `--robot` and `--rig` what may stand there. The script for bash offers files where none of the given words fits; in
/// the other shells words would shut files out.
fn with_names(command: Command, shell: Shell) -> Command {
    let command = command.mut_args(|arg| {
        let builtin: Vec<&str> = match arg.get_id().as_str() {
            "robot" | "plan_robot" => ROBOTS.iter().map(|(name, _)| *name).collect(),
            "rig" => RIGS.iter().map(|(name, _)| *name).collect(),
            _ => return arg,
        };
        if shell == Shell::Bash { arg.value_parser(builtin) } else { arg.value_hint(ValueHint::FilePath) }
    });
    command.mut_subcommands(|subcommand| with_names(subcommand, shell))
}

impl Report for CompletionsReport {
    fn text(&self) -> String {
        self.script.clone()
    }

    fn is_document(&self) -> bool {
        true
    }
}
