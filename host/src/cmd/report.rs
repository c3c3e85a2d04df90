//! What a command found, for people and for machines, from one place.

use std::io::{IsTerminal, Write, stderr, stdout};
use std::path::Path;

use indicatif::{ProgressBar, ProgressStyle};
use miette::{Diagnostic, Report as MietteReport};
use serde::Serialize;
use thiserror::Error;

use super::outcome::CommandError;
use crate::assess::{Assessment, Evidence};
use crate::files::write_atomically;

/// A result that can be shown as text and as JSON.
pub(super) trait Report: Serialize {
    /// For people, ended by a newline.
    fn text(&self) -> String;
}

#[derive(Debug, Error, Diagnostic)]
#[error("the result cannot be printed: {0}")]
struct PrintError(String);

/// Prints a report to stdout: one JSON document, or text.
pub(super) fn print(report: &impl Report, json: bool) -> Result<(), CommandError> {
    let text = if json {
        let document =
            serde_json::to_string_pretty(report).map_err(|error| CommandError::output(PrintError(error.to_string())))?;
        document + "\n"
    } else {
        report.text()
    };
    match stdout().write_all(text.as_bytes()).and_then(|()| stdout().flush()) {
        // A reader that has seen enough, like `head`, is no failure.
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(CommandError::output(PrintError(error.to_string()))),
        _ => Ok(()),
    }
}

/// Writes a file by rename.
pub(super) fn write_file(path: &Path, contents: &str) -> Result<(), CommandError> {
    write_atomically(path, contents).map_err(CommandError::output)
}

#[derive(Debug, Error, Diagnostic)]
#[error("{0}: the robot's text cannot be edited: {1}")]
struct EditError(String, String);

/// Writes the robot's file with what is worth keeping of a fit and a `[calibration]` table; whether there was anything.
pub(super) fn write_calibrated(path: &Path, evidence: &Evidence<'_>, assessment: &Assessment) -> Result<bool, CommandError> {
    let Some((chain, calibration)) = assessment.calibration(evidence) else { return Ok(false) };
    let robot = evidence.robot;
    let broken = |error: toml_edit::TomlError| CommandError::output(EditError(robot.source_name().to_owned(), error.to_string()));
    write_file(path, &robot.calibrated_toml(chain, &calibration).map_err(broken)?)?;
    Ok(true)
}

/// Says something that is no result and no error.
pub(super) fn warn(message: &str) {
    let _ = writeln!(stderr(), "warning: {message}");
}

/// A progress bar on stderr, drawn only where that is a terminal.
pub(super) fn progress(steps: u64, what: &'static str) -> ProgressBar {
    if !stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style =
        ProgressStyle::with_template("{msg:28} {wide_bar} {pos}/{len} {eta:>4}").unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(steps).with_style(style).with_message(what)
}

/// Shows an error on stderr.
pub fn show_error(report: &MietteReport) {
    let _ = writeln!(stderr(), "{report:?}");
}
