//! `host-cal virtual-board`: the firmware with a simulated robot and ball-bar, behind a port.

use std::num::NonZeroU64;
use std::path::PathBuf;
use std::thread::sleep;
use std::time::{Duration, Instant};

use ballbar_calib::model::{PairingId, Rig, Robot};
use ballbar_calib::simulate::Shells;
use clap::{Args, ValueEnum};
use miette::Diagnostic;
use serde::Serialize;
use thiserror::Error;

use super::inputs::{ListError, OutputArgs, parse_pairings};
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print};
use crate::board::{NOMINAL_TRAVEL_M, parameter_set};
use crate::files::{open_rig, open_robot};
use crate::remedies::Remedied;
use crate::robot_link::JointSpeed;
use crate::terminal::out::tell_lines;
use crate::terminal::{EndRequest, progress};
use crate::units::m_from_mm;
use crate::virtual_board::{
    Controller, ControllerOptions, Driven, Driver, Pace, Plant, Script, VirtualBoard, VirtualBoardOptions, driver,
};

/// Try everything without hardware: the board's own firmware, with a simulated robot and bar, behind a serial port
#[derive(Args)]
#[command(after_help = "Examples:
  host-cal virtual-board --ready --pairings A:1 --port /tmp/board
  host-cal stream /tmp/board --session try --rig triangles --pairing A:1 --bar 460

The first line on stdout is the port's name, or with --json one document that holds it.
The robot stands still until a host streams, and then goes from pose to pose.
Runs until Ctrl-C; with --once until the last pose was taken.")]
pub(super) struct VirtualBoardArgs {
    /// The robot as it is: robot.toml, or a built-in
    #[arg(long, default_value = "puma560-optimised")]
    robot: String,
    /// The robot as its controller believes it to be: poses are planned with it, and --ready stores it
    #[arg(long, default_value = "puma560")]
    design: String,
    /// rig.toml, or the built-in: triangles
    #[arg(long, default_value = "triangles")]
    rig: String,
    /// Length of the bar at mid travel, millimetres
    #[arg(long, default_value_t = 460.0, value_name = "MM", allow_hyphen_values = true)]
    bar: f64,
    /// Pairings, chuck:sphere separated by commas, one after the other; all when not given
    #[arg(long, value_name = "A:1,B:2,…")]
    pairings: Option<String>,
    /// Poses on each pairing's shell
    #[arg(long, default_value_t = 90, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    per_pair: u32,
    /// How long the robot stands at each pose, seconds
    #[arg(long, default_value_t = 1.0, value_name = "S", allow_hyphen_values = true)]
    dwell_s: f64,
    /// The highest speed of the joints, degrees per second
    #[arg(long, default_value_t = 60.0, value_name = "DEG/S", allow_hyphen_values = true)]
    speed_deg_s: f64,
    /// Standard deviation of the lengths' error from pose to pose, millimetres
    #[arg(long, default_value_t = 0.084, value_name = "MM", allow_hyphen_values = true)]
    sigma_mm: f64,
    /// The same seed gives the same poses and noise
    #[arg(long, default_value_t = 7)]
    seed: u64,
    /// How fast time passes for the robot: as on the wall, or as fast as the host reads
    #[arg(long, value_enum, default_value_t = PaceArg::Real)]
    pace: PaceArg,
    /// Keep the board's flash in this file
    #[arg(long, value_name = "FILE")]
    flash: Option<PathBuf>,
    /// Make this symbolic link to the port
    #[arg(long, value_name = "PATH")]
    port: Option<PathBuf>,
    /// Begin with homed encoders, and with the design's parameters where the flash holds none
    #[arg(long)]
    ready: bool,
    /// Move at once, instead of when a host streams
    #[arg(long)]
    at_once: bool,
    /// End when the last pose was taken and the host has read all
    #[arg(long)]
    once: bool,
    /// Let `collect --robot-link sim` drive the robot: listen at this address, as 127.0.0.1:0; the second line on stdout is
    /// where. No poses are planned then
    #[arg(long, value_name = "ADDRESS", conflicts_with_all = ["at_once", "once", "per_pair", "pairings", "speed_deg_s"])]
    controller: Option<String>,
    /// Play of every revolute joint, from end to end, degrees
    #[arg(long, default_value_t = 0.0, value_name = "DEG", allow_hyphen_values = true)]
    backlash_deg: f64,
    /// The LVDT shows every length so much later, milliseconds
    #[arg(long, default_value_t = 0.0, value_name = "MS", allow_hyphen_values = true)]
    lvdt_lag_ms: f64,
    /// Flip one bit in every N bytes to the host
    #[arg(long, value_name = "N")]
    bit_errors: Option<NonZeroU64>,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Clone, Copy, ValueEnum)]
