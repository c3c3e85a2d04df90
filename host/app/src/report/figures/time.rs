//! Residuals in the order of measurement: drift.

use ballbar_calib::identify::ALIKE;

use super::canvas::{AFTER, Axis, CURVE, HEIGHT, Labels, WIDTH, about_zero, chart, dots, draw, line};
use super::table::{Table, number};
use super::thin::{drawn, drawn_words};
use super::{Figure, FigureError, Frame};
use crate::report::facts::Facts;
use crate::units::{fixed, mm_from_m};

const FRAME: Frame = Frame { name: "time", title: "Residuals in time", wide: false };
/// Lengths that one point of the mean's line is of, and the fewest.
const WINDOW: usize = 25;
const SMALLEST_WINDOW: usize = 3;

pub(super) fn figure(facts: &Facts) -> Result<Figure, FigureError> {
    let order = &facts.assessment.order;
    let points: Vec<(f64, f64)> = facts.rows.iter().map(|row| (row.order, mm_from_m(row.after_m))).collect();
    let mean = |window: &[(f64, f64)]| {
        let n = window.len() as f64;
        (window.iter().map(|point| point.0).sum::<f64>() / n, window.iter().map(|point| point.1).sum::<f64>() / n)
    };
    let window = (points.len() / 4).min(WINDOW);
    let last = points.last().map_or(1.0, |point| point.0).max(1e-3);
    let svg = draw(FRAME.name, (WIDTH, HEIGHT), |area| {
        let title = if order.is_timed { "minutes" } else { "in the order of measurement" };
        let x = Axis { title, range: 0.0..last, labels: Labels::Numbers };
        let range = about_zero(points.iter().map(|point| point.1));
        let mut chart = chart(area, "", &x, &Axis { title: "residual, mm", range, labels: Labels::Numbers })?;
        dots(&mut chart, AFTER, drawn(facts).into_iter().map(|row| points[row]))?;
        if window < SMALLEST_WINDOW { Ok(()) } else { line(&mut chart, CURVE, points.windows(window).map(mean)) }
    })?;
    let mut data = Table::new(["row", if order.is_timed { "minutes" } else { "order" }, "residual_after_mm"]);
    for (row, point) in facts.rows.iter().zip(&points) {
        data.row([row.number.to_string(), number(point.0), number(point.1)]);
    }
    let mean = if window < SMALLEST_WINDOW {
        "A slope or a jump would be a bar or robot that drifts".to_owned()
    } else {
        format!("The line, a mean over {window} lengths, leaves zero where bar or robot drifts")
    };
    let untimed = if order.is_timed { "" } else { " There are no times to go by, or they start anew." };
    let sentence = format!("{mean}. {}{}{untimed}{}", neighbours(facts), change(facts), drawn_words(facts));
    Ok(FRAME.drawn(svg, data, sentence))
}

/// What the correlation of neighbours says.
fn neighbours(facts: &Facts) -> String {
    let Some(correlation) = facts.neighbour_correlation else {
        return "There are too few lengths to tell whether residuals follow one another.".to_owned();
    };
    // Independent noise stays within two of these, 19 times of 20.
    let chance = 1.0 / (facts.rows.len() as f64).sqrt();
    let what = match correlation {
        correlation if correlation > ALIKE => "follow one another (drift, or geometry that the model does not hold)",
        correlation if correlation > 2.0 * chance => {
            "follow one another a little (drift, or geometry that the model does not hold)"
        }
        _ => "do not follow one another",
    };
    format!("Residuals {what}: each and the next of its pairing correlate by {correlation:.2}, chance alone 0 ± {chance:.2}.")
}

/// What the slope says.
fn change(facts: &Facts) -> String {
    let Some(trend) = facts.assessment.trend else {
        return " These poses do not tell a steady change from what each pairing is off by.".to_owned();
    };
    let (change, error) = (fixed(mm_from_m(trend.change_m), 3), fixed(mm_from_m(trend.error_m), 3));
    let judged = if trend.is_significant() {
        format!("{:.1} standard errors, more than chance gives", trend.errors())
    } else {
        "no more than chance gives".to_owned()
    };
    format!(" From first to last they change by {change} ± {error} mm: {judged}.")
}
