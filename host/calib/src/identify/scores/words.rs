//! Scores in words.

use std::fmt;

use super::{NoScore, ScoreEstimate, UnknownScore};
use crate::units::ScreenUnit;
use crate::unknowns::Kind;

impl fmt::Display for NoScore {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lacks(error) => error.fmt(f),
            Self::NoEffect => f.write_str("no length of these poses changes with it"),
            Self::ActsLike { with } => write!(f, "in these poses it acts like {}", with.join(", ")),
            Self::SameAs(kind) => write!(f, "in these poses it is the same as {}", kind.name()),
            Self::TooFew => f.write_str("too few lengths are left to tell it from noise"),
        }
    }
}

impl UnknownScore {
    /// What it would be: `a bar zero of +0.825 mm`, or `joints that yield to gravity, most of all compliance2 of +0.00057 deg/Nm`.
    pub fn what(&self) -> String {
        match self.largest() {
            Some(only) if self.estimates.len() == 1 => format!("a {} of {only}", one(self.kind)),
            Some(largest) => format!("{}, most of all {} of {largest}", several(self.kind), largest.name),
            None => several(self.kind).to_owned(),
        }
    }
}

impl fmt::Display for UnknownScore {
    /// A sentence without its full stop.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let comma = if self.estimates.len() == 1 { "" } else { "," };
        write!(f, "{}{comma} would explain them, {:.0} standard deviations", self.what(), self.deviations)
    }
}

impl fmt::Display for ScoreEstimate {
    /// Value and unit, with the digits that its deviation leaves.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = ScreenUnit::from(self.unit);
        let digits = (1.0 - unit.from_si(self.std).abs().log10().floor()).clamp(0.0, 9.0) as usize;
        write!(f, "{:+.digits$}", unit.from_si(self.value))?;
        if unit == ScreenUnit::One { Ok(()) } else { write!(f, " {}", unit.name()) }
    }
}

/// One unknown of a kind, to follow "a".
fn one(kind: Kind) -> &'static str {
    match kind {
        Kind::BarZero => "bar zero",
        Kind::RodZeros => "zero of the rod",
        Kind::BarGain => "bar gain",
        Kind::Latency => "latency",
        Kind::Rig => "place of a chuck or sphere",
        Kind::Sets => "set's offset",
        Kind::Drift => "drift from the first length to the last",
        Kind::Compliance => "joint's compliance",
        Kind::Eccentricity => "disc's eccentricity",
        Kind::Backlash => "joint's backlash",
    }
}

/// Several of them.
fn several(kind: Kind) -> &'static str {
    match kind {
        Kind::BarZero => "bar zeros",
        Kind::RodZeros => "a zero of each rod",
        Kind::BarGain => "bar gains",
        Kind::Latency => "latencies",
        Kind::Rig => "chucks and spheres in other places",
        Kind::Sets => "an offset of each set",
        Kind::Drift => "drifts",
        Kind::Compliance => "joints that yield to gravity",
        Kind::Eccentricity => "encoders' discs off their axes",
        Kind::Backlash => "backlash of joints",
    }
}
