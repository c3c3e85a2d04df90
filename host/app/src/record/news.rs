//! What happens while a board is watched, and a person is told.

use ballbar::{JointVector, SettledPose};
use ballbar_calib::model::BeyondLimits;

/// Something that happened.
#[derive(Clone, Debug)]
pub enum News {
    /// A message of the board is not believed, for the first time for this reason; in a sentence.
    Refused(String),
    /// The arm stood still.
    Settled(Box<Settled>),
    /// The port was lost, or the board reset or silent.
    Away {
        /// Why.
        reason: String,
    },
    /// The board is back.
    Back {
        /// It was started anew, so that it knows nothing of its encoders.
        is_started_anew: bool,
    },
}

/// A settled pose.
#[derive(Clone, Debug)]
pub struct Settled {
    /// Number in this run, from 1.
    pub number: u64,
    /// As the board sent it.
    pub pose: SettledPose,
    /// Where that is; not known of a board without parameters.
    pub at: Option<SettledAt>,
}

/// Where the arm stood still.
#[derive(Clone, Debug)]
pub struct SettledAt {
    /// Encoder outputs, radians or metres.
    pub q: JointVector<f64>,
    /// Of the bar from mid travel, metres, and what became of the pose; `None` with the bar beyond its travel, which makes no pose.
    pub bar: Option<(f64, Fate)>,
    /// Joints beyond their limits, which had not been so before.
    pub newly_beyond: Vec<BeyondLimits>,
}

/// What becomes of a settled pose with a length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// Written into poses.csv.
    Written,
    /// Only looked at: no poses are written.
    Seen {
        /// Whether all encoders of the joints were homed.
        is_homed: bool,
    },
    /// Not written, because not every encoder was homed.
    Withheld,
    /// Not written again: the arm still stands where it did before the port was lost.
    SameStand,
}
