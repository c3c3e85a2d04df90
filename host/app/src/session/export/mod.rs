//! A session's log for other programs: CSV and Parquet hold its samples as a table, MCAP holds everything.
//!
//! ```text
//! stream.bbl ── Shape (first reading: which columns?) ─┐
//!      └─────── Teller (second reading) ── Entry ──────┴─▶ Writer: csv, parquet, mcap
//! ```
//!
//! A log may begin before its board had parameters, and go on with another robot's: only its end tells which columns it needs. So
//! it is read twice, and never held in memory.

mod column;
mod csv;
mod entry;
mod mcap;
mod parquet;
mod shape;
mod stamp;
mod table;
mod teller;

use std::path::{Path, PathBuf};

use miette::Diagnostic;
use thiserror::Error;

use super::log::{LogError, LogReader};
use super::summary::{LogSummary, Summing};
use crate::files::{FileKind, Output, PendingFile, WriteError, commit_all};
use entry::{Entry, Writer};
use shape::Shape;
use teller::Teller;

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

impl LogFormat {
    fn kind(self) -> FileKind {
        match self {
            Self::Csv => FileKind::LogCsv,
            Self::Parquet => FileKind::Parquet,
            Self::Mcap => FileKind::Mcap,
        }
    }
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
}

/// Exports a log, or the log in a session's directory, until `is_ended`. Files are put in place when all have been written. Returns
/// what was exported; settled poses and tool poses are in MCAP only. With `force` files of other kinds are replaced.
///
/// # Errors
/// [`LogExportError`].
pub fn export_log<'a>(
    log: &Path,
    outputs: &'a [(LogFormat, PathBuf)],
    force: bool,
    is_ended: &dyn Fn() -> bool,
) -> Result<LogSummary, LogExportError> {
    let mut reader = LogReader::open(log)?;
    let output = |(format, path): &'a (LogFormat, PathBuf)| Output { path, kind: format.kind(), force };
    let mut files = PendingFile::begin_all(outputs.iter().map(output))?;
    let shape = Shape::read(&mut LogReader::open(log)?, is_ended)?;
    let exported = write_all(&mut reader, &shape, outputs, &mut files, is_ended)?;
    commit_all(files)?;
    Ok(exported)
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
        teller.take(record, reader.losses(), &mut tell)?;
    }
    Ok(summing.end(reader))
}
