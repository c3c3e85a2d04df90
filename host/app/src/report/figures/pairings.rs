//! Residuals by pairing.

use ballbar_calib::identify::{Offset, ResidualSummary};

use super::canvas::{AFTER, Axis, CURVE, HEIGHT, Labels, WIDTH, about_zero, chart, dots, draw, line};
use super::table::{Table, number};
use super::thin::{drawn, drawn_words};
use super::{Figure, FigureError, Frame};
use crate::report::facts::Facts;
use crate::units::{fixed, mm_from_m};

const FRAME: Frame = Frame { name: "pairings", title: "Residuals by pairing", wide: false };
/// Half of the width that a pairing's residuals take of one.
const HALF_WIDTH: f64 = 0.36;

pub(super) fn figure(facts: &Facts) -> Result<Figure, FigureError> {
    let names: Vec<String> = facts.pairings.iter().map(|(name, _)| name.clone()).collect();
    let rows_of = |pairing: usize| (0..facts.rows.len()).filter(move |&row| facts.rows[row].pairing == pairing);
    let summaries: Vec<ResidualSummary> = facts.assessment.by_pairing.iter().map(|of| ResidualSummary::new(of)).collect();
    let drawn = drawn(facts);
    let svg = draw(FRAME.name, (WIDTH, HEIGHT), |area| {
        let x = Axis { title: "pairing, chuck:sphere", range: -0.5..names.len() as f64 - 0.5, labels: Labels::Names(&names) };
        let range = about_zero(facts.rows.iter().map(|row| mm_from_m(row.after_m)));
        let mut chart = chart(area, "", &x, &Axis { title: "residual, mm", range, labels: Labels::Numbers })?;
        for (pairing, summary) in summaries.iter().enumerate() {
            let (at, mean_mm) = (pairing as f64, mm_from_m(summary.mean_m));
            let across = |i: usize| HALF_WIDTH * (2.0 * (i as f64 + 0.5) / summary.count as f64 - 1.0);
            let points = rows_of(pairing).enumerate().filter(|(_, row)| drawn.binary_search(row).is_ok());
            dots(&mut chart, AFTER, points.map(|(i, row)| (at + across(i), mm_from_m(facts.rows[row].after_m))))?;
            line(&mut chart, CURVE, [(at - HALF_WIDTH, mean_mm), (at + HALF_WIDTH, mean_mm)])?;
        }
        Ok(())
    })?;
    let mut data = Table::new(["pairing", "lengths", "mean_mm", "rms_mm"]);
    for (name, summary) in names.iter().zip(&summaries) {
        let [mean, rms] = [summary.mean_m, summary.rms_m].map(|m| number(mm_from_m(m)));
        data.row([name.clone(), summary.count.to_string(), mean, rms]);
    }
    let judged = facts
        .assessment
        .farthest_offset
        .map_or_else(|| "there are too few lengths to judge the means".to_owned(), |offset| judgement(&names, offset));
    let sentence = format!("Each pairing in the order of measurement, its mean as a line: {judged}.{}", drawn_words(facts));
    Ok(FRAME.drawn(svg, data, sentence))
}

/// What the mean that is farthest off says.
fn judgement(names: &[String], Offset { group, mean_m, errors, is_beyond_chance }: Offset) -> String {
    let (mean, name) = (fixed(mm_from_m(mean_m), 3), &names[group]);
    match (is_beyond_chance, names.len()) {
        (true, 1) => format!("its mean of {mean} mm is {errors:.1} standard errors off zero, more than chance gives"),
        (true, count) => format!(
            "that of {name} is off by {mean} mm, {errors:.1} standard errors, more than chance gives the worst of {count}: as if its \
             chuck or sphere were not where the rig's file says"
        ),
        (false, 1) => format!("its mean of {mean} mm is no further off than chance allows"),
        (false, _) => {
            format!("none is further off than chance allows, the most {name} with {mean} mm, {errors:.1} standard errors")
        }
    }
}
