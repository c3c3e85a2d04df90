//! The `host-cal` command: parses its arguments, runs the subcommand, shows what went wrong.

use std::io::IsTerminal;
use std::process::ExitCode;

use host_cal::cmd::Cli;
use host_cal::terminal::show_error;
use miette::{GraphicalTheme, MietteHandlerOpts};

#[expect(clippy::disallowed_methods, reason = "stderr is only asked whether it is a terminal")]
fn main() -> ExitCode {
    // Colour and the terminal's width where there is one; the same plain text everywhere else.
    let hook = miette::set_hook(Box::new(|_| {
        let options = MietteHandlerOpts::new();
        let options = if std::io::stderr().is_terminal() {
            options
        } else {
            options.graphical_theme(GraphicalTheme::unicode_nocolor()).width(110)
        };
        Box::new(options.build())
    }));
    debug_assert!(hook.is_ok(), "nothing else sets the hook");

    match Cli::from_args().run() {
        Ok(outcome) => outcome.into(),
        Err(error) => {
            show_error(error.report);
            ExitCode::from(error.exit_code)
        }
    }
}
