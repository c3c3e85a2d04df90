//! Histogram of the residuals with the fitted normal distribution: the paper's Fig. 4.

use plotters::prelude::{Color, Rectangle};

use super::canvas::{AFTER, Axis, CURVE, HEIGHT, Labels, WIDTH, about_zero, chart, draw, line};
use super::table::{Table, number};
use super::{Figure, FigureError, Frame};
use crate::report::facts::Facts;
use crate::units::{fixed, mm_from_m};

const FRAME: Frame = Frame { name: "histogram", title: "How the residuals are distributed", wide: false };
/// Below this probability of so uneven a sample from a normal distribution, it is called not normal.
const DOUBTFUL: f64 = 0.01;

/// Below a nanometre, residuals are the rounding of what they were computed with.
const ROUNDED_MM: f64 = 1e-6;

pub(super) fn figure(facts: &Facts) -> Result<Figure, FigureError> {
    let residuals_mm: Vec<f64> = facts.rows.iter().map(|row| mm_from_m(row.whitened_m)).collect();
    let count = residuals_mm.len() as f64;
    let mean = residuals_mm.iter().sum::<f64>() / count;
    let deviation = (residuals_mm.iter().map(|mm| (mm - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();

    if deviation.is_nan() || deviation < ROUNDED_MM {
        return Ok(FRAME.missing("Not drawn: the residuals do not scatter."));
    }

    let range = about_zero(residuals_mm.iter().copied());
    let bins = (count.sqrt() as usize).clamp(8, 40);
    let width = (range.end - range.start) / bins as f64;
    let mut counts = vec![0_usize; bins];
    for mm in &residuals_mm {
        counts[(((mm - range.start) / width) as usize).min(bins - 1)] += 1;
    }
    let normal =
        |mm: f64| count * width * (-0.5 * ((mm - mean) / deviation).powi(2)).exp() / (deviation * std::f64::consts::TAU.sqrt());
    let edge = |bin: usize| range.start + bin as f64 * width;
    let tallest = counts.iter().map(|&n| n as f64).fold(normal(mean).min(count), f64::max) * 1.08;

    let title = if facts.is_weighted() { "residual times root of its weight, mm" } else { "residual, mm" };
    let svg = draw(FRAME.name, (WIDTH, HEIGHT), |area| {
        let x = Axis { title, range: range.clone(), labels: Labels::Numbers };
        let y = Axis { title: "lengths", range: 0.0..tallest, labels: Labels::Numbers };
        let mut chart = chart(area, "", &x, &y)?;
        let bar =
            |(bin, &n): (usize, &usize)| Rectangle::new([(edge(bin), 0.0), (edge(bin + 1), n as f64)], AFTER.mix(0.6).filled());
        chart.draw_series(counts.iter().enumerate().map(bar))?;
        let curve = (0..=200).map(|i| range.start + (range.end - range.start) * f64::from(i) / 200.0).map(|mm| (mm, normal(mm)));
        line(&mut chart, CURVE, curve.filter(|(_, height)| height.is_finite()))
    })?;
    let mut data = Table::new(["from_mm", "to_mm", "lengths", "normal"]);
    for (bin, n) in counts.iter().enumerate() {
        data.row([number(edge(bin)), number(edge(bin + 1)), n.to_string(), number(normal(edge(bin) + width / 2.0))]);
    }
    let test = match facts.assessment.normality {
        None => "too few for a test of that".to_owned(),
        Some(test) if test.p_value < DOUBTFUL => format!(
            "the Anderson-Darling test says they do not (p {}), so look for outliers, drift and what the model does not hold",
            probability(test.p_value)
        ),
        Some(test) => format!("the Anderson-Darling test has nothing against that (p {})", probability(test.p_value)),
    };
    let sentence = format!(
        "Residuals that are noise and no more follow the normal curve (mean {} mm, deviation {} mm); {test} (the paper's Fig. 4).",
        fixed(mean, 4),
        fixed(deviation, 4)
    );
    Ok(FRAME.drawn(svg, data, sentence))
}

fn probability(p: f64) -> String {
    if p < 1e-4 { "< 0.0001".to_owned() } else { format!("= {}", fixed(p, if p < DOUBTFUL { 4 } else { 2 })) }
}
