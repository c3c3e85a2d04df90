//! Numbers for files and people. Where SI meets millimetres and degrees is [`ballbar_calib::units`].

use ballbar::JointKind;

pub use ballbar_calib::units::{ScreenUnit, fixed, m_from_mm, mm_from_m, tidy};

/// A computed number for a file: what is within 1e-12 of a number with nine decimals becomes that number, so that rounding on the way
/// leaves no `90.00000000000001`. All others keep their digits.
pub fn without_noise(value: f64) -> f64 {
    const NOISE: f64 = 1e-12;
    let short = tidy(value);
    // The sum takes the sign from zero.
    if (short - value).abs() < NOISE { short + 0.0 } else { value }
}

/// The number that a file has where the program has `si`: of those that are read as `si` itself the one with the fewest digits.
pub fn as_in_a_file(unit: ScreenUnit, si: f64) -> f64 {
    let near = unit.from_si(si);
    let candidates = [near, near.next_down(), near.next_up(), near.next_down().next_down(), near.next_up().next_up()];
    let exact = candidates.into_iter().filter(|&value| unit.to_si(value) == si);
    exact.min_by_key(|value| format!("{value:?}").len()).unwrap_or(near)
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