enum PaceArg {
    Real,
    Free,
}

impl From<PaceArg> for Pace {
    fn from(pace: PaceArg) -> Self {
        match pace {
            PaceArg::Real => Self::Real,
            PaceArg::Free => Self::Free,
        }
    }
}

#[derive(Serialize)]
struct VirtualBoardReport {
    port: String,
    robot: String,
    design: String,
    pairings: Vec<String>,
    bar_mm: f64,
    poses: usize,
    dwell_s: f64,
    sigma_mm: f64,
    backlash_deg: f64,
    lvdt_lag_ms: f64,
    seed: u64,
    ready: bool,
    /// Where `--robot-link sim` finds the robot's controller.
    #[serde(skip_serializing_if = "Option::is_none")]
    controller: Option<String>,
}

#[derive(Debug, Error, Diagnostic)]
#[error("--controller {address}: cannot be listened at: {error}")]
#[diagnostic(help("Give an address of this machine with a free port; port 0 takes any: 127.0.0.1:0"))]
struct ControllerError {
    address: String,
    error: std::io::Error,
}

/// Time between two looks at whether the user ends.
const LOOK: Duration = Duration::from_millis(20);

impl VirtualBoardArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        self.check()?;
        let (truth, design, rig) = (open_robot(&self.robot)?, open_robot(&self.design)?, open_rig(&self.rig)?);
        let pairings = self.pairings.as_ref().map_or_else(|| Ok(rig.all_pairings()), |list| parse_pairings(list, &rig))?;
        if truth.chain.joint_kinds() != design.chain.joint_kinds() {
            return refuse("--design", design.name.clone(), "a robot with the same joints as --robot");
        }
        let script = match self.controller {
            Some(_) => None,
            None => Some(self.script(&truth, &design, &rig, &pairings)?),
        };

        let end = EndRequest::listen();
        let (driver, driven) = driver();
        let mut board = self.power_up(&truth, &design, &rig, driven)?;
        let controller = match &self.controller {
            Some(address) => Some(self.listen(address, driver, &truth, &rig)?),
            None => None,
        };
        let report = VirtualBoardReport {
            port: board.port().to_owned(),
            robot: truth.name.clone(),
            design: design.name.clone(),
            pairings: pairings.iter().map(|&pairing| rig.pairing_name(pairing)).collect(),
            bar_mm: self.bar,
            poses: script.as_ref().map_or(0, |script| script.stations.len()),
            dwell_s: self.dwell_s,
            sigma_mm: self.sigma_mm,
            backlash_deg: self.backlash_deg,
            lvdt_lag_ms: self.lvdt_lag_ms,
            seed: self.seed,
            ready: self.ready,
            controller: controller.map(|controller| controller.address().to_string()),
        };
        print(&report, self.output.json)?;
        tell_lines(&self.explanation(&report));
        match script {
            Some(script) if self.at_once => board.play(script),
            Some(script) => board.play_with_stream(script),
            None => {}
        }
        self.wait(&board, &end);
        Ok(Outcome::Good)
    }

    /// Poses on the shells of the pairings.
    fn script(&self, truth: &Robot, design: &Robot, rig: &Rig, pairings: &[PairingId]) -> Result<Script, CommandError> {
        let shells = Shells {
            planned_with: design,
            truth,
            rig,
            pairings,
            bar_m: m_from_mm(self.bar),
            per_pairing: self.per_pair as usize,
            sigma_m: m_from_mm(self.sigma_mm),
            seed: self.seed,
        };
        let speed = JointSpeed { revolute_rad_s: self.speed_deg_s.to_radians(), ..JointSpeed::default() };
        let bar = progress((pairings.len() * shells.per_pairing) as u64, "planning poses");
        let script = Script::from_shells(&shells, self.dwell_s, speed, || bar.inc(1)).map_err(Remedied)?;
        bar.finish_and_clear();
        Ok(script)
    }

    fn listen(&self, address: &str, driver: Driver, truth: &Robot, rig: &Rig) -> Result<Controller, CommandError> {
        let options = ControllerOptions {
            sigma_m: m_from_mm(self.sigma_mm),
            dwell_s: self.dwell_s,
            seed: self.seed,
            ..ControllerOptions::new(truth, rig)
        };
        let refused = |error| ControllerError { address: address.to_owned(), error };
        Ok(Controller::listen(address, driver, options).map_err(refused)?)
    }

    fn check(&self) -> Result<(), CommandError> {
        let is_positive = |value: f64| value > 0.0 && value <= 1e6;
        if !is_positive(self.bar) {
            return refuse("--bar", self.bar.to_string(), "a number above 0, at most 1e6");
        }
        if !is_positive(self.dwell_s) {
            return refuse("--dwell-s", self.dwell_s.to_string(), "a number above 0, at most 1e6");
        }
        if !(1.0..=1e4).contains(&self.speed_deg_s) {
            return refuse("--speed-deg-s", self.speed_deg_s.to_string(), "a number from 1 to 1e4");
        }
        if !(0.0..=1e6).contains(&self.sigma_mm) {
            return refuse("--sigma-mm", self.sigma_mm.to_string(), "a number from 0 to 1e6");
        }
        if !(0.0..=10.0).contains(&self.backlash_deg) {
            return refuse("--backlash-deg", self.backlash_deg.to_string(), "a number from 0 to 10");
        }
        if !(0.0..=1000.0).contains(&self.lvdt_lag_ms) {
            return refuse("--lvdt-lag-ms", self.lvdt_lag_ms.to_string(), "a number from 0 to 1000");
        }
        Ok(())
    }

    fn power_up(&self, truth: &Robot, design: &Robot, rig: &Rig, driven: Driven) -> Result<VirtualBoard, CommandError> {
        let travel_m = rig.bar.as_ref().map_or(NOMINAL_TRAVEL_M, |bar| bar.travel_m);
        let plant = Plant::new(truth, travel_m, self.seed)?
            .with_backlash(self.backlash_deg.to_radians())
            .with_lvdt_lag(Duration::from_secs_f64(self.lvdt_lag_ms * 1e-3));
        let parameters = if self.ready { Some(parameter_set(design, plant.lvdt())?) } else { None };
        let options = VirtualBoardOptions {
            parameters,
            is_homed: self.ready,
            flash_file: self.flash.clone(),
            port_name: self.port.clone(),
            bit_errors: self.bit_errors,
            driven: self.controller.is_some().then_some(driven),
            ..VirtualBoardOptions::new(plant, self.pace.into())
        };
        Ok(VirtualBoard::start(options)?)
    }

    fn explanation(&self, report: &VirtualBoardReport) -> String {
        let state = if self.ready {
            "Its encoders are homed; unless its flash held parameters, it has the design's."
        } else {
            "It holds no parameters unless its flash does, and its encoders are not homed."
        };
        if let Some(controller) = &report.controller {
            return format!(
                "A board with a simulated {}. {state}\nIts robot's controller listens at {controller}.\n\
                 Try: host-cal collect {} --robot-link sim --robot-address {controller} …\nCtrl-C ends it.\n",
                report.robot, report.port
            );
        }
        let begin = if self.at_once { "The robot moves." } else { "The robot moves when a host streams." };
        format!(
            "A board with a simulated {}, planned as {}: {} poses on {} of {} mm, {} s at each. {begin}\n{state}\n\
             Try: host-cal stream {}\nCtrl-C ends it.\n",
            report.robot,
            report.design,
            report.poses,
            if report.pairings.len() == 1 {
                format!("the shell {}", report.pairings[0])
            } else {
                format!("{} shells", report.pairings.len())
            },
            report.bar_mm,
            report.dwell_s,
            report.port
        )
    }

    /// Until the user ends it; with `--once` until nothing is left to do.
    fn wait(&self, board: &VirtualBoard, end: &EndRequest) {
        let began = Instant::now();
        if self.once {
            board.wait_until_read(end.stop_flag());
        } else {
            while !end.is_made() {
                sleep(LOOK);
            }
        }
        let flips = board.bit_flips();
        let damage = if self.bit_errors.is_some() { format!(", {flips} bits flipped") } else { String::new() };
        tell_lines(&format!(
            "Ended after {:.1} s of the robot's time in {:.1} s{damage}.\n",
            board.robot_time().as_secs_f64(),
            began.elapsed().as_secs_f64()
        ));
    }
}

impl Report for VirtualBoardReport {
    fn text(&self) -> String {
        let controller = self.controller.as_ref().map_or(String::new(), |controller| format!("{controller}\n"));
        format!("{}\n{controller}", self.port)
    }
}

fn refuse<T>(flag: &'static str, found: String, expected: &'static str) -> Result<T, CommandError> {
    Err(ListError::Number { flag, found, expected }.into())
}
