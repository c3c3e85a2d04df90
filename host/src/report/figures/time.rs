//! Residuals in the order of measurement: drift.

use super::canvas::{AFTER, Axis, CURVE, HEIGHT, Labels, WIDTH, about_zero, chart, dots, draw, line};
use super::table::{Table, number};
use super::{Figure, FigureError};
use crate::report::facts::{Facts, RowFact};
use crate::units::mm_from_m;

const NAME: &str = "time";
/// Lengths that one point of the mean's line is of.
const WINDOW: usize = 25;
const SECONDS_PER_MINUTE: f64 = 60.0;

pub(super) fn figure(facts: &Facts) -> Result<Option<Figure>, FigureError> {
    let first_s = facts.rows.iter().filter_map(|row| row.t_s).fold(f64::INFINITY, f64::min);
    let has_times = facts.rows.iter().all(|row| row.t_s.is_some());
    // Times of several sessions may start anew; then the order says more.
    let in_order = facts.rows.windows(2).all(|pair| pair[0].t_s <= pair[1].t_s);
    let by_time = has_times && in_order;
    let at = |(i, row): (usize, &RowFact)| match row.t_s {
        Some(t_s) if by_time => (t_s - first_s) / SECONDS_PER_MINUTE,
        _ => (i + 1) as f64,
    };
    let points: Vec<(f64, f64)> = facts.rows.iter().enumerate().map(|row| (at(row), mm_from_m(row.1.after_m))).collect();
    let mean = |window: &[(f64, f64)]| {
        let n = window.len() as f64;
        (window.iter().map(|point| point.0).sum::<f64>() / n, window.iter().map(|point| point.1).sum::<f64>() / n)
    };
    let last = points.last().map_or(1.0, |point| point.0).max(1e-3);
    let svg = draw(NAME, (WIDTH, HEIGHT), |area| {
        let title = if by_time { "minutes" } else { "in the order of measurement" };
        let x = Axis { title, range: 0.0..last, labels: Labels::Numbers };
        let range = about_zero(points.iter().map(|point| point.1));
        let mut chart = chart(area, "", &x, &Axis { title: "residual, mm", range, labels: Labels::Numbers })?;
        dots(&mut chart, AFTER, points.iter().copied())?;
        line(&mut chart, CURVE, points.windows(WINDOW).map(mean))
    })?;
    let mut data = Table::new(["row", if by_time { "minutes" } else { "order" }, "residual_after_mm"]);
    for (row, point) in facts.rows.iter().zip(&points) {
        data.row([row.number.to_string(), number(point.0), number(point.1)]);
    }
    let correlation = facts.neighbour_correlation.map_or("too few to tell".to_owned(), |value| format!("{value:.2}"));
    let sentence = format!(
        "The line, a mean over {WINDOW} lengths, should stay at zero: a slope or a jump is a bar or robot that drifts (correlation of each \
         residual with the next: {correlation}; near 0 is good)."
    );
    Ok(Some(Figure { name: NAME, title: "Residuals in time", sentence, svg, data, wide: false }))
}
