//! RMS after each step of the solve.

use super::canvas::{AFTER, Axis, HEIGHT, Labels, WIDTH, chart, decades, dots, draw, line};
use super::table::{Table, number};
use super::{Figure, FigureError};
use crate::report::facts::Facts;
use crate::units::mm_from_m;

const NAME: &str = "convergence";
/// A picometre; what is below is drawn there.
const SMALLEST_MM: f64 = 1e-9;

pub(super) fn figure(facts: &Facts) -> Result<Option<Figure>, FigureError> {
    let rms_mm: Vec<f64> = facts.rms_history_m.iter().copied().map(mm_from_m).filter(|mm| mm.is_finite()).collect();
    if rms_mm.is_empty() {
        return Ok(None);
    }
    let points: Vec<(f64, f64)> = rms_mm.iter().enumerate().map(|(i, mm)| (i as f64, mm.max(SMALLEST_MM).log10())).collect();
    let steps: Vec<String> = (0..rms_mm.len()).map(|i| i.to_string()).collect();
    let svg = draw(NAME, (WIDTH, HEIGHT), |area| {
        let labels = if steps.len() < 13 { Labels::Names(&steps) } else { Labels::Numbers };
        let x = Axis { title: "step", range: -0.3..(rms_mm.len() as f64 - 0.7).max(0.7), labels };
        let y = Axis { title: "RMS residual, mm", range: decades(rms_mm.iter().copied(), SMALLEST_MM), labels: Labels::Powers };
        let mut chart = chart(area, "", &x, &y)?;
        line(&mut chart, AFTER, points.iter().copied())?;
        dots(&mut chart, AFTER, points.iter().copied())
    })?;
    let mut data = Table::new(["step", "rms_mm"]);
    for (i, mm) in rms_mm.iter().enumerate() {
        data.row([i.to_string(), number(*mm)]);
    }
    let sentence = format!("A fall and then a flat end: {} (the solve's reason to stop).", facts.explanation);
    Ok(Some(Figure { name: NAME, title: "How the solve went", sentence, svg, data, wide: false }))
}
