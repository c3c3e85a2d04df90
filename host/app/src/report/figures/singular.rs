//! Singular values of the Jacobian, with the gap that tells the rank.

use super::canvas::{AFTER, Axis, BEFORE, HEIGHT, INK, Labels, WIDTH, chart, decades, dots, draw, line};
use super::table::Table;
use super::{Figure, FigureError, Frame};
use crate::report::facts::Facts;

const FRAME: Frame = Frame { name: "singular-values", title: "What these poses can tell", wide: false };
/// Rounding; what is below is drawn there.
const SMALLEST: f64 = 1e-18;

pub(super) fn figure(facts: &Facts) -> Result<Figure, FigureError> {
    let (values, rank) = (&facts.singular.values, facts.singular.rank);
    if values.is_empty() {
        return Ok(FRAME.missing("Not drawn: there are no parameters."));
    }
    let log = |value: f64| value.max(SMALLEST).log10();
    let svg = draw(FRAME.name, (WIDTH, HEIGHT), |area| {
        let x = Axis { title: "number", range: 0.0..values.len() as f64 + 1.0, labels: Labels::Numbers };
        let y = Axis { title: "singular value", range: decades(values.iter().copied(), SMALLEST), labels: Labels::Powers };
        let mut chart = chart(area, "", &x, &y)?;
        let gap = rank as f64 + 0.5;
        line(&mut chart, INK, [(gap, y.range.start), (gap, y.range.end)])?;
        let point = |i: usize| ((i + 1) as f64, log(values[i]));
        for (colour, some) in [(AFTER, 0..rank), (BEFORE, rank..values.len())] {
            dots(&mut chart, colour, some.map(point))?;
        }
        Ok(())
    })?;
    let mut data = Table::new(["number", "singular_value", "counts"]);
    for (i, value) in values.iter().enumerate() {
        data.row([(i + 1).to_string(), format!("{value:e}"), u8::from(i < rank).to_string()]);
    }
    let of = values.len();
    let sentence = match (rank.checked_sub(1).and_then(|last| values.get(last)), values.get(rank)) {
        (Some(last), Some(first)) => format!(
            "{rank} of {of} directions count, the weakest with {last:.1e}; the next stands at {:.0e} or below, and the wider that gap, \
             the surer the count.",
            first.max(SMALLEST)
        ),
        (Some(last), None) => format!("All {of} directions count, the weakest with {last:.1e}: there is no gap to find."),
        (None, _) => "No direction counts: these lengths tell nothing.".to_owned(),
    };
    Ok(FRAME.drawn(svg, data, sentence))
}
