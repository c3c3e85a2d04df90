//! `host-cal manual`: prints and writes manual pages.

use std::path::PathBuf;

use clap::{Args, Command};
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::inputs::{ForceArgs, OutputArgs};
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print, write_files};
use crate::files::FileKind;
use crate::help::{all_pages, page};
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
