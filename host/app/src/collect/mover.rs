//! What moves the robot: a controller on line, a program of its own, or somebody's hand.

use super::Nearness;
use super::collector::{Collector, Ended};
use super::errors::CollectError;
use super::follow::Guide;
use crate::deadline::StopFlag;
use crate::robot_link::RobotLink;
use crate::robot_link::program::Dialect;

/// What moves the robot.
pub enum Mover {
    /// A controller on line.
    Link(Box<dyn RobotLink>),
    /// Programs that somebody starts.
    Programs(Dialect),
    /// Somebody's hand.
    Hand,
}

impl Mover {
    /// From here on no controller is waited for any longer once the flag is set.
    pub fn heed(&mut self, stop: &StopFlag) {
        if let Self::Link(link) = self {
            link.heed(stop);
        }
    }

    /// For the session.
    pub fn name(&self) -> String {
        match self {
            Self::Link(link) => link.name(),
            Self::Programs(dialect) => format!("file, {dialect}"),
            Self::Hand => "manual".into(),
        }
    }
}

impl Collector<'_, '_> {
    /// Measures all that is left, whatever moves the robot: [`Collector::drive`] or [`Collector::follow`].
    ///
    /// # Errors
    /// As of these.
    pub fn walk(&mut self, mover: &mut Mover, near: Nearness, guide: &Guide) -> Result<Ended, CollectError> {
        match mover {
            Mover::Link(link) => self.drive(link.as_mut()),
            Mover::Programs(_) | Mover::Hand => self.follow(near, guide),
        }
    }
}
