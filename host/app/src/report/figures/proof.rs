//! Error before and after on lengths that the fit has not seen.

use ballbar_calib::identify::Residual;

use super::canvas::{AFTER, Axis, BEFORE, Failure, HEIGHT, Labels, WIDTH, chart, decades, draw, line, words};
use super::table::{Table, number};
use super::{Figure, FigureError, Frame};
use crate::report::facts::Facts;
use crate::units::mm_from_m;

const FRAME: Frame = Frame { name: "held-out", title: "Error on lengths that the fit has not seen", wide: false };
/// Errors below a tenth of a micrometre are drawn there.
const SMALLEST_MM: f64 = 1e-4;

pub(super) fn figure(facts: &Facts) -> Result<Figure, FigureError> {
    let Some(proof) = facts.assessment.decisive_proof() else {
        return Ok(FRAME.missing("Not drawn: no lengths were kept from the fit, and there are too few to leave some out in turn. Measure more, or give others with --validate."));
    };
    let (before_mm, after_mm) = (sorted_mm(&proof.before), sorted_mm(&proof.after));
    let svg = draw(FRAME.name, (WIDTH, HEIGHT), |area| {
        let range = decades(before_mm.iter().chain(&after_mm).copied(), SMALLEST_MM);
        let x = Axis { title: "error of a length, mm", range, labels: Labels::Powers };
        let y = Axis { title: "% of lengths below", range: 0.0..100.0, labels: Labels::Numbers };
        let mut chart = chart(area, "", &x, &y)?;
        for (colour, values_mm, name, height) in [(BEFORE, &before_mm, "before", 12.0), (AFTER, &after_mm, "after", 24.0)] {
            line(&mut chart, colour, steps(values_mm))?;
            let left = x.range.start + 0.03 * (x.range.end - x.range.start);
            words(&mut chart, colour, (left, 100.0 - height + 6.0), name)?;
        }
        Ok::<(), Failure>(())
    })?;
    let mut data = Table::new(["error_before_mm", "error_after_mm", "percent_below"]);
    for (i, (before, after)) in before_mm.iter().zip(&after_mm).enumerate() {
        data.row([number(*before), number(*after), number(percent(i, before_mm.len()))]);
    }
    let (before, after) = (median(&before_mm), median(&after_mm));
    let sentence = if after_mm.len() == 1 {
        format!("On {}: the one length is off by {after:.3} mm after the fit, by {before:.3} mm before.", proof.name)
    } else {
        format!(
            "On {}: half of the lengths are off by less than {after:.3} mm after the fit, by {before:.3} mm before; the further left the \
             blue curve, the better.",
            proof.name
        )
    };
    Ok(FRAME.drawn(svg, data, sentence))
}

fn sorted_mm(residuals: &[Residual]) -> Vec<f64> {
    let mut sizes: Vec<f64> = residuals.iter().map(|f| mm_from_m(f.value_m.abs())).collect();
    sizes.sort_by(f64::total_cmp);
    sizes
}

fn median(sorted: &[f64]) -> f64 {
    sorted.get(sorted.len() / 2).copied().unwrap_or_default()
}

fn percent(rank: usize, of: usize) -> f64 {
    100.0 * (rank + 1) as f64 / of as f64
}

fn steps(sorted_mm: &[f64]) -> Vec<(f64, f64)> {
    sorted_mm.iter().enumerate().map(|(i, mm)| (mm.max(SMALLEST_MM).log10(), percent(i, sorted_mm.len()))).collect()
}
