//! `host-cal log`: check and export the log of a session.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde::Serialize;

use super::inputs::{ForceArgs, OutputArgs};
use super::outcome::{CommandError, INTERRUPTED, Outcome};
use super::port::EndRequest;
use super::report::{Report, print, warn};
use crate::board::StreamLosses;
use crate::session::{LogExportError, LogFormat, LogReader, LogSummary, export_log};
use crate::text::{one_line, shown_path};

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
    /// Write what a log holds for other programs: a table of its samples, or everything as timed messages
    #[command(
        after_help = "Examples:\n  host-cal log export today --csv today.csv\n  host-cal log export today --parquet today.parquet --mcap today.mcap\n\nCSV and Parquet hold every sample as a row, for pandas, DuckDB and others. MCAP holds samples, settled poses, tool poses and what happened, for Foxglove. Files are put in place when all have been written.\n\nExit code 1 when something of the log is missing or damaged, 130 at Ctrl-C."
    )]
    Export {
        /// A session's directory, or its stream.bbl
        session: PathBuf,
        #[command(flatten)]
        files: ExportFiles,
        #[command(flatten)]
        replace: ForceArgs,
        #[command(flatten)]
        output: OutputArgs,
    },
}

/// What to write; one at least.
#[derive(Args, Serialize)]
#[group(required = true, multiple = true)]
struct ExportFiles {
    /// Samples as lines of text
    #[arg(long, value_name = "FILE")]
    #[serde(skip_serializing_if = "Option::is_none")]
    csv: Option<PathBuf>,
    /// Samples as typed columns
    #[arg(long, value_name = "FILE")]
    #[serde(skip_serializing_if = "Option::is_none")]
    parquet: Option<PathBuf>,
    /// Samples, settled poses, tool poses and what happened as timed messages
    #[arg(long, value_name = "FILE")]
    #[serde(skip_serializing_if = "Option::is_none")]
    mcap: Option<PathBuf>,
}

#[derive(Serialize)]
struct CheckReport {
    log: String,
    #[serde(flatten)]
    summary: LogSummary,
}

#[derive(Serialize)]
struct ExportReport<'a> {
    log: String,
    #[serde(flatten)]
    files: &'a ExportFiles,
    samples: u64,
    settled: u64,
    tool_poses: u64,
    damaged: u64,
    gaps: u64,
    losses: StreamLosses,
}

impl LogArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        match &self.what {
            LogCommand::Check { session, output } => check(session, output.json),
            LogCommand::Export { session, files, replace, output } => export(session, files, replace.force, output.json),
        }
    }
}

fn check(session: &Path, json: bool) -> Result<Outcome, CommandError> {
    let mut reader = LogReader::open(session)?;
    let summary = LogSummary::read(&mut reader)?;
    let report = CheckReport { log: reader.path().display().to_string(), summary };
    print(&report, json)?;
    Ok(outcome(&report.summary))
}

fn export(session: &Path, files: &ExportFiles, force: bool, json: bool) -> Result<Outcome, CommandError> {
    let log = LogReader::open(session)?.path().display().to_string();
    let end = EndRequest::listen();
    let summary = export_log(session, &files.named(), force, &|| end.is_made()).map_err(|error| match error {
        LogExportError::Write(error) => CommandError::not_written(error),
        LogExportError::Interrupted => CommandError { exit_code: INTERRUPTED, ..error.into() },
        LogExportError::Log(_) => error.into(),
    })?;
    let LogSummary { samples, settled, poses: tool_poses, damaged, gaps, losses, .. } = summary;
    print(&ExportReport { log, files, samples, settled, tool_poses, damaged, gaps, losses }, json)?;
    if !summary.is_whole() {
        warn(&missing(&summary));
    }
    Ok(outcome(&summary))
}

fn outcome(summary: &LogSummary) -> Outcome {
    if summary.is_whole() { Outcome::Good } else { Outcome::Doubtful }
}

/// What a log lacks, in words.
fn missing(LogSummary { damaged, gaps, losses, .. }: &LogSummary) -> String {
    let StreamLosses { missing, dropped_by_board, lost_on_line, overruns, refused, .. } = losses;
    let refused = if refused.lost() > 0 { format!("; REFUSED: {refused}") } else { String::new() };
    format!(
        "MISSING: {missing} messages ({dropped_by_board} dropped by the board, {lost_on_line} lost on the line), {overruns} samples by overrun; {damaged} damaged frames, {gaps} times without a port{refused}"
    )
}

impl ExportFiles {
    /// The files that were asked for.
    fn named(&self) -> Vec<(LogFormat, PathBuf)> {
        let all = [(LogFormat::Csv, &self.csv), (LogFormat::Parquet, &self.parquet), (LogFormat::Mcap, &self.mcap)];
        all.into_iter().filter_map(|(format, path)| Some((format, path.clone()?))).collect()
    }
}

impl Report for CheckReport {
    fn text(&self) -> String {
        let LogSummary { frames, unfinished_bytes, runs, samples, settled, poses, duration_s, .. } = &self.summary;
        let mut text = format!(
            "{}: {frames} whole frames in {runs} runs, {duration_s:.1} s\n{samples} samples, {settled} settled poses, {poses} tool poses\n",
            one_line(&self.log)
        );
        if *unfinished_bytes > 0 {
            text += &format!("the last frame is cut off after {unfinished_bytes} bytes: the program was ended while it wrote\n");
        }
        let rest = if self.summary.is_whole() { "nothing is missing".to_owned() } else { missing(&self.summary) };
        text + &rest + "\n"
    }
}

impl Report for ExportReport<'_> {
    fn text(&self) -> String {
        let Self { log, samples, settled, tool_poses, .. } = self;
        let named = |(format, path): (LogFormat, PathBuf)| match format {
            LogFormat::Csv | LogFormat::Parquet => format!("{}: {samples} samples\n", shown_path(&path)),
            LogFormat::Mcap => {
                format!("{}: {samples} samples, {settled} settled poses, {tool_poses} tool poses\n", shown_path(&path))
            }
        };
        format!("of {}:\n", one_line(log)) + &self.files.named().into_iter().map(named).collect::<String>()
    }
}
