//! What a shell needs to complete a command.

use clap::{Command, ValueHint};
use clap_complete::Shell;

use crate::files::{RIGS, ROBOTS};

/// The script for a shell to complete `command`.
pub fn completion_script(command: Command, shell: Shell) -> String {
    let mut command = with_names(command, shell);
    let name = command.get_name().to_owned();
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut command, name, &mut script);
    let script = String::from_utf8_lossy(&script).into_owned();
    if shell != Shell::Bash {
        return script;
    }
    // The generator spells a hyphen in the command's own name in two ways, and completes nothing behind a subcommand then
    // (https://github.com/clap-rs/clap/issues/6421).
    script.replace("host__subcmd__cal__", "host__cal__")
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
