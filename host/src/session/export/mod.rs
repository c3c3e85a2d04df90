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
use crate::files::{PendingFile, WriteError, commit_all};
use entry::{Entry, Writer};
use shape::Shape;
use table::TableName;
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

/// What was exported.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exported {
    /// Samples.
    pub samples: u64,
    /// Settled poses; only MCAP holds them.
    pub settled: u64,
    /// Tool poses; only MCAP holds them.
    pub tool_poses: u64,
}

/// Why a log could not be exported. No file was written or changed then.
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
    /// Two outputs in one file, or one that would take the log's place.
    #[error("{}: is named twice, as an output and as {other}", path.display())]
    #[diagnostic(help("Give every file a name of its own."))]
    SameFile {
        /// The file.
        path: PathBuf,
        /// What else it is to be.
        other: &'static str,
    },
}

/// Exports a log, or the log in a session's directory. All files are written, or none.
///
/// # Errors
/// [`LogExportError`].
pub fn export_log(log: &Path, outputs: &[(LogFormat, PathBuf)]) -> Result<Exported, LogExportError> {
    let shape = Shape::read(&mut LogReader::open(log)?)?;
    let mut reader = LogReader::open(log)?;
    check_names(reader.path(), outputs)?;
    let mut files: Vec<PendingFile> = outputs.iter().map(|(_, path)| PendingFile::begin(path)).collect::<Result<_, _>>()?;
    let exported = write_all(&mut reader, &shape, outputs, &mut files)?;
    commit_all(files)?;
    Ok(exported)
}

fn check_names(log: &Path, outputs: &[(LogFormat, PathBuf)]) -> Result<(), LogExportError> {
    for (i, (_, path)) in outputs.iter().enumerate() {
        let other = if is_same(path, log) {
            "the log"
        } else if outputs[..i].iter().any(|(_, earlier)| is_same(path, earlier)) {
            "another output"
        } else {
            continue;
        };
        return Err(LogExportError::SameFile { path: path.clone(), other });
    }
    Ok(())
}

/// Whether two names mean one file, as far as that can be told before it is there.
fn is_same(a: &Path, b: &Path) -> bool {
    a == b || matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

fn write_all(
    reader: &mut LogReader,
    shape: &Shape,
    outputs: &[(LogFormat, PathBuf)],
    files: &mut [PendingFile],
) -> Result<Exported, LogExportError> {
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
    let exported = tell_all(reader, shape, |entry| {
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
    mut tell: impl FnMut(&Entry) -> Result<(), WriteError>,
) -> Result<Exported, LogExportError> {
    let mut exported = Exported::default();
    let mut teller = Teller::new(shape);
    for _ in 0..shape.records {
        let Some(record) = reader.next_record()? else { break };
        teller.take(record, &mut |entry: &Entry| {
            match entry {
                Entry::Row { table: TableName::Samples, .. } => exported.samples += 1,
                Entry::Row { table: TableName::Settled, .. } => exported.settled += 1,
                Entry::ToolPose { .. } => exported.tool_poses += 1,
                Entry::Row { table: TableName::Bar, .. } | Entry::Note { .. } => {}
            }
            tell(entry)
        })?;
    }
    Ok(exported)
}
