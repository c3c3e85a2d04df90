//! `host-cal log`: check and export the log of a session.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde::Serialize;

use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print};
use crate::session::{LogExportError, LogFormat, LogReader, LogSummary, export_log};

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
        after_help = "Examples:\n  host-cal log export today --csv today.csv\n  host-cal log export today --parquet today.parquet --mcap today.mcap\n\nCSV and Parquet hold every sample as a row, for pandas, DuckDB and others. MCAP holds samples, settled poses, tool poses\nand what happened, for Foxglove. All files are written, or none."
    )]
    Export {
        /// A session's directory, or its stream.bbl
        session: PathBuf,
        #[command(flatten)]
        files: ExportFiles,
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
}

impl LogArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        match &self.what {
            LogCommand::Check { session, output } => check(session, output.json),
            LogCommand::Export { session, files, output } => export(session, files, output.json),
        }
    }
}

fn check(session: &Path, json: bool) -> Result<Outcome, CommandError> {
    let mut reader = LogReader::open(session)?;
    let summary = LogSummary::read(&mut reader)?;
    let report = CheckReport { log: reader.path().display().to_string(), summary };
    print(&report, json)?;
    Ok(if report.is_whole() { Outcome::Good } else { Outcome::Doubtful })
}

fn export(session: &Path, files: &ExportFiles, json: bool) -> Result<Outcome, CommandError> {
    let log = LogReader::open(session)?.path().display().to_string();
    let exported = export_log(session, &files.named()).map_err(|error| match error {
        LogExportError::Write(error) => CommandError::output(error),
        LogExportError::Log(_) | LogExportError::SameFile { .. } => error.into(),
    })?;
    let report =
        ExportReport { log, files, samples: exported.samples, settled: exported.settled, tool_poses: exported.tool_poses };
    print(&report, json)?;
    Ok(Outcome::Good)
}

impl ExportFiles {
    /// The files that were asked for.
    fn named(&self) -> Vec<(LogFormat, PathBuf)> {
        let all = [(LogFormat::Csv, &self.csv), (LogFormat::Parquet, &self.parquet), (LogFormat::Mcap, &self.mcap)];
        all.into_iter().filter_map(|(format, path)| Some((format, path.clone()?))).collect()
    }
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

impl Report for ExportReport<'_> {
    fn text(&self) -> String {
        let Self { log, samples, settled, tool_poses, .. } = self;
        let named = |(format, path): (LogFormat, PathBuf)| match format {
            LogFormat::Csv | LogFormat::Parquet => format!("{}: {samples} samples\n", path.display()),
            LogFormat::Mcap => {
                format!("{}: {samples} samples, {settled} settled poses, {tool_poses} tool poses\n", path.display())
            }
        };
        format!("of {log}:\n") + &self.files.named().into_iter().map(named).collect::<String>()
    }
}
