//! What a command found, for people and for machines, from one place.

use std::path::{Path, PathBuf};

use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use crate::files::{Source, calibrated_toml, calibration};
use crate::terminal::out;

use super::outcome::CommandError;
use crate::files::{FileKind, Output, PendingFile, commit_all, write_atomically};
pub(super) use crate::terminal::out::warn;
use crate::text::visible_json;
use ballbar_calib::assess::{Assessment, Evidence};

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

/// A file's name, what it is, and its contents.
pub(super) type NamedFile = (PathBuf, FileKind, String);

/// Writes files that were asked for: all of them, or none when one may not be written. Folders are made where they are missing.
pub(super) fn write_files(files: &[NamedFile], force: bool) -> Result<(), CommandError> {
    for folder in files.iter().filter_map(|(path, ..)| path.parent()).filter(|folder| !folder.as_os_str().is_empty()) {
        make_folder(folder)?;
    }
    let outputs = files.iter().map(|(path, kind, _)| Output { path, kind: *kind, force });
    let written = || {
        let mut pending = PendingFile::begin_all(outputs)?;
        pending.iter_mut().zip(files).try_for_each(|(file, (.., contents))| file.fill(contents))?;
        commit_all(pending)
    };
    written().map_err(CommandError::not_written)
}

#[derive(Debug, Error, Diagnostic)]
#[error("{}: cannot be made: {error}", folder.display())]
#[diagnostic(help("Give a folder that is there, or that can be made."))]
struct FolderError {
    folder: PathBuf,
    error: std::io::Error,
}

/// Makes a folder, and those above it, where they are missing.
pub(super) fn make_folder(folder: &Path) -> Result<(), CommandError> {
    std::fs::create_dir_all(folder).map_err(|error| CommandError::output(FolderError { folder: folder.to_owned(), error }))
}

/// Writes a file of the session that is being recorded.
pub(super) fn write_session_file(path: &Path, contents: &str) -> Result<(), CommandError> {
    write_atomically(path, contents).map_err(CommandError::output)
}

#[derive(Debug, Error, Diagnostic)]
#[error("{0}: the robot's text cannot be edited: {1}")]
struct EditError(String, String);

/// Writes the robot's file with what is worth keeping of a fit and a `[calibration]` table; whether there was anything.
pub(super) fn write_calibrated(
    path: &Path,
    force: bool,
    source: &Source,
    evidence: &Evidence<'_>,
    assessment: &Assessment,
) -> Result<bool, CommandError> {
    let Some((chain, calibration)) = calibration(evidence, assessment) else { return Ok(false) };
    let broken = |error: toml_edit::TomlError| CommandError::output(EditError(source.name().to_owned(), error.to_string()));
    let text = calibrated_toml(source, chain, &calibration).map_err(broken)?;
    write_file(Output { path, kind: FileKind::Robot, force }, &text)?;
    Ok(true)
}
