//! Residuals by pairing.

use super::canvas::{AFTER, Axis, CURVE, HEIGHT, Labels, WIDTH, about_zero, chart, dots, draw, line};
use super::table::{Table, number};
use super::{Figure, FigureError};
use crate::report::facts::Facts;
use crate::units::mm_from_m;

const NAME: &str = "pairings";
/// Half of the width that a pairing's residuals take of one.
const HALF_WIDTH: f64 = 0.36;

pub(super) fn figure(facts: &Facts) -> Result<Option<Figure>, FigureError> {
    let names: Vec<String> = facts.pairings.iter().map(|(name, _)| name.clone()).collect();
    let residuals_mm: Vec<Vec<f64>> = (0..names.len())
        .map(|pairing| facts.rows.iter().filter(|row| row.pairing == pairing).map(|row| mm_from_m(row.after_m)).collect())
        .collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let svg = draw(NAME, (WIDTH, HEIGHT), |area| {
        let x = Axis { title: "pairing, chuck:sphere", range: -0.5..names.len() as f64 - 0.5, labels: Labels::Names(&names) };
        let range = about_zero(residuals_mm.iter().flatten().copied());
        let mut chart = chart(area, "", &x, &Axis { title: "residual, mm", range, labels: Labels::Numbers })?;
        for (pairing, values) in residuals_mm.iter().enumerate() {
            let at = pairing as f64;
            let across = |i: usize| HALF_WIDTH * (2.0 * (i as f64 + 0.5) / values.len() as f64 - 1.0);
            dots(&mut chart, AFTER, values.iter().enumerate().map(|(i, &mm)| (at + across(i), mm)))?;
            line(&mut chart, CURVE, [(at - HALF_WIDTH, mean(values)), (at + HALF_WIDTH, mean(values))])?;
        }
        Ok(())
    })?;
    let mut data = Table::new(["pairing", "lengths", "mean_mm", "rms_mm"]);
    for (name, values) in names.iter().zip(&residuals_mm) {
        let rms = mean(&values.iter().map(|mm| mm * mm).collect::<Vec<_>>()).sqrt();
        data.row([name.clone(), values.len().to_string(), number(mean(values)), number(rms)]);
    }
    let sentence = "Each pairing in the order of measurement, its mean as a line: a pairing whose mean is off has a chuck or sphere that is \
                    not where the rig's file says."
        .to_owned();
    Ok(Some(Figure { name: NAME, title: "Residuals by pairing", sentence, svg, data, wide: false }))
}
