//! The page's tables: parameters, and poses to look at.

use ballbar_calib::identify::{FittedParameter, OutlierTest};
use maud::{Markup, html};

use super::facts::Facts;
use super::figures::Table;
use crate::units::{ScreenUnit, fixed, joints_text, mm_from_m};

const LARGEST: usize = 12;
/// Rows that stand out and are listed; of more, the worst.
const MOST_OUTLIERS: usize = 50;

/// Rows that were left out, with their likely cause; nothing where there are none.
pub(super) fn left_out(facts: &Facts) -> Option<Markup> {
    let shown = facts.left_out.iter().take(MOST_OUTLIERS);
    (!facts.left_out.is_empty()).then(|| html! {
        section #left-out .wide {
            h2 { "Lengths left out" }
            p {
                "They contradict the others, by far more than chance gives, and were not fitted; no figure shows them. Look at what made them "
                "wrong, and measure them again."
                @if facts.left_out.len() > MOST_OUTLIERS { " The first " (MOST_OUTLIERS) " of " (facts.left_out.len()) ":" }
            }
            div.scroll tabindex="0" { table {
                thead { tr { th { "at" } th { "pairing" } th.number { "off by, mm" } th { "likely cause" } th { "joints" } } }
                tbody { @for (row, cause) in shown { tr {
                    td { (row.place) }
                    td { (facts.pairings.get(row.pairing).map_or("", |pairing| &pairing.0)) }
                    td.number { (fixed(mm_from_m(row.after_m), 3)) }
                    td { (cause) }
                    td { (joints_text(&facts.joints, &row.q)) }
                } } }
            } }
        }
    })
}

/// All rows that stand out, then the largest of the others.
pub(super) fn largest(facts: &Facts) -> Markup {
    let outliers: Vec<usize> = facts.outliers.iter().map(|outlier| outlier.row).take(MOST_OUTLIERS).collect();
    let mut others: Vec<usize> = (0..facts.rows.len()).filter(|row| !outliers.contains(row)).collect();
    others.sort_by(|&a, &b| facts.rows[b].after_m.abs().total_cmp(&facts.rows[a].after_m.abs()));
    others.truncate(LARGEST);
    html! {
        section #largest .wide {
            h2 { "Largest residuals" }
            p {
                "Measured less computed length; poses to look at, or to measure again"
                @match facts.outliers.len() {
                    0 => "; none stands out from the others.",
                    count if count > MOST_OUTLIERS => { "; " (MOST_OUTLIERS) " of " (count) " that stand out, in bold, come first." }
                    _ => "; those that stand out, in bold, come first.",
                }
            }
            div.scroll tabindex="0" { table {
                thead { tr {
                    th { "at" } th { "pairing" } th.number { "before, mm" } th.number { "after, mm" } th { "stands out" } th { "joints" }
                } }
                tbody {
                    @for &row in &outliers { (pose(facts, row, true)) }
                    @for &row in &others { (pose(facts, row, false)) }
                }
            } }
        }
    }
}

fn pose(facts: &Facts, index: usize, stands_out: bool) -> Markup {
    let row = &facts.rows[index];
    let outlier = facts.outliers.iter().find(|outlier| outlier.row == index);
    let beside = outlier.map(|outlier| match outlier.test {
        OutlierTest::All => format!("{} deviations from all", fixed(outlier.score.abs(), 1)),
        OutlierTest::Neighbours => format!("{} deviations from its neighbours", fixed(outlier.score.abs(), 1)),
    });
    html! {
        tr class=(if stands_out { "out" } else { "" }) {
            td { (row.place) }
            td { (facts.pairings.get(row.pairing).map_or("", |pairing| &pairing.0)) }
            td.number { (fixed(mm_from_m(row.before_m), 3)) }
            td.number { (fixed(mm_from_m(row.after_m), 3)) }
            td { (beside.unwrap_or_default()) }
            td { (joints_text(&facts.joints, &row.q)) }
        }
    }
}

/// The paper's Table II.
pub(super) fn parameters(facts: &Facts) -> Markup {
    html! {
        section #parameters .wide {
            h2 { "Parameters" }
            p {
                "What the design said, what these poses say, and the standard deviation that the lengths' noise leaves (the paper's Table \
                 II). Held parameters keep their design value; what is wrong with them shows in others, so that a change is not always one \
                 of the part that it is named after. Those of link 1 hold where the rig stands, too."
            }
            div.scroll tabindex="0" { table {
                thead { tr {
                    th { "name" } th { "unit" } th.number { "initial" } th.number { "final" } th.number { "change" }
                    th.number { "deviation" } th { "held: why" }
                } }
                tbody { @for parameter in &facts.parameters { (parameter_row(parameter)) } }
            } }
        }
    }
}

fn parameter_row(parameter: &FittedParameter) -> Markup {
    let unit = ScreenUnit::from(parameter.unit);
    let number = |si: f64| fixed(unit.from_si(si), if unit == ScreenUnit::Millimetre { 4 } else { 6 });
    let free = parameter.held.is_none();
    let of_free = |text: String| if free { text } else { String::new() };
    html! {
        tr class=(if free { "" } else { "held" }) {
            td { (parameter.name) }
            td { (unit.name()) }
            td.number { (number(parameter.initial)) }
            td.number { (of_free(number(parameter.fitted))) }
            td.number { (of_free(number(parameter.fitted - parameter.initial))) }
            td.number { (of_free(parameter.std.map_or("undetermined".to_owned(), number))) }
            td { @if let Some(held) = &parameter.held { (held.to_string()) } }
        }
    }
}

/// The same numbers for `--csv`: in millimetres, degrees and ones; nothing where a parameter is held or undetermined.
pub fn parameters_table(facts: &Facts) -> Table {
    let mut table = Table::new(["name", "unit", "initial", "final", "change", "deviation", "held"]);
    for parameter in &facts.parameters {
        let unit = ScreenUnit::from(parameter.unit);
        let number = |si: f64| format!("{:.12}", unit.from_si(si));
        let values = [parameter.initial, parameter.fitted, parameter.fitted - parameter.initial].map(number);
        let [initial, fitted, change] = values;
        let held = parameter.held.as_ref().map(ToString::to_string).unwrap_or_default();
        let deviation = parameter.std.map(number).unwrap_or_default();
        table.row([parameter.name.clone(), unit.name().to_owned(), initial, fitted, change, deviation, held]);
    }
    table
}
