//! A session's log for other programs: CSV and Parquet hold its samples as a table, MCAP holds everything.
//!
//! ```text
//! stream.bbl ── Shape (first reading: which columns?) ─┐
//!      └─────── Teller (second reading) ── Entry ──────┴─▶ Writer: csv, parquet, mcap
//! ```
//!
//! A log may begin before its board had parameters, and go on with another robot's: only its end tells which columns it needs. So
//! it is read twice, and never held in memory.

mod csv;
mod entry;
mod mcap;
mod parquet;
mod shape;
mod table;
mod teller;

use std::path::{Path, PathBuf};

use miette::Diagnostic;
use thiserror::Error;

use super::log::{LogError, LogReader};
use super::summary::{LogSummary, Summing};
use super::{DESCRIPTION_NAME, LOCK_NAME, PLAN_NAME, POSES_NAME, RIG_NAME, ROBOT_NAME};
use crate::files::{PendingFile, WriteError, commit_all};
use entry::{Entry, Writer};
use shape::Shape;
use teller::Teller;

/// Files of a session beside its log.
const SESSION_NAMES: [&str; 6] = [DESCRIPTION_NAME, POSES_NAME, PLAN_NAME, ROBOT_NAME, RIG_NAME, LOCK_NAME];

/// A format that a log can be exported to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogFormat {
    /// The samples, a line each.
    Csv,
    /// The samples, as typed columns.
    Parquet,
    /// Samples, settled poses, tool poses and what happened, as timed messages.
    Mcap,
}

/// Why a log could not be exported. No file was written or changed then, but those that [`WriteError`] names.
#[derive(Debug, Error, Diagnostic)]
pub enum LogExportError {
    /// The log.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Log(#[from] LogError),
    /// A file.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Write(#[from] WriteError),
    /// The user wants to end.
    #[error("ended by Ctrl-C or a signal")]
    #[diagnostic(help("Nothing was written."))]
    Interrupted,
    /// Two outputs in one file, or one that would take the place of a file of the session.
    #[error("{}: is named twice, as an output and as {other}", path.display())]
    #[diagnostic(help("Give every file a name of its own."))]
    SameFile {
        /// The file.
        path: PathBuf,
        /// What else it is to be.
        other: &'static str,
    },
}

/// Exports a log, or the log in a session's directory, until `is_ended`. Files are put in place when all have been written. Returns
/// what was exported; settled poses and tool poses are in MCAP only.
///
/// # Errors
/// [`LogExportError`].
pub fn export_log(
    log: &Path,
    outputs: &[(LogFormat, PathBuf)],
    is_ended: &dyn Fn() -> bool,
) -> Result<LogSummary, LogExportError> {
    let mut reader = LogReader::open(log)?;
    check_names(reader.path(), outputs)?;
    let mut files: Vec<PendingFile> = outputs.iter().map(|(_, path)| PendingFile::begin(path)).collect::<Result<_, _>>()?;
    let shape = Shape::read(&mut LogReader::open(log)?, is_ended)?;
    let exported = write_all(&mut reader, &shape, outputs, &mut files, is_ended)?;
    commit_all(files)?;
    Ok(exported)
}

fn check_names(log: &Path, outputs: &[(LogFormat, PathBuf)]) -> Result<(), LogExportError> {
    for (i, (_, path)) in outputs.iter().enumerate() {
        let place = place_of(path);
        let other = if place == place_of(log) {
            "the log"
        } else if SESSION_NAMES.iter().any(|name| place == place_of(&log.with_file_name(name))) {
            "a file of the session"
        } else if outputs[..i].iter().any(|(_, earlier)| place == place_of(earlier)) {
            "another output"
        } else {
            continue;
        };
        return Err(LogExportError::SameFile { path: path.clone(), other });
    }
    Ok(())
}

/// What a name stands for, so that two names of one file are the same: links followed, and of a file that is not there yet those to
/// its folder.
fn place_of(path: &Path) -> PathBuf {
    let new = || {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    };
    path.canonicalize().ok().or_else(new).unwrap_or_else(|| path.to_owned())
}

fn write_all(
    reader: &mut LogReader,
    shape: &Shape,
    outputs: &[(LogFormat, PathBuf)],
    files: &mut [PendingFile],
    is_ended: &dyn Fn() -> bool,
) -> Result<LogSummary, LogExportError> {
    let mut writers: Vec<(&Path, Box<dyn Writer + '_>)> = Vec::new();
    for ((format, path), file) in outputs.iter().zip(files) {
        let file = std::io::BufWriter::new(file.file_mut());
        let writer: std::io::Result<Box<dyn Writer>> = match format {
            LogFormat::Csv => csv::CsvWriter::new(file, shape).map(|writer| Box::new(writer) as Box<dyn Writer>),
            LogFormat::Parquet => parquet::ParquetWriter::new(file, shape).map(|writer| Box::new(writer) as Box<dyn Writer>),
            LogFormat::Mcap => mcap::McapWriter::new(file, shape).map(|writer| Box::new(writer) as Box<dyn Writer>),
        };
        writers.push((path, writer.map_err(|error| WriteError::new(path, error))?));
    }
    let exported = tell_all(reader, shape, is_ended, |entry| {
        writers.iter_mut().try_for_each(|(path, writer)| writer.take(entry).map_err(|error| WriteError::new(path, error)))
    })?;
    for (path, writer) in writers {
        writer.finish().map_err(|error| WriteError::new(path, error))?;
    }
    Ok(exported)
}

/// Tells the entries of a log, as far as it was there when its shape was found: a program may be recording into it.
fn tell_all(
    reader: &mut LogReader,
    shape: &Shape,
    is_ended: &dyn Fn() -> bool,
    mut tell: impl FnMut(&Entry) -> Result<(), WriteError>,
) -> Result<LogSummary, LogExportError> {
    let mut summing = Summing::default();
    let mut teller = Teller::new(shape);
    for _ in 0..shape.records {
        let Some(record) = reader.next_record()? else { break };
        if is_ended() {
            return Err(LogExportError::Interrupted);
        }
        summing.take(&record);
        teller.take(record, &mut tell)?;
    }
    Ok(summing.end(reader))
}
