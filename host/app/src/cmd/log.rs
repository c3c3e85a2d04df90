//! `host-cal log`: check, recover and export what the log of a session holds.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde::Serialize;

use super::inputs::{ForceArgs, OutputArgs};
use super::outcome::{CommandError, Outcome, lock_error, record_error};
use super::report::{Report, print, warn};
use crate::board::StreamLosses;
use crate::session::{
    Comparison, LOG_NAME, LogExportError, LogFormat, LogReader, LogSummary, MissingPose, SessionLock, export_log, recover,
    session_of,
};
use crate::terminal::{EndRequest, INTERRUPTED};
use crate::text::{one_line, shown_path};

/// Check, recover or export the log of a session (stream.bbl)
#[derive(Args)]
pub(super) struct LogArgs {
    #[command(subcommand)]
    what: LogCommand,
}

#[derive(Subcommand)]
enum LogCommand {
    /// Read a log to its end and say what it holds, what it lacks, and what poses.csv lacks of it
    #[command(after_help = "Example:\n  host-cal log check today\n\nExit code 1 when something is missing or damaged.")]
    Check {
        /// A session's directory, or its stream.bbl
        session: PathBuf,
        #[command(flatten)]
        output: OutputArgs,
    },
    /// Write into poses.csv what it lacks of the log, as the next recording would
    #[command(
        after_help = "Example:\n  host-cal log recover today\n\nPoses that were erased stay so; to take another one out for good, put # before its line in poses.csv."
    )]
    Recover {
        /// A session's directory
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
    /// Of a log in its session.
    #[serde(flatten)]
    comparison: Option<Comparison>,
}

#[derive(Serialize)]
struct RecoverReport {
    session: String,
    poses_recovered: usize,
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
            LogCommand::Recover { session, output } => recover_poses(session, output.json),
            LogCommand::Export { session, files, replace, output } => export(session, files, replace.force, output.json),
        }
    }
}

fn check(log: &Path, json: bool) -> Result<Outcome, CommandError> {
    let mut reader = LogReader::open(log)?;
    let (summary, logged) = LogSummary::read_with_poses(&mut reader)?;
    let comparison = session_of(reader.path()).map(|session| Comparison::new(&session, &logged)).transpose();
    // What can be said of the log is said, whatever poses.csv is.
    let (comparison, unreadable) = comparison.map_or_else(|error| (None, Some(error)), |comparison| (comparison, None));
    let report = CheckReport { log: reader.path().display().to_string(), summary, comparison };
    print(&report, json)?;
    if let Some(error) = unreadable {
        return Err(record_error(error.into()));
    }
    Ok(if report.is_whole() { Outcome::Good } else { Outcome::Doubtful })
}

impl CheckReport {
    fn is_whole(&self) -> bool {
        self.summary.is_whole() && self.comparison.as_ref().is_none_or(Comparison::is_whole)
    }
}

fn recover_poses(session: &Path, json: bool) -> Result<Outcome, CommandError> {
    // Without a log there is nothing to recover, and no directory to be made.
    LogReader::open(&session.join(LOG_NAME))?;
    let lock = SessionLock::acquire(session).map_err(lock_error)?;
    let poses_recovered = recover(&lock).map_err(record_error)?;
    print(&RecoverReport { session: session.display().to_string(), poses_recovered }, json)?;
    Ok(Outcome::Good)
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
    Ok(if summary.is_whole() { Outcome::Good } else { Outcome::Doubtful })
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
        if let Some(Comparison { poses_measured, poses_erased, .. }) = &self.comparison {
            text += &format!("{poses_measured} poses measured for poses.csv");
            text += &if *poses_erased > 0 { format!(", {poses_erased} more erased again\n") } else { "\n".to_owned() };
        }
        if self.is_whole() {
            return text + "nothing is missing\n";
        }
        if !self.summary.is_whole() {
            text += &(missing(&self.summary) + "\n");
        }
        text + &self.comparison.as_ref().map_or_else(String::new, missing_in_poses)
    }
}

/// What poses.csv lacks, in words.
fn missing_in_poses(comparison: &Comparison) -> String {
    const SHOWN: usize = 10;
    let Comparison { session, poses_missing, .. } = comparison;
    if poses_missing.is_empty() {
        return String::new();
    }
    let mut text = format!("MISSING in poses.csv: {} poses\n", poses_missing.len());
    for MissingPose { t_s, chuck, sphere, bar_mm, .. } in poses_missing.iter().take(SHOWN) {
        text += &format!("  {t_s:.6} s, {chuck}:{sphere}, {bar_mm} mm\n");
    }
    text += if poses_missing.len() > SHOWN { "  …\n" } else { "" };
    text + &format!("Write them: host-cal log recover {session}\n")
}
impl Report for RecoverReport {
    fn text(&self) -> String {
        let Self { session, poses_recovered } = self;
        match poses_recovered {
            0 => format!("{session}: poses.csv lacks nothing that the log holds\n"),
            _ => format!("{session}: {poses_recovered} poses written into poses.csv\n"),
        }
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
