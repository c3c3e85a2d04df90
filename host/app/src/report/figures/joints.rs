//! Residuals against each joint's encoder output.

use super::canvas::{AFTER, Axis, Labels, WIDTH, about_zero, chart, dots, draw};
use super::table::{Table, number};
use super::thin::{drawn, drawn_words};
use super::{Figure, FigureError, Frame};
use crate::report::facts::Facts;
use crate::units::{ScreenUnit, mm_from_m};

const FRAME: Frame = Frame { name: "joints", title: "Residuals by joint", wide: true };
const COLUMNS: usize = 3;
const PANEL_HEIGHT: u32 = 420;

pub(super) fn figure(facts: &Facts) -> Result<Figure, FigureError> {
    let joints = facts.joints.len();
    let lines = joints.div_ceil(COLUMNS);
    let unit = |joint: usize| ScreenUnit::from(facts.joints[joint]);
    let q = |joint: usize, row: usize| unit(joint).from_si(facts.rows[row].q[joint]);
    let residuals_mm: Vec<f64> = facts.rows.iter().map(|row| mm_from_m(row.after_m)).collect();
    let y = Axis { title: "residual, mm", range: about_zero(residuals_mm.iter().copied()), labels: Labels::Numbers };
    let drawn = drawn(facts);
    let svg = draw(FRAME.name, (2 * WIDTH, lines as u32 * PANEL_HEIGHT), |area| {
        for (joint, panel) in area.split_evenly((lines, COLUMNS)).iter().enumerate().take(joints) {
            let values = (0..residuals_mm.len()).map(|row| q(joint, row));
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (low.min(q), high.max(q)));
            let room = (0.03 * (high - low)).max(1e-3);
            let title = format!("q{}, {}", joint + 1, if unit(joint) == ScreenUnit::Degree { "°" } else { "mm" });
            let x = Axis { title: &title, range: low - room..high + room, labels: Labels::Numbers };
            dots(&mut chart(panel, "", &x, &y)?, AFTER, drawn.iter().map(|&row| (q(joint, row), residuals_mm[row])))?;
        }
        Ok(())
    })?;
    let mut data = Table::new(["row"]);
    data.headings.extend((0..joints).map(|joint| format!("q{}_{}", joint + 1, unit(joint).name())));
    data.headings.push("residual_after_mm".to_owned());
    for (i, row) in facts.rows.iter().enumerate() {
        let values = (0..joints).map(|joint| number(q(joint, i)));
        data.rows.push(std::iter::once(row.number.to_string()).chain(values).chain([number(residuals_mm[i])]).collect());
    }
    let sentence = format!(
        "Even bands say that no joint's angle matters; a wave would be an eccentric encoder or gear, which the model does not hold, \
         and a step backlash.{}",
        drawn_words(facts)
    );
    Ok(FRAME.drawn(svg, data, sentence))
}
