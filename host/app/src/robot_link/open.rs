//! Connecting to a controller.

use ballbar::JointKind;
use thiserror::Error;

use super::sim::SimLink;
use super::urscript::{UrLink, UrPorts};
use super::val::{ValLink, ValSpeeds};
use super::{LinkError, Patience, RobotLink};

/// A controller that takes moves on line, and where it is.
#[derive(Clone, Copy, Debug)]
pub enum ControllerAt<'a> {
    /// The simulated robot's, at a network address.
    Sim(&'a str),
    /// A Unimation with VAL, at the end of a serial line.
    Val {
        /// The port.
        port: &'a str,
        /// Bits a second.
        baud: u32,
    },
    /// Universal Robots', in the network.
    UrScript {
        /// Its address.
        host: &'a str,
        /// Its ports.
        ports: UrPorts,
    },
}

/// Why there is no connection.
#[derive(Debug, Error)]
pub enum OpenError {
    /// The controller.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// No such controller moves this robot.
    #[error(
        "{controller}: such a controller has six revolute joints, the robot has {revolute} revolute and {prismatic} prismatic ones"
    )]
    Joints {
        /// Which kind of controller.
        controller: &'static str,
        /// Revolute joints of the robot.
        revolute: usize,
        /// Prismatic ones.
        prismatic: usize,
    },
}

/// Connects to the controller of a robot with these joints.
///
/// # Errors
/// [`OpenError`].
pub fn open(controller: &ControllerAt<'_>, kinds: &[JointKind]) -> Result<Box<dyn RobotLink>, OpenError> {
    Ok(match *controller {
        ControllerAt::Sim(address) => Box::new(SimLink::connect(address, kinds.len())?),
        ControllerAt::Val { port, baud } => {
            check_six_revolute("val", kinds)?;
            Box::new(ValLink::open(port, baud, ValSpeeds::default(), Patience::default())?)
        }
        ControllerAt::UrScript { host, ports } => {
            check_six_revolute("urscript", kinds)?;
            Box::new(UrLink::connect(host, ports, Patience::default())?)
        }
    })
}

fn check_six_revolute(controller: &'static str, kinds: &[JointKind]) -> Result<(), OpenError> {
    if kinds == [JointKind::Revolute; 6] {
        return Ok(());
    }
    let prismatic = kinds.iter().filter(|kind| **kind == JointKind::Prismatic).count();
    Err(OpenError::Joints { controller, revolute: kinds.len() - prismatic, prismatic })
}
