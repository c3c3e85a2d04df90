//! `host-cal log`: check and export the log of a session.

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use clap::{Args, Subcommand};
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print};
use crate::session::{ExportError, LogReader, LogSummary, export_csv};

/// Check or export the log of a session (stream.bbl)
#[derive(Args)]
pub(super) struct LogArgs {
    #[command(subcommand)]
    what: LogCommand,
}

#[derive(Subcommand)]
enum LogCommand {
    /// Read a log to its end and say what it holds and what it lacks
    #[command(after_help = "Example:\n  host-cal log check today\n\nExit code 1 when something is missing or damaged.")]
    Check {
        /// A session's directory, or its stream.bbl
        session: PathBuf,
        #[command(flatten)]
        output: OutputArgs,
    },
    /// Write every sample as a line of a table
    #[command(after_help = "Example:\n  host-cal log export today --csv today.csv")]
    Export {
        /// A session's directory, or its stream.bbl
        session: PathBuf,
        /// Table to write
        #[arg(long, value_name = "FILE")]
        csv: PathBuf,
        #[command(flatten)]
        output: OutputArgs,
    },
}

#[derive(Debug, Error, Diagnostic)]
#[error("{}: cannot be written: {error}", path.display())]
struct TableError {
    path: PathBuf,
    error: std::io::Error,
}

#[derive(Serialize)]
struct CheckReport {
    log: String,
    #[serde(flatten)]
    summary: LogSummary,
}

#[derive(Serialize)]
struct ExportReport {
    log: String,
    csv: String,
    samples: u64,
}

impl LogArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        match &self.what {
            LogCommand::Check { session, output } => check(session, output.json),
            LogCommand::Export { session, csv, output } => export(session, csv, output.json),
        }
    }
}

fn check(session: &std::path::Path, json: bool) -> Result<Outcome, CommandError> {
    let mut reader = LogReader::open(session)?;
    let summary = LogSummary::read(&mut reader)?;
    let report = CheckReport { log: reader.path().display().to_string(), summary };
    print(&report, json)?;
    Ok(if report.is_whole() { Outcome::Good } else { Outcome::Doubtful })
}

/// Writes the table under a temporary name and renames it.
fn export(session: &std::path::Path, csv: &std::path::Path, json: bool) -> Result<Outcome, CommandError> {
    let mut reader = LogReader::open(session)?;
    let failed = |error| CommandError::output(TableError { path: csv.to_owned(), error });
    let folder = csv.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(std::path::Path::new("."));
    let file = tempfile::Builder::new().prefix(".host-cal-").tempfile_in(folder).map_err(failed)?;
    let mut out = BufWriter::new(file);
    let samples = export_csv(&mut reader, &mut out).map_err(|error| match error {
        ExportError::Log(error) => error.into(),
        ExportError::Write(error) => failed(error),
    })?;
    out.flush().map_err(failed)?;
    let file = out.into_inner().map_err(|error| failed(error.into_error()))?;
    file.persist(csv).map_err(|error| failed(error.error))?;
    let report = ExportReport { log: reader.path().display().to_string(), csv: csv.display().to_string(), samples };
    print(&report, json)?;
    Ok(Outcome::Good)
}

impl CheckReport {
    fn is_whole(&self) -> bool {
        let LogSummary { damaged, gaps, losses, .. } = self.summary;
        damaged + gaps + losses.missing + losses.overruns == 0
    }
}

impl Report for CheckReport {
    fn text(&self) -> String {
        let LogSummary { frames, damaged, unfinished_bytes, runs, gaps, samples, settled, poses, duration_s, losses } =
            &self.summary;
        let mut text = format!(
            "{}: {frames} whole frames in {runs} runs, {duration_s:.1} s\n{samples} samples, {settled} settled poses, {poses} tool poses\n",
            self.log
        );
        if *unfinished_bytes > 0 {
            text += &format!("the last frame is cut off after {unfinished_bytes} bytes: the program was ended while it wrote\n");
        }
        if self.is_whole() {
            return text + "nothing is missing\n";
        }
        text += &format!(
            "MISSING: {} messages ({} dropped by the board, {} lost on the line), {} samples by overrun; {damaged} damaged frames, {gaps} times without a port\n",
            losses.missing, losses.dropped_by_board, losses.lost_on_line, losses.overruns
        );
        text
    }
}

impl Report for ExportReport {
    fn text(&self) -> String {
        format!("{} samples of {} written to {}\n", self.samples, self.log, self.csv)
    }
}
