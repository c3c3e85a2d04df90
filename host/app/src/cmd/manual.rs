//! `host-cal manual`: manual pages, made from the same arguments and help as everything else.

use std::path::PathBuf;

use clap::{Args, Command};
use clap_mangen::Man;
use clap_mangen::roff::{Roff, roman};
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::inputs::{ForceArgs, OutputArgs};
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print, write_files};
use crate::files::FileKind;
use crate::text::shown_path;

/// Print a manual page, or write those of all commands
#[derive(Args)]
#[command(
    after_help = "Examples:\n  host-cal manual fit | man -l -\n  host-cal manual --out ~/.local/share/man/man1\n\nThe folder is made when it is not there. `man host-cal-log-export` then shows the page of `host-cal log export`."
)]
pub(super) struct ManualArgs {
    /// Command whose page to print, such as: log export; without it, that of host-cal
    #[arg(conflicts_with = "out")]
    command: Vec<String>,
    /// Folder to write the pages of all commands to
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    replace: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Why there is no page.
#[derive(Debug, Error, Diagnostic)]
enum ManualError {
    #[error("there is no command `{0}`")]
    #[diagnostic(help("`host-cal help` lists the commands."))]
    NoCommand(String),
}

#[derive(Serialize)]
struct ManualReport {
    #[serde(skip_serializing_if = "Option::is_none")]
    out: Option<PathBuf>,
    /// Names of the files.
    pages: Vec<String>,
    /// The page, where it was not written.
    #[serde(skip_serializing_if = "Option::is_none")]
    text: Option<String>,
}

impl ManualArgs {
    /// Prints or writes pages of `command`, which is the whole of `host-cal`.
    pub(super) fn run(&self, command: Command) -> Result<Outcome, CommandError> {
        // A page for `help` would only repeat the others.
        let mut command = command.disable_help_subcommand(true);
        command.build();
        let report = match &self.out {
            Some(folder) => {
                let pages = all_pages(&command);
                let names = pages.iter().map(|(name, _)| name.clone()).collect();
                let file = |(name, text): (String, String)| (folder.join(name), FileKind::ManualPage, text);
                write_files(&pages.into_iter().map(file).collect::<Vec<_>>(), self.replace.force)?;
                ManualReport { out: self.out.clone(), pages: names, text: None }
            }
            None => {
                let (name, text) = page(self.find(&command)?);
                ManualReport { out: None, pages: vec![name], text: Some(text) }
            }
        };
        print(&report, self.output.json)?;
        Ok(Outcome::Good)
    }

    fn find<'a>(&self, command: &'a Command) -> Result<&'a Command, ManualError> {
        self.command.iter().try_fold(command, |command, name| {
            command.find_subcommand(name).ok_or_else(|| ManualError::NoCommand(self.command.join(" ")))
        })
    }
}

/// The pages of a command and of all that it has.
fn all_pages(command: &Command) -> Vec<(String, String)> {
    let shown = command.get_subcommands().filter(|subcommand| !subcommand.is_hide_set());
    std::iter::once(page(command)).chain(shown.flat_map(all_pages)).collect()
}

/// Name and text of a command's page.
fn page(command: &Command) -> (String, String) {
    let man = Man::new(command.clone())
        .source(concat!("host-cal ", env!("CARGO_PKG_VERSION")))
        .manual("Robot calibration with a ball-bar");
    let mut text = Vec::new();
    // Written to memory, which never fails.
    let written = man
        .render_title(&mut text)
        .and_then(|()| man.render_name_section(&mut text))
        .and_then(|()| man.render_synopsis_section(&mut text))
        .and_then(|()| man.render_description_section(&mut text))
        .and_then(|()| if has_options(command) { man.render_options_section(&mut text) } else { Ok(()) })
        .and_then(|()| if has_commands(command) { man.render_subcommands_section(&mut text) } else { Ok(()) })
        .and_then(|()| after_help(command).to_writer(&mut text));
    debug_assert!(written.is_ok(), "memory takes everything");
    (man.get_filename(), in_ascii(&String::from_utf8_lossy(&text)))
}

/// With every other character by its name in roff, since not every formatter takes UTF-8.
fn in_ascii(text: &str) -> String {
    let mut ascii = String::with_capacity(text.len());
    for character in text.chars() {
        if character.is_ascii() {
            ascii.push(character);
        } else {
            ascii += &format!("\\[u{:04X}]", u32::from(character));
        }
    }
    ascii
}

fn has_options(command: &Command) -> bool {
    command.get_arguments().any(|arg| !arg.is_hide_set())
}

fn has_commands(command: &Command) -> bool {
    command.get_subcommands().any(|subcommand| !subcommand.is_hide_set())
}

/// What stands below the options in the help: examples line by line, the rest as text.
fn after_help(command: &Command) -> Roff {
    let mut roff = Roff::default();
    let text = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    for paragraph in text.split("\n\n").filter(|paragraph| !paragraph.trim().is_empty()) {
        if let Some((_, examples)) = paragraph.split_once('\n').filter(|(title, _)| title.starts_with("Example")) {
            roff.control("SH", ["EXAMPLES"]);
            roff.control("nf", []);
            roff.text(examples.lines().map(|line| roman(format!("{}\n", line.trim_start()))).collect::<Vec<_>>());
            roff.control("fi", []);
        } else {
            roff.control("SH", ["NOTES"]);
            roff.text([roman(paragraph)]);
        }
    }
    roff
}

impl Report for ManualReport {
    fn is_document(&self) -> bool {
        self.text.is_some()
    }

    fn text(&self) -> String {
        match (&self.text, &self.out) {
            (Some(text), _) => text.clone(),
            (None, Some(out)) => format!("{} pages are written to {}\n", self.pages.len(), shown_path(out)),
            (None, None) => String::new(),
        }
    }
}
