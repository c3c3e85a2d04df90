//! Singular values of the Jacobian, with the gap that tells the rank.

use super::canvas::{AFTER, Axis, BEFORE, HEIGHT, INK, Labels, WIDTH, chart, decades, dots, draw, line};
use super::table::Table;
use super::{Figure, FigureError};
use crate::report::facts::Facts;

const NAME: &str = "singular-values";
/// Rounding; what is below is drawn there.
const SMALLEST: f64 = 1e-18;

pub(super) fn figure(facts: &Facts) -> Result<Option<Figure>, FigureError> {
    let (values, rank) = (&facts.singular.values, facts.singular.rank);
    if values.is_empty() {
        return Ok(None);
    }
    let log = |value: f64| value.max(SMALLEST).log10();
    let svg = draw(NAME, (WIDTH, HEIGHT), |area| {
        let x = Axis { title: "number", range: 0.0..values.len() as f64 + 1.0, labels: Labels::Numbers };
        let y = Axis { title: "singular value", range: decades(values.iter().copied(), SMALLEST), labels: Labels::Powers };
        let mut chart = chart(area, "", &x, &y)?;
        let gap = rank as f64 + 0.5;
        line(&mut chart, INK, [(gap, y.range.start), (gap, y.range.end)])?;
        let point = |i: usize| ((i + 1) as f64, log(values[i]));
        for (colour, some) in [(AFTER, 0..rank), (BEFORE, rank..values.len())] {
            // Twice, so that single points are as dark as crowds elsewhere.
            dots(&mut chart, colour, some.clone().map(point))?;
            dots(&mut chart, colour, some.map(point))?;
        }
        Ok(())
    })?;
    let mut data = Table::new(["number", "singular_value", "counts"]);
    for (i, value) in values.iter().enumerate() {
        data.row([(i + 1).to_string(), format!("{value:e}"), u8::from(i < rank).to_string()]);
    }
    let sentence = match (rank.checked_sub(1).and_then(|last| values.get(last)), values.get(rank)) {
        (Some(last), Some(first)) => format!(
            "{rank} of {} directions can be told, the weakest with {last:.1e}; the next stands at {first:.0e}, and the wider that gap, the surer the count.",
            values.len()
        ),
        _ => format!("{rank} of {} directions can be told; there is no gap since no direction is left over.", values.len()),
    };
    Ok(Some(Figure { name: NAME, title: "What these poses can tell", sentence, svg, data, wide: false }))
}
