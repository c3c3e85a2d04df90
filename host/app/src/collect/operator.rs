//! Who attaches the bar and may interfere: a person, or whatever stands in for one.

use std::time::Duration;

use crate::robot_link::{Intervention, LinkError};
use crate::session::Connection;

/// What the operator wants, at any time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// What was asked for is done.
    Confirm,
    /// Take the latest pose out again; it is measured again.
    EraseLast,
    /// Do not measure the next row.
    Skip,
    /// Stand still after the move under way.
    Pause,
    /// Go on.
    Resume,
    /// End here; another run goes on.
    Quit,
}

/// A pose that was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Line of plan.csv.
    pub line: usize,
    /// Poses of the plan measured so far, over all runs.
    pub done: usize,
    /// Poses of the plan.
    pub all: usize,
    /// The bar's length, metres.
    pub length_m: f64,
    /// Travel left inwards and outwards, metres.
    pub travel_left_m: [f64; 2],
    /// Measured less computed by the current model, metres.
    pub residual_m: f64,
    /// What is left to do, at the pace so far.
    pub left: Duration,
}

/// What an operator is told.
#[derive(Clone, Debug, PartialEq)]
pub enum Event<'a> {
    /// Attach this, and confirm.
    Attach(&'a Connection),
    /// Take this off, or whatever is on, and confirm.
    Detach(Option<&'a Connection>),
    /// The robot stands, and does not move on before a person has looked and confirmed. Told only where somebody
    /// [is present](Operator::is_present).
    Inspect {
        /// `on the way to line 12 of the plan, at 10.00° …`.
        place: &'a str,
        /// What has happened, and what to do.
        needed: &'a Intervention,
    },
    /// The bar that is attached is what the plan asks for.
    Attached(&'a Connection),
    /// Drive the robot near these joint values (revolute joints radians, prismatic ones metres).
    Drive {
        /// Line of plan.csv.
        line: usize,
        /// Encoder outputs.
        q: &'a ballbar::JointVector<f64>,
    },
    /// Start this program at the controller.
    Start(&'a str),
    /// A pose was measured.
    Measured(&'a Measured),
    /// A row was not measured.
    Missed {
        /// Line of plan.csv.
        line: usize,
        /// Why.
        why: &'a str,
    },
    /// The operator's wish was carried out.
    Done(Wish),
    /// Something went wrong, and is gone about.
    Trouble(&'a str),
    /// A pose was returned to; difference of the lengths, the encoders' difference taken out, metres.
    Repeated(f64),
    /// How things stand now; often.
    Now(&'a super::Now),
}

/// Who attaches the bar and may interfere.
pub trait Operator {
    /// Takes notice; for [`Event::Attach`] and [`Event::Detach`], sees to it that it is done.
    ///
    /// # Errors
    /// [`LinkError`] when what attaches the bar is out of reach.
    fn tell(&mut self, event: &Event<'_>) -> Result<(), LinkError>;

    /// Whether a person is there who can look at the robot. Without one no stop of its safety is released, and the run ends.
    fn is_present(&self) -> bool {
        false
    }

    /// The next wish; does not wait for one.
    fn wish(&mut self) -> Option<Wish>;
}

/// Nobody is there: every request about the bar counts as carried out.
#[derive(Debug, Default)]
pub struct Unattended {
    asked: bool,
}

impl Operator for Unattended {
    fn tell(&mut self, event: &Event<'_>) -> Result<(), LinkError> {
        self.asked |= matches!(event, Event::Attach(_) | Event::Detach(_));
        Ok(())
    }

    fn wish(&mut self) -> Option<Wish> {
        std::mem::take(&mut self.asked).then_some(Wish::Confirm)
    }
}
