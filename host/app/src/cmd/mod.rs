//! The `host-cal` command: one file a subcommand.
//!
//! Every command reads its inputs whole, computes a report and prints it: as text for people, or as the one JSON document of
//! `--json`. Progress and warnings go to stderr.

mod apply;
mod beliefs;
mod collect;
mod compensate;
mod completions;
#[cfg(unix)]
mod demo;
mod exclude;
mod export;
mod fit;
mod fk;
mod hold;
mod hold_out;
mod home;
mod import;
mod inputs;
mod log;
mod lvdt;
mod manual;
mod outcome;
mod pairings;
mod paper;
mod plan;
mod plan_margins;
mod plan_report;
mod port;
mod ports;
mod pose;
mod rank;
mod recorder;
mod report;
mod report_page;
mod session_words;
mod simulate;
mod status;
mod stream;
#[cfg(not(unix))]
mod unix_only;
mod unknowns;
mod validate;
#[cfg(unix)]
mod virtual_board;

use std::ffi::OsString;

use clap::{CommandFactory, Parser, Subcommand};

use crate::text::one_line;
pub use outcome::{CommandError, Outcome};
#[cfg(not(unix))]
use unix_only::{demo, virtual_board};

/// Calibrate a robot's kinematics with a ball-bar: from one length at a time to every parameter that lengths can tell.
#[derive(Parser)]
#[command(
    name = "host-cal",
    version,
    max_term_width = 100,
    after_help = "Exit codes: 0 done; 1 done, but the result is not to be trusted as it is; 2 bad input or usage, nothing written; 3 a file could not be written."
)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Fit(fit::FitArgs),
    Validate(validate::ValidateArgs),
    Rank(rank::RankArgs),
    Report(report_page::ReportArgs),
    Fk(fk::FkArgs),
    Export(export::ExportArgs),
    Import(import::ImportArgs),
    Compensate(compensate::CompensateArgs),
    Plan(plan::PlanArgs),
    Collect(collect::CollectArgs),
    Simulate(simulate::SimulateArgs),
    Paper(paper::PaperArgs),
    Ports(ports::PortsArgs),
    Stream(stream::StreamArgs),
    Log(log::LogArgs),
    Status(status::StatusArgs),
    Home(home::HomeArgs),
    Lvdt(lvdt::LvdtArgs),
    Apply(apply::ApplyArgs),
    Pose(pose::PoseArgs),
    VirtualBoard(virtual_board::VirtualBoardArgs),
    Demo(demo::DemoArgs),
    Completions(completions::CompletionsArgs),
    Manual(manual::ManualArgs),
}

impl Cli {
    /// The program's arguments; ends the program when they are not to be understood, or ask for help.
    #[must_use]
    pub fn from_args() -> Self {
        let args: Vec<OsString> = std::env::args_os().collect();
        Self::try_parse_from(&args).unwrap_or_else(|error| {
            // The same error once more, of arguments that are safe to show.
            let shown = args.iter().map(|arg| one_line(&arg.to_string_lossy()).into_owned());
            Self::try_parse_from(shown).err().unwrap_or(error).exit()
        })
    }

    /// Runs the subcommand.
    ///
    /// # Errors
    /// [`CommandError`] with the message to show and the exit code.
    pub fn run(&self) -> Result<Outcome, CommandError> {
        match &self.command {
            Command::Fit(args) => args.run(),
            Command::Validate(args) => args.run(),
            Command::Rank(args) => args.run(),
            Command::Report(args) => args.run(),
            Command::Fk(args) => args.run(),
            Command::Export(args) => args.run(),
            Command::Import(args) => args.run(),
            Command::Compensate(args) => args.run(),
            Command::Plan(args) => args.run(),
            Command::Collect(args) => args.run(),
            Command::Simulate(args) => args.run(),
            Command::Paper(args) => args.run(),
            Command::Ports(args) => args.run(),
            Command::Stream(args) => args.run(),
            Command::Log(args) => args.run(),
            Command::Status(args) => args.run(),
            Command::Home(args) => args.run(),
            Command::Lvdt(args) => args.run(),
            Command::Apply(args) => args.run(),
            Command::Pose(args) => args.run(),
            Command::VirtualBoard(args) => args.run(),
            Command::Demo(args) => args.run(),
            Command::Completions(args) => args.run(Self::command()),
            Command::Manual(args) => args.run(Self::command()),
        }
    }
}
