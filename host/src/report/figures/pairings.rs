//! Residuals by pairing.

use super::canvas::{AFTER, Axis, CURVE, HEIGHT, Labels, WIDTH, about_zero, chart, dots, draw, line};
use super::table::{Table, number};
use super::{Figure, FigureError, Frame};
use crate::report::facts::Facts;
use crate::units::{fixed, mm_from_m};

const FRAME: Frame = Frame { name: "pairings", title: "Residuals by pairing", wide: false };
/// Half of the width that a pairing's residuals take of one.
const HALF_WIDTH: f64 = 0.36;

pub(super) fn figure(facts: &Facts) -> Result<Figure, FigureError> {
    let names: Vec<String> = facts.pairings.iter().map(|(name, _)| name.clone()).collect();
    let residuals_mm: Vec<Vec<f64>> = (0..names.len())
        .map(|pairing| facts.rows.iter().filter(|row| row.pairing == pairing).map(|row| mm_from_m(row.after_m)).collect())
        .collect();
    let svg = draw(FRAME.name, (WIDTH, HEIGHT), |area| {
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
    let sentence = format!(
        "Each pairing in the order of measurement, its mean as a line: {}.",
        names
            .iter()
            .zip(&residuals_mm)
            .filter_map(Off::new)
            .max_by(|a, b| a.errors.total_cmp(&b.errors))
            .map_or_else(|| "there are too few lengths to judge the means".to_owned(), |off| off.words(names.len()))
    );
    Ok(FRAME.drawn(svg, data, sentence))
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// How far a pairing's mean is from zero.
struct Off<'a> {
    name: &'a str,
    mean_mm: f64,
    /// In standard errors.
    errors: f64,
}

impl<'a> Off<'a> {
    /// None for fewer than three residuals, or residuals that do not scatter.
    fn new((name, values): (&'a String, &Vec<f64>)) -> Option<Self> {
        let (mean_mm, n) = (mean(values), values.len() as f64);
        let error = (values.iter().map(|mm| (mm - mean_mm).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt();
        (n > 2.0 && error.is_normal()).then(|| Self { name, mean_mm, errors: mean_mm.abs() / error })
    }

    fn words(&self, of: usize) -> String {
        /// Standard errors beyond which a mean is off: of nine means by chance about one time in forty.
        const TOO_FAR: f64 = 3.0;
        let Self { name, mean_mm, errors } = self;
        let mean = fixed(*mean_mm, 3);
        match (*errors > TOO_FAR, of) {
            (true, 1) => format!("its mean of {mean} mm is {errors:.1} standard errors off zero"),
            (true, _) => format!(
                "that of {name} is off by {mean} mm, {errors:.1} standard errors, as if its chuck or sphere were not where the rig's \
                 file says"
            ),
            (false, 1) => format!("its mean of {mean} mm is no further off than chance allows"),
            (false, _) => {
                format!("none is further off than chance allows, the most {name} with {mean} mm, {errors:.1} standard errors")
            }
        }
    }
}
