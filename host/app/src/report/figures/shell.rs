//! Residuals against longitude and latitude of the shell: the paper's Fig. 3.

use super::canvas::{AFTER, Axis, HEIGHT, Labels, WIDTH, about_zero, chart, dots, draw};
use super::table::{Table, number};
use super::thin::{drawn, drawn_words};
use super::{Figure, FigureError, Frame};
use crate::report::facts::{Facts, RowFact};
use crate::units::mm_from_m;

const FRAME: Frame = Frame { name: "shell", title: "Residuals over the shell", wide: true };

pub(super) fn figure(facts: &Facts) -> Result<Figure, FigureError> {
    let residuals = about_zero(facts.rows.iter().map(|row| mm_from_m(row.after_m)));
    let lowest = facts.rows.iter().map(|row| row.latitude_rad.to_degrees()).fold(0.0, f64::min).floor();
    let y = Axis { title: "residual, mm", range: residuals, labels: Labels::Numbers };
    let longitude = |row: &RowFact| row.longitude_rad.to_degrees();
    let latitude = |row: &RowFact| row.latitude_rad.to_degrees();
    let drawn = drawn(facts);
    let points = |across: fn(&RowFact) -> f64| {
        let rows = drawn.iter().map(|&row| &facts.rows[row]);
        rows.map(move |row| (across(row), mm_from_m(row.after_m))).collect::<Vec<_>>()
    };
    let svg = draw(FRAME.name, (2 * WIDTH, HEIGHT), |area| {
        let panels = area.split_evenly((1, 2));
        let x = Axis { title: "longitude, °", range: 0.0..360.0, labels: Labels::Numbers };
        dots(&mut chart(&panels[0], "", &x, &y)?, AFTER, points(longitude))?;
        let x = Axis { title: "latitude, °", range: lowest..90.0, labels: Labels::Numbers };
        dots(&mut chart(&panels[1], "", &x, &y)?, AFTER, points(latitude))
    })?;
    let mut data = Table::new(["row", "longitude_deg", "latitude_deg", "residual_before_mm", "residual_after_mm"]);
    for row in &facts.rows {
        let numbers = [longitude(row), latitude(row), mm_from_m(row.before_m), mm_from_m(row.after_m)].map(number);
        let [longitude, latitude, before, after] = numbers;
        data.row([row.number.to_string(), longitude, latitude, before, after]);
    }
    let sentence = format!(
        "Where the bar points makes no difference if both are even bands about zero; a wave along either axis is geometry that the \
         model does not hold (the paper's Fig. 3).{}",
        drawn_words(facts)
    );
    Ok(FRAME.drawn(svg, data, sentence))
}
