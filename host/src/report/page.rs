//! The page: one HTML file that needs nothing else. Whatever comes from files is escaped by the templates.

use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde_json::json;

use super::facts::{Facts, RowFact};
use super::figures::{Figure, dark_rules};
use crate::identify::FittedParameter;
use crate::units::{ScreenUnit, fixed, joints_text, mm_from_m};

const STYLE: &str = include_str!("page.css");
const SCENE_SCRIPT: &str = include_str!("scene.js");
const LARGEST: usize = 12;

/// The page's text. `when` dates it.
pub fn html(facts: &Facts, figures: &[Figure], when: &str) -> String {
    let style = format!("{STYLE}@media screen and (prefers-color-scheme:dark){{{}}}", dark_rules());
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { "Calibration of " (facts.robot) }
                style { (PreEscaped(style)) }
            }
            body {
                (first_screen(facts, when))
                main {
                    @for figure in figures { (figure_markup(figure)) }
                    (scene(facts))
                    (largest(facts))
                    (parameters(facts))
                }
                script { (PreEscaped(SCENE_SCRIPT)) }
            }
        }
    };
    page.into_string()
}

fn first_screen(facts: &Facts, when: &str) -> Markup {
    let doubt = facts.doubt();
    let answer = if doubt.is_some() { "Not to be trusted as it is" } else { "Calibrated" };
    let proof = facts.proofs.first();
    let mm = |m: f64| format!("{} mm", fixed(mm_from_m(m), 3));
    html! {
        header class=(if doubt.is_some() { "bad" } else { "good" }) {
            p.robot { (facts.robot) }
            h1 { (answer) }
            @if let Some(doubt) = &doubt { p.doubt { (doubt) } }
            dl {
                @if let Some(proof) = proof {
                    (big("on lengths not seen, RMS", &mm(proof.after_summary().rms_m)))
                    (big("the same before", &mm(proof.before_summary().rms_m)))
                    (big("largest of them", &mm(proof.after_summary().max_abs_m)))
                }
                (big("on the fitted lengths, RMS", &mm(facts.after.rms_m)))
            }
            h2 { "How do we know?" }
            ul {
                li {
                    (facts.rows.len()) " lengths of " (facts.pairings.len()) " pairings identified " (facts.free_parameters()) " of "
                    (facts.parameters.len()) " parameters; the others are held, each for the reason in the table."
                }
                @for proof in &facts.proofs {
                    li {
                        "On " (proof.name) ", " (proof.after.len()) " lengths: " (mm(proof.before_summary().rms_m)) " RMS before, "
                        b { (mm(proof.after_summary().rms_m)) } " after."
                    }
                }
                @if facts.proofs.is_empty() { li { "Nothing was left out to prove the result on." } }
                @if let Some(sigma_m) = facts.sigma_m { li { "One length scatters by " (mm(sigma_m)) " (standard deviation) about the fit." } }
                li { (outliers(facts)) }
                @for remark in &facts.remarks { li { (remark) } }
            }
            p.small { "From " (facts.files.join(", ")) "; " (when) "; host-cal " (env!("CARGO_PKG_VERSION")) }
        }
    }
}

fn outliers(facts: &Facts) -> String {
    match facts.outliers.len() {
        0 => "No length stands out.".to_owned(),
        1 => "1 length stands out: look at it in the table of the largest residuals.".to_owned(),
        count => format!("{count} lengths stand out: look at them in the table of the largest residuals."),
    }
}

fn big(what: &str, number: &str) -> Markup {
    html! { div { dt { (what) } dd { (number) } } }
}

fn figure_markup(figure: &Figure) -> Markup {
    // Inside a page neither the name space nor a size of its own is needed.
    let inner =
        figure.svg.find("viewBox").map_or("", |at| &figure.svg[at..]).replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1);
    let svg = format!("<svg role=\"img\" aria-label=\"{}\" {inner}", figure.title);
    html! {
        figure id=(figure.name) class=(if figure.wide { "wide" } else { "" }) {
            h2 { (figure.title) }
            (PreEscaped(svg))
            figcaption { (figure.sentence) }
        }
    }
}

fn scene(facts: &Facts) -> Markup {
    let points: Vec<_> = facts.rows.iter().map(|row| scene_point(facts, row)).collect();
    let chucks: Vec<_> = facts.chucks.iter().map(|(name, at)| json!({ "name": name, "at": [at.x, at.y, at.z] })).collect();
    // Inside a script element only `<` could end it.
    let data = json!({ "points": points, "chucks": chucks }).to_string().replace('<', "\\u003c");
    html! {
        figure #scene .wide {
            h2 { "The shells and their poses" }
            canvas width="1600" height="900" aria-label="Spheres of all poses in space, and the chucks" {}
            figcaption {
                "Each dot is the tool's sphere in one pose, by the fit, in the colour of its chuck and larger for a larger residual: gaps \
                 are places that nothing was measured at. Drag to turn it."
            }
            script type="application/json" { (PreEscaped(data)) }
        }
    }
}

fn scene_point(facts: &Facts, row: &RowFact) -> serde_json::Value {
    let rounded = |m: f64| (m * 1e5).round() / 1e5;
    let chuck = facts.pairings.get(row.pairing).map_or(0, |pairing| pairing.1);
    json!([rounded(row.sphere_m.x), rounded(row.sphere_m.y), rounded(row.sphere_m.z), chuck, rounded(mm_from_m(row.after_m))])
}

fn largest(facts: &Facts) -> Markup {
    let mut order: Vec<usize> = (0..facts.rows.len()).collect();
    order.sort_by(|&a, &b| facts.rows[b].after_m.abs().total_cmp(&facts.rows[a].after_m.abs()));
    let stands_out = |row: usize| facts.outliers.iter().any(|outlier| outlier.row == row);
    html! {
        section #largest .wide {
            h2 { "Largest residuals" }
            p { "Poses to look at, or to measure again; a row in bold stands out from all others or from its neighbours." }
            div.scroll { table {
                thead { tr { th { "at" } th { "pairing" } th.number { "before, mm" } th.number { "after, mm" } th { "joints" } } }
                tbody { @for &i in order.iter().take(LARGEST) {
                    @let row = &facts.rows[i];
                    tr class=(if stands_out(i) { "out" } else { "" }) {
                        td { (row.place) }
                        td { (facts.pairings.get(row.pairing).map_or("", |pairing| &pairing.0)) }
                        td.number { (fixed(mm_from_m(row.before_m), 3)) }
                        td.number { (fixed(mm_from_m(row.after_m), 3)) }
                        td { (joints_text(&facts.joints, &row.q)) }
                    }
                } }
            } }
        }
    }
}

fn parameters(facts: &Facts) -> Markup {
    html! {
        section #parameters .wide {
            h2 { "Parameters" }
            p { "What the design said, what these poses say, and how surely; held parameters keep their design value (the paper's Table II)." }
            div.scroll { table {
                thead { tr {
                    th { "name" } th { "unit" } th.number { "initial" } th.number { "final" } th.number { "change" }
                    th.number { "deviation" } th { "held" }
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
            td { (parameter.parameter) }
            td { (unit.name()) }
            td.number { (number(parameter.initial)) }
            td.number { (of_free(number(parameter.fitted))) }
            td.number { (of_free(number(parameter.fitted - parameter.initial))) }
            td.number { (of_free(parameter.std.map_or("undetermined".to_owned(), number))) }
            td { @if let Some(held) = &parameter.held { (held.to_string()) } }
        }
    }
}
