//! Correlation of the free parameters.

use plotters::prelude::{Color, Rectangle};

use super::canvas::{AFTER, Axis, BEFORE, Labels, WIDTH, chart, draw};
use super::table::{Table, number};
use super::{Figure, FigureError, Frame};
use crate::report::facts::Facts;

const FRAME: Frame = Frame { name: "correlation", title: "Correlation of parameters", wide: true };
/// Correlations below are not drawn.
const FAINT: f64 = 0.03;
const SIZE: u32 = 2 * WIDTH;

pub(super) fn figure(facts: &Facts) -> Result<Figure, FigureError> {
    let (names, values) = (&facts.correlation.names, &facts.correlation.values);
    let count = names.len();
    if count < 2 {
        return Ok(FRAME.missing("Not drawn: it takes two free parameters to be correlated."));
    }
    let numbers: Vec<String> = names.iter().enumerate().map(|(i, _)| (i + 1).to_string()).collect();
    let svg = draw(FRAME.name, (SIZE, SIZE), |area| {
        let range = -0.5..count as f64 - 0.5;
        let x = Axis {
            title: "number of the parameter at the left, from below",
            range: range.clone(),
            labels: Labels::Names(&numbers),
        };
        let y = Axis { title: "", range, labels: Labels::Names(names) };
        let mut chart = chart(area, "", &x, &y)?;
        let cells = (0..count).flat_map(|i| (0..count).map(move |j| (i, j))).filter(|&cell| values[cell].abs() > FAINT);
        chart.draw_series(cells.map(|(i, j)| {
            let (x, y, value) = (j as f64, i as f64, values[(i, j)]);
            let colour = if value > 0.0 { AFTER } else { BEFORE };
            Rectangle::new([(x - 0.5, y + 0.5), (x + 0.5, y - 0.5)], colour.mix(value.abs()).filled())
        }))?;
        Ok(())
    })?;
    let mut data = Table::new(["parameter", "other", "correlation"]);
    let pairs = || (0..count).flat_map(|i| (0..i).map(move |j| (i, j)));
    for (i, j) in pairs() {
        data.row([names[i].clone(), names[j].clone(), number(values[(i, j)])]);
    }
    let strongest = pairs().max_by(|&a, &b| values[a].abs().total_cmp(&values[b].abs()));
    let strongest = strongest.map_or(String::new(), |(i, j)| {
        format!(" The strongest pair is {} and {} with {:+.2}.", names[j], names[i], values[(i, j)])
    });
    let sentence = format!(
        "Strong colour off the diagonal (blue +, orange −) joins parameters that these poses tell together rather than apart.{strongest}"
    );
    Ok(FRAME.drawn(svg, data, sentence))
}
