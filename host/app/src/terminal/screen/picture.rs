//! What the steady screen shows, in the units of the screen.

use std::time::Duration;

use ballbar::{JointKind, Stillness};

use crate::text::one_line;
use crate::units::ScreenUnit;

/// How a run stands.
#[derive(Clone, Debug, Default)]
pub(crate) struct Picture {
    /// The command, the port, the board, the robot.
    pub(crate) head: Vec<String>,
    /// Since the run began.
    pub(crate) elapsed: Duration,
    pub(crate) joints: Vec<Joint>,
    pub(crate) bar: Bar,
    /// The tool's origin in the base frame, millimetres.
    pub(crate) tool_mm: Option<[f64; 3]>,
    /// Samples a second, by the board's clock.
    pub(crate) rate_hz: Option<f64>,
    /// Messages and samples lost.
    pub(crate) lost: u64,
    pub(crate) stillness: Option<Stillness>,
    pub(crate) is_homed: Option<bool>,
    /// Measured less computed length, millimetres.
    pub(crate) residual_mm: Option<f64>,
    pub(crate) poses: Poses,
    /// What the person does next.
    pub(crate) next: String,
    /// Nothing goes on before it is done.
    pub(crate) is_waiting: bool,
    /// What the keys do.
    pub(crate) keys: &'static [(&'static str, &'static str)],
}

/// One joint; without parameters on the board, one encoder.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    /// `°`, ` mm`, or nothing for counts.
    pub(crate) unit: &'static str,
    pub(crate) decimals: usize,
    pub(crate) value: f64,
    pub(crate) limits: Option<[f64; 2]>,
    /// Where it is to go.
    pub(crate) goal: Option<f64>,
}

/// The length, and where it is within the travel.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bar {
    /// Chuck, sphere and length, when known.
    pub(crate) name: Option<String>,
    pub(crate) length_mm: Option<f64>,
    /// From mid travel; none without a bar within its travel.
    pub(crate) displacement_mm: Option<f64>,
    /// Ends of the travel, from mid travel.
    pub(crate) travel_mm: Option<[f64; 2]>,
    /// Code of the LVDT, where nothing says what it means.
    pub(crate) code: Option<u16>,
}

/// Poses so far.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Poses {
    pub(crate) done: u64,
    /// As many as are wanted, when that is known.
    pub(crate) of: Option<u64>,
    pub(crate) left: Option<Duration>,
}

impl Picture {
    /// With texts that move no cursor, wherever they come from.
    pub(crate) fn made_visible(self) -> Self {
        let shown = |text: String| one_line(&text).into_owned();
        let bar = Bar { name: self.bar.name.map(shown), ..self.bar };
        Self { head: self.head.into_iter().map(shown).collect(), bar, next: shown(self.next), ..self }
    }
}

impl Joint {
    /// Of a joint's value in degrees or millimetres.
    pub(crate) fn new(kind: JointKind, value: f64) -> Self {
        let unit = if ScreenUnit::from(kind) == ScreenUnit::Degree { "°" } else { " mm" };
        Self { unit, decimals: 3, value, limits: None, goal: None }
    }

    /// Of an encoder's position.
    pub(crate) fn of_counts(counts: i32) -> Self {
        Self { unit: "", decimals: 0, value: f64::from(counts), limits: None, goal: None }
    }

    /// With its unit.
    pub(crate) fn text(&self, value: f64) -> String {
        crate::units::fixed(value, self.decimals) + self.unit
    }
}
