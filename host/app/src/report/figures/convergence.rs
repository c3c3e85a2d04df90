//! RMS after each step of the solve.

use super::canvas::{AFTER, Axis, HEIGHT, Labels, WIDTH, chart, decades, dots, draw, line};
use super::table::{Table, number};
use super::{Figure, FigureError, Frame};
use crate::report::facts::Facts;
use crate::units::{fixed, mm_from_m};

const FRAME: Frame = Frame { name: "convergence", title: "How the solve went", wide: false };
/// A picometre; what is below is drawn there.
const SMALLEST_MM: f64 = 1e-9;

pub(super) fn figure(facts: &Facts) -> Result<Figure, FigureError> {
    let rms_mm: Vec<f64> = facts.rms_history_m.iter().copied().map(mm_from_m).filter(|mm| mm.is_finite()).collect();
    if rms_mm.is_empty() {
        return Ok(FRAME.missing("Not drawn: the residuals are no numbers."));
    }
    let points: Vec<(f64, f64)> = rms_mm.iter().enumerate().map(|(i, mm)| (i as f64, mm.max(SMALLEST_MM).log10())).collect();
    let steps: Vec<String> = (0..rms_mm.len()).map(|i| i.to_string()).collect();
    let svg = draw(FRAME.name, (WIDTH, HEIGHT), |area| {
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
    let (first, last) = (rms_mm[0], rms_mm[rms_mm.len() - 1]);
    let sentence = format!(
        "A minimum shows as a fall with a flat end: from {} to {} mm in {} {}; the solve stopped there because {}.",
        fixed(first, 4),
        fixed(last, 4),
        facts.steps,
        if facts.steps == 1 { "step" } else { "steps" },
        facts.explanation
    );
    Ok(FRAME.drawn(svg, data, sentence))
}
