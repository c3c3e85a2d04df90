//! What the steady screen shows, in the units of the screen.

use std::time::Duration;

use ballbar::{JointKind, Stillness};

use crate::text::one_line;
use crate::units::ScreenUnit;

/// How a run stands.
#[derive(Clone, Debug, Default)]
pub(in crate::cmd) struct Picture {
    /// The command, the port, the board, the robot.
    pub(in crate::cmd) head: Vec<String>,
    /// Since the run began.
    pub(in crate::cmd) elapsed: Duration,
    pub(in crate::cmd) joints: Vec<Joint>,
    pub(in crate::cmd) bar: Bar,
    /// The tool's origin in the base frame, millimetres.
    pub(in crate::cmd) tool_mm: Option<[f64; 3]>,
    /// Samples a second, by the board's clock.
    pub(in crate::cmd) rate_hz: Option<f64>,
    /// Messages and samples lost.
    pub(in crate::cmd) lost: u64,
    pub(in crate::cmd) stillness: Option<Stillness>,
    pub(in crate::cmd) is_homed: Option<bool>,
    /// Measured less computed length, millimetres.
    pub(in crate::cmd) residual_mm: Option<f64>,
    pub(in crate::cmd) poses: Poses,
    /// What the person does next.
    pub(in crate::cmd) next: String,
    /// Nothing goes on before it is done.
    pub(in crate::cmd) is_waiting: bool,
    /// What the keys do.
    pub(in crate::cmd) keys: &'static [(&'static str, &'static str)],
}

/// One joint; without parameters on the board, one encoder.
#[derive(Clone, Debug)]
pub(in crate::cmd) struct Joint {
    /// `°`, ` mm`, or nothing for counts.
    pub(in crate::cmd) unit: &'static str,
    pub(in crate::cmd) decimals: usize,
    pub(in crate::cmd) value: f64,
    pub(in crate::cmd) limits: Option<[f64; 2]>,
    /// Where it is to go.
    pub(in crate::cmd) goal: Option<f64>,
}

/// The length, and where it is within the travel.
#[derive(Clone, Debug, Default)]
pub(in crate::cmd) struct Bar {
    /// Chuck, sphere and length, when known.
    pub(in crate::cmd) name: Option<String>,
    pub(in crate::cmd) length_mm: Option<f64>,
    /// From mid travel; none without a bar within its travel.
    pub(in crate::cmd) displacement_mm: Option<f64>,
    /// Ends of the travel, from mid travel.
    pub(in crate::cmd) travel_mm: Option<[f64; 2]>,
    /// Code of the LVDT, where nothing says what it means.
    pub(in crate::cmd) code: Option<u16>,
}

/// Poses so far.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::cmd) struct Poses {
    pub(in crate::cmd) done: u64,
    /// As many as are wanted, when that is known.
    pub(in crate::cmd) of: Option<u64>,
    pub(in crate::cmd) left: Option<Duration>,
}

impl Picture {
    /// With texts that move no cursor, wherever they come from.
    pub(super) fn made_visible(self) -> Self {
        let shown = |text: String| one_line(&text).into_owned();
        let bar = Bar { name: self.bar.name.map(shown), ..self.bar };
        Self { head: self.head.into_iter().map(shown).collect(), bar, next: shown(self.next), ..self }
    }
}

impl Joint {
    /// Of a joint's value in degrees or millimetres.
    pub(in crate::cmd) fn new(kind: JointKind, value: f64) -> Self {
        let unit = if ScreenUnit::from(kind) == ScreenUnit::Degree { "°" } else { " mm" };
        Self { unit, decimals: 3, value, limits: None, goal: None }
    }

    /// Of an encoder's position.
    pub(in crate::cmd) fn of_counts(counts: i32) -> Self {
        Self { unit: "", decimals: 0, value: f64::from(counts), limits: None, goal: None }
    }

    /// With its unit.
    pub(super) fn text(&self, value: f64) -> String {
        crate::units::fixed(value, self.decimals) + self.unit
    }
}
