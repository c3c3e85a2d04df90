//! `host-cal collect`: walk a plan and keep the poses.

mod mover;
mod report;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use ballbar_calib::plan::{Cell, CheckedPlan, Margins, Pace, PlanRow, UnsafePlan};
use clap::Args;
use miette::Diagnostic;
use mover::MoverArgs;
use report::CollectReport;
use thiserror::Error;

use super::inputs::{ListError, OutputArgs};
use super::outcome::{CommandError, Outcome, lock_error, record_error};
use super::port::{PortArgs, StillnessArgs};
use super::recorder::begin_recording;
use super::report::print;
use crate::collect::{
    BoardWatch, CheckedBoard, CollectError, CollectOptions, Collector, Guide, Ledger, Mover, Nearness, ProgramOptions, Programs,
    TrackOptions, remove_lag,
};
use crate::operator::{Hand, Still, Terminal};
use crate::remedies::Remedied;
use crate::robot_link::JointSpeed;
use crate::robot_link::sim::SimHand;
use crate::session::{Given, Recorder, Run, SessionInputs, SessionLock};
use crate::terminal::EndRequest;
use crate::units::m_from_mm;

/// Walk a plan: move the robot from pose to pose, wait until it stands, and keep what the bar measures
#[derive(Args)]
#[command(after_help = "Examples:
  host-cal collect /dev/ttyUSB0 --session today --plan plan.csv --robot design.toml --rig rig.toml --robot-link manual
  host-cal collect /dev/ttyUSB0 --session today --robot-link sim --robot-address 127.0.0.1:7560
  host-cal collect /dev/ttyUSB0 --session today --robot-link file --dialect fanuc --fanuc-j23 -1 --robot-tool 3

A session that has begun needs no --plan, --robot and --rig: the same command goes on where it ended, after a crash or another day.
At every change of the bar the command waits for Enter, and where the controller has stopped the robot by itself until somebody has looked
at it. Keys at any time (with Enter, where it shows lines and no steady screen):
e = erase the last pose, s = skip the next one, p = pause, r = resume, q = quit.")]
pub(super) struct CollectArgs {
    #[command(flatten)]
    port: PortArgs,
    /// Directory to record into; one that holds a begun collection is gone on with
    #[arg(long, value_name = "DIR")]
    session: PathBuf,
    /// plan.csv, as `host-cal plan` writes it
    #[arg(long, value_name = "FILE")]
    plan: Option<PathBuf>,
    /// The robot that the plan was made for: robot.toml, or a built-in
    #[arg(long)]
    robot: Option<String>,
    /// rig.toml, or the built-in: triangles
    #[arg(long)]
    rig: Option<String>,
    #[command(flatten)]
    mover: MoverArgs,
    /// Speed of revolute joints
    #[arg(long, value_name = "DEG/S", default_value_t = 30.0, allow_hyphen_values = true)]
    speed_deg_s: f64,
    /// Speed of prismatic joints
    #[arg(long, value_name = "MM/S", default_value_t = 100.0, allow_hyphen_values = true)]
    speed_mm_s: f64,
    /// Measure while the robot moves slowly, instead of stopping at each pose
    #[arg(long)]
    continuous: bool,
    /// With --continuous: speed of revolute joints while the bar is on
    #[arg(long, value_name = "DEG/S", default_value_t = 5.0, allow_hyphen_values = true)]
    slow_deg_s: f64,
    /// With --continuous: speed of prismatic joints while the bar is on
    #[arg(long, value_name = "MM/S", default_value_t = 20.0, allow_hyphen_values = true)]
    slow_mm_s: f64,
    /// With --continuous: time from one pose to the next, milliseconds
    #[arg(long, value_name = "MS", default_value_t = 500, value_parser = clap::value_parser!(u32).range(100..=60_000))]
    every_ms: u32,
    /// With manual and file: how near to a planned pose the arm has to stand, revolute joints
    #[arg(long, value_name = "DEG", default_value_t = 2.0, allow_hyphen_values = true)]
    near_deg: f64,
    /// The same, prismatic joints
    #[arg(long, value_name = "MM", default_value_t = 2.0, allow_hyphen_values = true)]
    near_mm: f64,
    /// With file: how long the robot stands at a measured pose, seconds
    #[arg(long, value_name = "S", default_value_t = 3.0, allow_hyphen_values = true)]
    stand_s: f64,
    /// Samples a second, 100 to 5000
    #[arg(long, default_value_t = 500, value_name = "HZ", value_parser = clap::value_parser!(u16).range(100..=5_000))]
    rate: u16,
    #[command(flatten)]
    stillness: StillnessArgs,
    /// Do not return to one pose of every shell
    #[arg(long)]
    no_repeat: bool,
    /// Ask for nothing: what attaches the bar does it by itself, and the run ends where a person has to look
    #[arg(long)]
    yes: bool,
    /// Temperature, kept with the session, degrees Celsius
    #[arg(long, value_name = "C")]
    temperature_c: Option<f64>,
    #[command(flatten)]
    output: OutputArgs,
}

