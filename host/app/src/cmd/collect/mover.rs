//! What moves the robot: a controller on line, a program of its own, or somebody's hand.

use ballbar::JointKind;
use clap::{Args, ValueEnum};
use miette::Diagnostic;
use thiserror::Error;

use crate::cmd::outcome::CommandError;
use crate::collect::Mover;
use crate::remedies::Remedied;
use crate::robot_link::program::{ControllerSetup, Dialect};
use crate::robot_link::urscript::UrPorts;
use crate::robot_link::val::VAL_BAUD;
use crate::robot_link::{ControllerAt, open};

/// Which robot link, and where.
#[derive(Args)]
pub(super) struct MoverArgs {
    /// How the robot is moved (docs/robots.md)
    #[arg(long, value_enum)]
    robot_link: LinkKind,
    /// Where the robot's controller is: a network address, or the serial port of a VAL controller
    #[arg(long, value_name = "ADDRESS")]
    robot_address: Option<String>,
    /// With val: bits a second of the controller's line
    #[arg(long, default_value_t = VAL_BAUD, value_name = "BAUD")]
    robot_baud: u32,
    /// With urscript: ports of the secondary interface, of RTDE and of the dashboard
    #[arg(long, value_name = "PORT,PORT,PORT", default_value = "30002,30004,29999", value_parser = parse_ports)]
    robot_ports: UrPorts,
    /// With file: the controller's language
    #[arg(long, value_enum)]
    dialect: Option<DialectArg>,
    /// With file: the controller's tool whose load is the plate with its spheres; a number (krl, fanuc) [default: 1], or a name
    /// (rapid) [default: tool0]
    #[arg(long, value_name = "TOOL")]
    robot_tool: Option<String>,
    /// With file: what the robot's fastest revolute joint reaches by its data sheet, of which val, krl and fanuc take percentages
    /// [default: 240, 600, 1000]
    #[arg(long, value_name = "DEG/S", allow_hyphen_values = true)]
    robot_fastest_deg_s: Option<f64>,
    /// With file and fanuc: J3 at the pendant is joint 3 plus so many times joint 2: -1, 0 or 1 (docs/robots.md)
    #[arg(long, value_name = "K", allow_negative_numbers = true, value_parser = clap::value_parser!(i8).range(-1..=1))]
    fanuc_j23: Option<i8>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum LinkKind {
    /// Somebody drives with the teach pendant, and the board sees where the robot is
    Manual,
    /// The simulated robot of `host-cal virtual-board --controller ADDRESS`
    Sim,
    /// A Unimation controller with VAL, over the serial line of its terminal
    Val,
    /// A Universal Robots controller, over the network
    Urscript,
    /// Programs for a controller that takes no moves on line; the board sees where the robot is
    File,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum DialectArg {
    /// Unimation
    Val,
    /// Universal Robots
    Urscript,
    /// KUKA
    Krl,
    /// ABB
    Rapid,
    /// Fanuc LS
    Fanuc,
}

#[derive(Debug, Error, Diagnostic)]
enum MoverError {
    #[error("--robot-link {link} needs --robot-address")]
    #[diagnostic(help("{help}"))]
    NoAddress { link: &'static str, help: &'static str },
    #[error("--robot-link file needs --dialect")]
    #[diagnostic(help("One of val, urscript, krl, rapid, fanuc."))]
    NoDialect,
}

impl MoverArgs {
    /// Connects to what moves the robot.
    pub(super) fn open(&self, kinds: &[JointKind]) -> Result<Mover, CommandError> {
        let controller = match self.robot_link {
            LinkKind::Manual => return Ok(Mover::Hand),
            LinkKind::File => return Ok(Mover::Programs(self.dialect.ok_or(MoverError::NoDialect)?.into())),
            LinkKind::Sim => ControllerAt::Sim(self.sim_address()?),
            LinkKind::Val => {
                let help = "It is the serial port that is connected in the place of the controller's terminal.";
                ControllerAt::Val { port: self.address("val", help)?, baud: self.robot_baud }
            }
            LinkKind::Urscript => {
                let host = self.address("urscript", "It is the controller's network address.")?;
                ControllerAt::UrScript { host, ports: self.robot_ports }
            }
        };
        Ok(Mover::Link(open(&controller, kinds).map_err(Remedied)?))
    }

    /// What programs have to know of the controller.
    pub(super) fn setup(&self) -> ControllerSetup {
        ControllerSetup {
            tool: self.robot_tool.clone(),
            fastest_rad_s: self.robot_fastest_deg_s.map(f64::to_radians),
            j23: self.fanuc_j23,
        }
    }

    /// The simulation's address, when it is the simulation that moves.
    pub(super) fn simulation(&self) -> Result<Option<&str>, CommandError> {
        if self.robot_link == LinkKind::Sim { Ok(Some(self.sim_address()?)) } else { Ok(None) }
    }

    fn sim_address(&self) -> Result<&str, MoverError> {
        self.address("sim", "It is the second line that host-cal virtual-board --controller 127.0.0.1:0 prints.")
    }

    fn address(&self, link: &'static str, help: &'static str) -> Result<&str, MoverError> {
        self.robot_address.as_deref().ok_or(MoverError::NoAddress { link, help })
    }
}

fn parse_ports(text: &str) -> Result<UrPorts, String> {
    let ports: Result<Vec<u16>, _> = text.split(',').map(|port| port.trim().parse::<u16>()).collect();
    match ports.as_deref() {
        Ok(&[script, rtde, dashboard]) => Ok(UrPorts { script, rtde, dashboard }),
        _ => Err("expected three ports, as in 30002,30004,29999".into()),
    }
}

impl From<DialectArg> for Dialect {
    fn from(dialect: DialectArg) -> Self {
        match dialect {
            DialectArg::Val => Self::Val,
            DialectArg::Urscript => Self::UrScript,
            DialectArg::Krl => Self::Krl,
            DialectArg::Rapid => Self::Rapid,
            DialectArg::Fanuc => Self::FanucLs,
        }
    }
}
