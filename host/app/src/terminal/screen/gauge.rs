//! A value between two ends, as text.

/// A scale of so many characters from one end to the other, with the value `●` on it and, where there is one, the mark `┼`; beyond an
/// end the value is an arrow.
pub(super) fn gauge(width: usize, [least, most]: [f64; 2], value: f64, mark: Option<f64>) -> String {
    if width < 3 || most <= least || !value.is_finite() {
        return String::new();
    }
    let at = |value: f64| ((value - least) / (most - least) * (width - 1) as f64).round().clamp(0.0, (width - 1) as f64) as usize;
    let mut scale: Vec<char> = std::iter::repeat_n('─', width).collect();
    (scale[0], scale[width - 1]) = ('├', '┤');
    if let Some(mark) = mark.filter(|mark| (least..=most).contains(mark)) {
        scale[at(mark)] = '┼';
    }
    scale[at(value)] = match value {
        value if value < least => '◀',
        value if value > most => '▶',
        _ => '●',
    };
    scale.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::gauge;

    #[test]
    fn ends_mark_and_value_stand_where_they_belong() {
        assert_eq!(gauge(11, [-50.0, 50.0], 30.0, Some(0.0)), "├────┼──●─┤");
        assert_eq!(gauge(11, [-50.0, 50.0], -50.0, Some(50.0)), "●─────────┼");
        assert_eq!(gauge(11, [-50.0, 50.0], 51.0, None), "├─────────▶");
        assert_eq!(gauge(11, [-50.0, 50.0], -50.1, Some(60.0)), "◀─────────┤");
    }

    #[test]
    fn what_cannot_be_drawn_is_nothing() {
        assert_eq!(gauge(2, [0.0, 1.0], 0.5, None), "");
        assert_eq!(gauge(9, [1.0, 1.0], 1.0, None), "");
        assert_eq!(gauge(9, [0.0, 1.0], f64::NAN, None), "");
    }
}
