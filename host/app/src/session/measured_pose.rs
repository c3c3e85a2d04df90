//! A pose that was measured, and which ends the bar joined.

use std::fmt;

use ballbar::{Approach, JointVector};
use serde::{Deserialize, Serialize};

use crate::units::{mm_from_m, tidy};

/// Which ends the bar joined, and how long it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Connection {
    /// Name of the chuck.
    pub chuck: String,
    /// Name of the sphere.
    pub sphere: String,
    /// Length of the bar at mid travel, metres.
    pub bar_m: f64,
}

impl fmt::Display for Connection {
    /// `A:1, 460 mm`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}, {} mm", self.chuck, self.sphere, tidy(mm_from_m(self.bar_m)))
    }
}

/// A pose to keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredPose {
    /// Encoder outputs, radians or metres.
    pub q: JointVector<f64>,
    /// From which sides the joints came there, where it is known.
    pub approach: Approach,
    /// Displacement of the bar from mid travel, metres.
    pub displacement_m: f64,
    /// Time of its middle by the board's clock, seconds.
    pub t_s: f64,
    /// How fast the length grew, metres per second, where the arm moved.
    pub rate_m_s: Option<f64>,
    /// Line of plan.csv that it was measured for.
    pub plan_row: Option<usize>,
}
