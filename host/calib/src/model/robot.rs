//! A robot: a chain, its limits and encoders, and when and from what it was calibrated.

use std::fmt;

use ballbar::{Chain, Coupling, Encoder};

use super::calibration::{Calibration, CalibrationVerdict};
use super::limits::JointLimits;

/// A robot as it is believed to be.
#[derive(Clone, Debug)]
pub struct Robot {
    /// What people call it.
    pub name: String,
    /// What it was read or made from: a file, or a word that a message can name.
    pub source: String,
    /// Links, joints and their parameters, SI units.
    pub chain: Chain<f64>,
    /// Limits of each joint's encoder output, radians or metres.
    pub limits: Vec<JointLimits>,
    /// What is known of each joint's encoder.
    pub encoders: Vec<EncoderFacts>,
    /// What a fit left with it; `None` for a design.
    pub calibration: Option<Calibration>,
}

/// How a joint's encoder counts.
#[derive(Clone, Debug, PartialEq)]
pub struct EncoderFacts {
    /// Counts per radian or metre, and from index to index; `None` where the file does not say.
    pub encoder: Option<Encoder<f64>>,
    /// Joints nearer to the base whose motion turns this one along.
    pub couplings: Vec<Coupling<f64>>,
}

impl Robot {
    /// What the fit behind this robot was found to be; `None` for a design, and for a file that does not say.
    pub fn verdict(&self) -> Option<CalibrationVerdict> {
        self.calibration.as_ref().and_then(|calibration| calibration.verdict)
    }

    /// What this robot's parameters are.
    pub fn standing(&self) -> Standing {
        match (&self.calibration, self.verdict()) {
            (_, Some(CalibrationVerdict::Calibrated)) => Standing::Calibrated,
            (_, Some(CalibrationVerdict::Reserved)) => Standing::Reserved,
            (Some(_), None) => Standing::NotJudged,
            (None, None) => Standing::Design,
        }
    }
}

/// What a robot's parameters are, by what is kept of the fit behind them: the one rule of who may rely on them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// No fit made them.
    Design,
    /// A fit made them, and nothing says that it was good.
    NotJudged,
    /// A good fit made them, and something weighs on it.
    Reserved,
    /// A good fit made them, and nothing stands against it.
    Calibrated,
}

impl Standing {
    /// Whether the fit was found to be good, with reservations or without.
    pub fn is_calibrated(self) -> bool {
        matches!(self, Self::Calibrated | Self::Reserved)
    }
}

impl fmt::Display for Standing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Design => "design, not calibrated",
            Self::NotJudged => "fitted, but not found to be calibrated",
            Self::Reserved => "calibrated, with reservations",
            Self::Calibrated => "calibrated",
        })
    }
}