/// An arm that has arrived rings no longer than this.
const COMING_TO_REST: Duration = Duration::from_secs(20);

#[derive(Debug, Error, Diagnostic)]
enum ArgumentError {
    #[error("--continuous needs a robot link that this program moves the robot by")]
    #[diagnostic(help("With manual and file every pose is measured standing."))]
    ContinuousByHand,
    #[error("the plan has {0}")]
    #[diagnostic(help("Nothing was moved. `host-cal plan --check` says more; plan again, or correct the rig's [solids]."))]
    UnsafePlan(String),
}

/// What is wrong with a plan, by the lines of its file.
fn in_lines(found: &UnsafePlan, rows: &[PlanRow]) -> String {
    let line = |row: usize| rows.get(row - 1).map_or(0, |row| row.line);
    match *found {
        UnsafePlan::NotFinite { row } => format!("a number that is none in line {}", line(row)),
        UnsafePlan::OtherRig { row } => format!("a chuck or a sphere that this rig has not, in line {}", line(row)),
        UnsafePlan::Contact { contact, row } => format!("{contact} in one another, on the way to line {}", line(row)),
        UnsafePlan::Limits | UnsafePlan::Travel => found.to_string(),
    }
}

impl CollectArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let options = self.options()?;
        let files = SessionInputs::open(&self.session, self.given())?;
        let travel_m = files.rig.bar.as_ref().ok_or(ListError::NoBar)?.travel_m;
        let cell = Cell::new(&files.robot, &files.rig, travel_m, Margins::default(), Pace::default()).map_err(Remedied)?;
        let plan =
            CheckedPlan::new(&cell, &files.rows).map_err(|found| ArgumentError::UnsafePlan(in_lines(&found, &files.rows)))?;

        let mut mover = self.mover.open(files.robot.chain.joint_kinds())?;
        if self.continuous && !matches!(mover, Mover::Link(_)) {
            return Err(ArgumentError::ContinuousByHand.into());
        }
        let programs = self.programs(&mover, &plan, &options)?;
        let board = CheckedBoard::read(self.port.connect()?, &files.robot)?;
        let lock = SessionLock::acquire(&self.session).map_err(lock_error)?;
        files.write(&lock)?;
        let guide = match programs {
            None => Guide::Hand,
            Some(programs) => {
                programs.write(&lock).map_err(CommandError::output)?;
                Guide::Programs(programs.names)
            }
        };
        let recorder = self.recorder(&lock, &board, &mover)?;
        let recovered = recorder.recovered();
        let ledger = Ledger::new(plan, recorder.measured_lines().into_iter(), recorder.skipped_lines().into_iter());
        let mut board = BoardWatch::begin(board, recorder, self.rate, self.stillness.criteria()).map_err(collect_error)?;

        let head = vec!["collect".into(), self.port.port.clone(), mover.name(), files.robot.name.clone()];
        let mut hand = self.hand()?;
        let end = EndRequest::listen();
        board.heed(end.stop_flag());
        mover.heed(end.stop_flag());
        hand.heed(end.stop_flag());
        let mut terminal = Terminal::new(hand, Still::new(head, &files.robot), end);
        let began = Instant::now();
        let mut collector = Collector::new(ledger, board, &mut terminal, options);
        let ended = collector.walk(&mut mover, self.nearness(), &guide);
        let (summary, ledger, closed) = collector.end();
        terminal.close();
        let mut report = CollectReport::new(&self.session, &files, &ledger, &summary, &ended, began.elapsed());
        report.set_recovered(recovered);
        let lag = remove_lag(&lock, &files.robot, &files.rig);
        if let Ok(Some(lag)) = &lag {
            report.set_lag(lag);
        }
        print(&report, self.output.json)?;
        // What ended the run comes first: it is why the others failed, if they did.
        ended.map_err(collect_error)?;
        closed.map_err(collect_error)?;
        lag.map_err(collect_error)?;
        Ok(if report.is_complete() { Outcome::Good } else { Outcome::Doubtful })
    }

    fn given(&self) -> Given<'_> {
        Given { plan: self.plan.as_deref(), robot: self.robot.as_deref(), rig: self.rig.as_deref() }
    }

    fn options(&self) -> Result<CollectOptions, CommandError> {
        let positive = |flag, value: f64| {
            if value > 0.0 && value <= 1e6 {
                return Ok(value);
            }
            Err(ListError::Number { flag, found: value.to_string(), expected: "a number above 0, at most 1e6" })
        };
        positive("--near-deg", self.near_deg)?;
        positive("--near-mm", self.near_mm)?;
        let free_speed = JointSpeed {
            revolute_rad_s: positive("--speed-deg-s", self.speed_deg_s)?.to_radians(),
            prismatic_m_s: m_from_mm(positive("--speed-mm-s", self.speed_mm_s)?),
        };
        let slow = JointSpeed {
            revolute_rad_s: positive("--slow-deg-s", self.slow_deg_s)?.to_radians(),
            prismatic_m_s: m_from_mm(positive("--slow-mm-s", self.slow_mm_s)?),
        };
        let track = TrackOptions { every_s: f64::from(self.every_ms) * 1e-3, ..TrackOptions::default() };
        Ok(CollectOptions {
            speed: if self.continuous { slow } else { free_speed },
            free_speed,
            track: self.continuous.then_some(track),
            repeat: !self.no_repeat,
            patience: COMING_TO_REST + Duration::from_micros(u64::from(self.stillness.criteria().hold_us)),
            ..CollectOptions::default()
        })
    }

    /// For a robot that a program of its controller moves.
    fn programs(
        &self,
        mover: &Mover,
        plan: &CheckedPlan<'_>,
        options: &CollectOptions,
    ) -> Result<Option<Programs>, CommandError> {
        let Mover::Programs(dialect) = mover else { return Ok(None) };
        let options = ProgramOptions { speed: options.speed, stand_s: self.stand_s, setup: self.mover.setup() };
        Ok(Some(Programs::of_plan(plan, *dialect, &options)?))
    }

    fn hand(&self) -> Result<Hand, CommandError> {
        Ok(match self.mover.simulation()? {
            Some(address) => Hand::Sim(SimHand::connect(address)?),
            None if self.yes => Hand::Nobody,
            None => Hand::Person,
        })
    }

    fn nearness(&self) -> Nearness {
        Nearness { turn_rad: self.near_deg.to_radians(), slide_m: m_from_mm(self.near_mm) }
    }

    fn recorder(&self, lock: &SessionLock, board: &CheckedBoard, mover: &Mover) -> Result<Recorder, CommandError> {
        let link = board.link();
        let run = Run {
            rig: self.rig.clone(),
            robot_link: Some(mover.name()),
            temperature_c: self.temperature_c,
            ..Run::beginning(link.port_name(), link.hello(), self.rate)
        };
        begin_recording(lock, run, Some(board.robot().kinds()), &[link.hello_frame(), board.robot_frame()])
    }
}

/// What cannot be written is no bad input.
fn collect_error(error: CollectError) -> CommandError {
    match error {
        CollectError::Record(error) => record_error(error),
        error => error.into(),
    }
}
