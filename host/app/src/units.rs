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

/// A number from a file without the digits that the way through SI has added: rounded at the ninth decimal.
pub fn tidy(value: f64) -> f64 {
    (value * 1e9).round() / 1e9
}

/// A computed number for a file: what is within 1e-12 of a number with nine decimals becomes that number, so that rounding on the way
/// leaves no `90.00000000000001`. All others keep their digits.
pub fn without_noise(value: f64) -> f64 {
    const NOISE: f64 = 1e-12;
    let short = tidy(value);
    // The sum takes the sign from zero.
    if (short - value).abs() < NOISE { short + 0.0 } else { value }
}

/// A unit as files and screens have it, and its size in SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScreenUnit {
    /// Millimetres, for metres.
    Millimetre,
    /// Degrees, for radians.
    Degree,
    /// Ratios stay as they are.
    One,
}

impl ScreenUnit {
    /// The suffix of file columns and keys, and the `unit` of JSON: `mm`, `deg`, `1`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Degree => "deg",
            Self::One => "1",
        }
    }

    /// From SI to the screen.
    pub fn from_si(self, value: f64) -> f64 {
        match self {
            Self::Millimetre => mm_from_m(value),
            Self::Degree => value.to_degrees(),
            Self::One => value,
        }
    }

    /// From the screen to SI.
    pub fn to_si(self, value: f64) -> f64 {
        match self {
            Self::Millimetre => m_from_mm(value),
            Self::Degree => value.to_radians(),
            Self::One => value,
        }
    }
}

/// The number that a file has where the program has `si`: of those that are read as `si` itself the one with the fewest digits.
pub fn as_in_a_file(unit: ScreenUnit, si: f64) -> f64 {
    let near = unit.from_si(si);
    let candidates = [near, near.next_down(), near.next_up(), near.next_down().next_down(), near.next_up().next_up()];
    let exact = candidates.into_iter().filter(|&value| unit.to_si(value) == si);
    exact.min_by_key(|value| format!("{value:?}").len()).unwrap_or(near)
}

impl From<ParameterUnit> for ScreenUnit {
    fn from(unit: ParameterUnit) -> Self {
        match unit {
            ParameterUnit::Metre => Self::Millimetre,
            ParameterUnit::Radian => Self::Degree,
            ParameterUnit::One => Self::One,
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

/// Joint values for people: `10.000 -40.000 … deg`, or with `mm` behind the values that are lengths.
pub fn joints_text(kinds: &[JointKind], q: &[f64]) -> String {
    let value = |(&kind, &q): (&JointKind, &f64)| {
        let unit = ScreenUnit::from(kind);
        let number = fixed(unit.from_si(q), 3);
        if kind == JointKind::Prismatic { format!("{number} mm") } else { format!("{number}°") }
    };
    kinds.iter().zip(q).map(value).collect::<Vec<_>>().join(" ")
}
