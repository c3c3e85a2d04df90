//! The robot that programs are tried on.

use std::collections::BTreeMap;

use super::Complaint;

/// An axis as controllers count them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Axis {
    Arm(usize),
    External(usize),
}

/// What a program did.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Event {
    /// A line was shown.
    Say(String),
    /// The program waited for the operator's key.
    Pause,
    /// A joint-interpolated move with an exact stop; degrees and millimetres, as the controller counts its axes.
    Move {
        to: BTreeMap<Axis, f64>,
        speed: Speed,
        /// Tool, load, frame and whatever else the move depends on.
        setup: String,
    },
    /// The robot stood for so many seconds.
    Stand(f64),
}

/// How fast a move is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Speed {
    /// Of each axis's full speed, but for acceleration.
    Percent(BTreeMap<Axis, usize>),
    /// The leading axis's, radians per second, and its acceleration.
    Leading { rad_s: f64, rad_s2: f64 },
    /// Duration.
    Seconds(f64),
}

/// A robot at its controller.
#[derive(Clone, Debug)]
pub(crate) struct Machine {
    pub(crate) axes: BTreeMap<Axis, f64>,
    pub(crate) events: Vec<Event>,
    /// Somebody jogs an axis by so much while the program waits for the first time.
    pub(crate) jog: Option<(Axis, f64)>,
    /// Steps that a program may take, so that none is endless.
    patience: usize,
}

impl Machine {
    pub(crate) fn at(axes: BTreeMap<Axis, f64>) -> Self {
        Self { axes, events: Vec::new(), jog: None, patience: 1_000_000 }
    }

    pub(super) fn tick(&mut self) -> Result<(), Complaint> {
        self.patience -= 1;
        if self.patience == 0 { Err("the program does not end".into()) } else { Ok(()) }
    }

    pub(super) fn say(&mut self, words: impl Into<String>) {
        self.events.push(Event::Say(words.into()));
    }

    pub(super) fn pause(&mut self) {
        self.events.push(Event::Pause);
        if let Some((axis, by)) = self.jog.take() {
            *self.axes.get_mut(&axis).expect("the axis is there") += by;
        }
    }

    pub(super) fn value(&self, axis: Axis) -> Result<f64, Complaint> {
        self.axes.get(&axis).copied().ok_or_else(|| format!("the robot has no {axis:?}"))
    }

    pub(super) fn go(&mut self, to: BTreeMap<Axis, f64>, speed: Speed, setup: impl Into<String>) -> Result<(), Complaint> {
        if to.keys().ne(self.axes.keys()) {
            return Err(format!("a move of {:?}, the robot has {:?}", to.keys(), self.axes.keys()));
        }
        self.axes = to.clone();
        self.events.push(Event::Move { to, speed, setup: setup.into() });
        Ok(())
    }

    pub(super) fn stand(&mut self, seconds: f64) {
        self.events.push(Event::Stand(seconds));
    }
}
