//! What a command found, for people and for machines, from one place.

use std::path::Path;

use ballbar_calib::assess::{Assessment, Evidence};
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::outcome::CommandError;
use crate::documents::ResidualLine;
use crate::files::{self, CalibratedError, FilesError, NamedFile, Output, Source};
use crate::terminal::out;
pub(super) use crate::terminal::out::warn;
use crate::terminal::table::{Columns, fixed};
use crate::text::visible_json;

/// A result that can be shown as text and as JSON.
pub(super) trait Report: Serialize {
    /// For people, ended by a newline.
    fn text(&self) -> String;

    /// Whether the text is the very file that other programs take.
    fn is_document(&self) -> bool {
        false
    }
}

#[derive(Debug, Error, Diagnostic)]
#[error("the result cannot be printed: {0}")]
struct PrintError(String);

/// Prints a report to stdout: one JSON document, or text.
pub(super) fn print(report: &impl Report, json: bool) -> Result<(), CommandError> {
    let failed = |reason: String| CommandError::output(PrintError(reason));
    let printed = if json {
        let document = serde_json::to_string_pretty(report).map_err(|error| failed(error.to_string()))?;
        out::print_text(&(visible_json(&document) + "\n"))
    } else if report.is_document() {
        out::print_document(&report.text())
    } else {
        out::print_text(&report.text())
    };
    printed.map_err(|error| failed(error.to_string()))
}

/// Writes a file that was asked for.
pub(super) fn write_file(output: Output<'_>, contents: &str) -> Result<(), CommandError> {
    output.write(contents).map_err(CommandError::not_written)
}

/// Writes files that were asked for, as [`files::write_files`].
pub(super) fn write_files(files: &[NamedFile], force: bool) -> Result<(), CommandError> {
    files::write_files(files, force).map_err(|error| match error {
        FilesError::Folder(error) => CommandError::output(error),
        FilesError::Write(error) => CommandError::not_written(error),
    })
}

/// Writes a robot's file with what is worth keeping of a fit, as [`files::write_calibrated`]; whether there was anything.
pub(super) fn write_calibrated(
    path: &Path,
    force: bool,
    design: &Source,
    evidence: &Evidence<'_>,
    assessment: &Assessment,
) -> Result<bool, CommandError> {
    files::write_calibrated(path, force, design, evidence, assessment).map_err(|error| match error {
        CalibratedError::Edit { .. } => CommandError::output(error),
        CalibratedError::Write(error) => CommandError::not_written(error),
    })
}

/// A table of the largest residuals.
pub(super) fn largest_text(lines: &[ResidualLine]) -> String {
    let mut table = Columns::new(&["row", "<at", "<pairing", "residual mm"]);
    for line in lines {
        table.row([line.row.to_string(), line.place.clone(), line.pairing.clone(), fixed(line.residual_mm, 4)]);
    }
    table.text()
}
