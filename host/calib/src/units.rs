//! The one place where SI meets millimetres and degrees.

use ballbar::{JointKind, ParameterUnit};

/// Metres of a length in millimetres.
pub fn m_from_mm(mm: f64) -> f64 {
    mm / 1e3
}

/// Millimetres of a length in metres.
pub fn mm_from_m(m: f64) -> f64 {
    m * 1e3
}

/// A number without the digits that the way through SI has added: rounded at the ninth decimal.
pub fn tidy(value: f64) -> f64 {
    (value * 1e9).round() / 1e9
}

/// A unit as files and screens have it, and its size in SI.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum ScreenUnit {
    /// Millimetres, for metres.
    Millimetre,
    /// Degrees, for radians.
    Degree,
    /// Ratios stay as they are.
    One,
    /// Milliseconds, for seconds.
    Millisecond,
    /// Degrees per newton metre, for radians.
    DegreePerNewtonMetre,
    /// Millimetres per newton, for metres.
    MillimetrePerNewton,
}

impl ScreenUnit {
    /// Its short name: `mm`, `deg`, `1`, `ms`, `deg/Nm`, `mm/N`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Degree => "deg",
            Self::One => "1",
            Self::Millisecond => "ms",
            Self::DegreePerNewtonMetre => "deg/Nm",
            Self::MillimetrePerNewton => "mm/N",
        }
    }

    /// From SI to the screen.
    pub fn from_si(self, value: f64) -> f64 {
        match self {
            Self::Millimetre | Self::MillimetrePerNewton => mm_from_m(value),
            Self::Degree | Self::DegreePerNewtonMetre => value.to_degrees(),
            Self::One => value,
            Self::Millisecond => value * 1e3,
        }
    }

    /// From the screen to SI.
    pub fn to_si(self, value: f64) -> f64 {
        match self {
            Self::Millimetre | Self::MillimetrePerNewton => m_from_mm(value),
            Self::Degree | Self::DegreePerNewtonMetre => value.to_radians(),
            Self::One => value,
            Self::Millisecond => value / 1e3,
        }
    }
}

impl From<ParameterUnit> for ScreenUnit {
    fn from(unit: ParameterUnit) -> Self {
        match unit {
            ParameterUnit::Metre => Self::Millimetre,
            ParameterUnit::Radian => Self::Degree,
            ParameterUnit::One => Self::One,
            ParameterUnit::Second => Self::Millisecond,
            ParameterUnit::RadianPerNewtonMetre => Self::DegreePerNewtonMetre,
            ParameterUnit::MetrePerNewton => Self::MillimetrePerNewton,
        }
    }
}

impl From<JointKind> for ScreenUnit {
    /// The unit of a joint's encoder output.
    fn from(kind: JointKind) -> Self {
        match kind {
            JointKind::Revolute => Self::Degree,
            JointKind::Prismatic => Self::Millimetre,
        }
    }
}

/// A number with so many decimals; what rounds to zero has no sign.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| c == '0' || c == '.') => digits.to_owned(),
        _ => text,
    }
}
