//! `host-cal log`: check and export the log of a session.

use std::io::BufWriter;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use serde::Serialize;

use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print};
use crate::files::write_atomically_with;
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
    let (mut samples, mut unreadable) = (0, None);
    write_atomically_with(csv, |file| {
        match export_csv(&mut reader, &mut BufWriter::new(file)) {
            Ok(lines) => samples = lines,
            Err(ExportError::Write(error)) => return Err(error),
            Err(ExportError::Log(error)) => {
                unreadable = Some(error);
                return Err(std::io::Error::other("the log cannot be read"));
            }
        }
        Ok(())
    })
    .map_err(|error| unreadable.take().map_or_else(|| CommandError::output(error), CommandError::from))?;
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
