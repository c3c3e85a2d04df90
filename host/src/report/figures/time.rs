//! Residuals in the order of measurement: drift.

use super::canvas::{AFTER, Axis, CURVE, HEIGHT, Labels, WIDTH, about_zero, chart, dots, draw, line};
use super::table::{Table, number};
use super::{Figure, FigureError, Frame};
use crate::report::facts::{Facts, RowFact};
use crate::report::verdict::ALIKE;
use crate::units::mm_from_m;

const FRAME: Frame = Frame { name: "time", title: "Residuals in time", wide: false };
/// Lengths that one point of the mean's line is of, and the fewest.
const WINDOW: usize = 25;
const SMALLEST_WINDOW: usize = 3;
const SECONDS_PER_MINUTE: f64 = 60.0;

pub(super) fn figure(facts: &Facts) -> Result<Figure, FigureError> {
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
    let window = (points.len() / 4).min(WINDOW);
    let last = points.last().map_or(1.0, |point| point.0).max(1e-3);
    let svg = draw(FRAME.name, (WIDTH, HEIGHT), |area| {
        let title = if by_time { "minutes" } else { "in the order of measurement" };
        let x = Axis { title, range: 0.0..last, labels: Labels::Numbers };
        let range = about_zero(points.iter().map(|point| point.1));
        let mut chart = chart(area, "", &x, &Axis { title: "residual, mm", range, labels: Labels::Numbers })?;
        dots(&mut chart, AFTER, points.iter().copied())?;
        if window < SMALLEST_WINDOW { Ok(()) } else { line(&mut chart, CURVE, points.windows(window).map(mean)) }
    })?;
    let mut data = Table::new(["row", if by_time { "minutes" } else { "order" }, "residual_after_mm"]);
    for (row, point) in facts.rows.iter().zip(&points) {
        data.row([row.number.to_string(), number(point.0), number(point.1)]);
    }
    let mean = if window < SMALLEST_WINDOW {
        "A slope or a jump would be a bar or robot that drifts".to_owned()
    } else {
        format!("The line, a mean over {window} lengths, leaves zero where bar or robot drifts")
    };
    let sentence =
        format!("{mean}: {}.{}", drift(facts), if by_time { "" } else { " There are no times to go by, or they start anew." });
    Ok(FRAME.drawn(svg, data, sentence))
}

/// What the correlation of neighbours says.
fn drift(facts: &Facts) -> String {
    let Some(correlation) = facts.neighbour_correlation else { return "there are too few lengths to tell".to_owned() };
    // Independent noise stays within two of these, 19 times of 20.
    let chance = 1.0 / (facts.rows.len() as f64).sqrt();
    let numbers =
        format!("each residual and the next of its pairing correlate by {correlation:.2}, chance alone 0 ± {chance:.2}");
    match correlation {
        correlation if correlation > ALIKE => format!("they do drift ({numbers})"),
        correlation if correlation > 2.0 * chance => format!("a little does remain ({numbers})"),
        _ => format!("nothing of it shows ({numbers})"),
    }
}
