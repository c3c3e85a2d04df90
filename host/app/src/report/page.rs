//! The page: one HTML file that needs nothing else. Whatever comes from files is escaped by the templates.

use ballbar::Vector3;
use ballbar_calib::assess::{Answer, Assessment, Proof, ProofKind};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde_json::json;

use super::facts::{Facts, RowFact};
use super::figures::{CHUCKS, Figure, dark_rules, drawn, hex, wires_m};
use super::tables::{largest, left_out, parameters};
use crate::text::visible;
use crate::units::{fixed, mm_from_m};

const STYLE: &str = include_str!("page.css");
const SCENE_SCRIPT: &str = include_str!("scene.js");
/// The figure that `scene.js` brings to life.
const SCENE: &str = "scene";

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
                    @for figure in figures { (figure_markup(figure, facts)) }
                    @if let Some(wrong) = left_out(facts) { (wrong) }
                    (largest(facts))
                    (parameters(facts))
                }
                script { (PreEscaped(SCENE_SCRIPT)) }
            }
        }
    };
    visible(&page.into_string()).into_owned()
}

fn first_screen(facts: &Facts, when: &str) -> Markup {
    let Assessment { answer, reasons, .. } = &facts.assessment;
    let colour = match answer {
        Answer::Calibrated | Answer::Unchanged => "good",
        Answer::Reserved => "reserved",
        Answer::NotTrusted => "bad",
    };
    html! {
        header class=(colour) {
            p.robot { (facts.robot) }
            h1 { (answer.words()) }
            @for reason in reasons { p.reason { (reason) } }
            (numbers(facts))
            div.words {
                div {
                    h2 { "How do we know?" }
                    ul { @for ground in grounds(facts) { li { (ground) } } }
                }
                div {
                    h2 { "What this does not say" }
                    ul { @for limit in not_said(facts) { li { (limit) } } }
                }
            }
            p.small {
                "Robot " (facts.robot_file) "; rig " (facts.rig_file) "; poses " (facts.files.join(", ")) "; made " (when) " by host-cal "
                (env!("CARGO_PKG_VERSION"))
            }
        }
    }
}

/// The few numbers that matter most.
fn numbers(facts: &Facts) -> Markup {
    let mm = |m: f64| format!("{} mm", fixed(mm_from_m(m), 3));
    html! {
        dl {
            @if let Some(proof) = facts.assessment.decisive_proof() {
                @let (before, after) = (proof.before_summary(), proof.after_summary());
                (big("lengths not seen: RMS before", &mm(before.rms_m)))
                (big("RMS after", &mm(after.rms_m)))
                (big("largest after", &mm(after.max_abs_m)))
            } @else {
                (big("fitted lengths: RMS before", &mm(facts.before.rms_m)))
                (big("RMS after", &mm(facts.after.rms_m)))
            }
            (big("poses fitted", &facts.rows.len().to_string()))
        }
    }
}

/// What the answer rests on.
fn grounds(facts: &Facts) -> Vec<Markup> {
    let mm = |m: f64| format!("{} mm", fixed(mm_from_m(m), 3));
    let pairings = facts.pairings.len();
    let told = html! {
        (facts.rows.len()) " lengths of " (pairings) (if pairings == 1 { " pairing" } else { " pairings" }) " tell " (facts.told)
        " of the " (facts.independent) " parameters that lengths can tell of this robot, of " (facts.parameters.len())
        " in all; the table says why each of the others is held."
    };
    let proof = |proof: &Proof| {
        let after = proof.after_summary();
        html! {
            "On " (proof.name) ", " (after.count) " lengths in " (proof.posture_count()) " postures: RMS " (mm(proof.before_summary().rms_m))
            " before, " b { (mm(after.rms_m)) } " after"
            @if let Some(error_m) = proof.rms_error_m() { " (standard error " (mm(error_m)) ", by posture)" }
            "; mean " (mm(after.mean_m)) ", largest " (mm(after.max_abs_m)) "."
        }
    };
    let fitted = html! {
        "On the fitted lengths themselves: RMS " (mm(facts.before.rms_m)) " before, " (mm(facts.after.rms_m))
        " after, which alone would prove nothing."
        @if let Some(base) = facts.base_alone {
            " With only the place of the robot's base corrected it would be " (mm(base.rms_m)) "."
        }
    };
    let mut grounds = vec![told];
    grounds.extend(facts.assessment.proofs.iter().map(proof));
    if facts.assessment.proofs.is_empty() {
        grounds.push(html! { "Nothing was left out to prove the result on." });
    }
    grounds.push(fitted);
    if let Some(sigma_m) = facts.sigma_m {
        let sigma = fixed(mm_from_m(sigma_m), 3);
        grounds.push(html! { "One length scatters about the fit by " (sigma) " mm (standard deviation)." });
    }
    if !facts.left_out.is_empty() {
        let (wrong, all) = (facts.left_out.len(), facts.left_out.len() + facts.rows.len());
        grounds.push(html! { (wrong) " of " (all) " lengths contradict the others and were left out; they are listed below." });
    }
    if facts.outliers.is_empty() {
        grounds.push(html! { "No length stands out from the others." });
    }
    grounds.extend(facts.remarks.iter().map(|remark| html! { (remark) }));
    grounds
}

/// What nobody may conclude from the page.
fn not_said(facts: &Facts) -> Vec<&'static str> {
    let others = "That other lengths were tried: the proof is by parts of the same poses, left out in turn. Poses of another day or bar \
                  (--validate) are a better one.";
    let is_apart = facts.assessment.proofs.iter().any(|proof| proof.kind == ProofKind::Apart);
    let always = [
        "That lengths and places are true: an error common to all lengths (the bar's zero and scale) or of the coordinates in the \
         rig's file goes into the parameters and shows in no residual.",
        "How the robot does under another load or temperature, how well it repeats, and for how long the result holds.",
    ];
    (!is_apart).then_some(others).into_iter().chain(always).collect()
}

fn big(what: &str, number: &str) -> Markup {
    html! { div { dt { (what) } dd { (number) } } }
}

fn figure_markup(figure: &Figure, facts: &Facts) -> Markup {
    let wide = if figure.wide { "wide" } else { "" };
    let Some(drawing) = &figure.drawing else {
        return html! { figure id=(figure.name) class={ "missing " (wide) } { h2 { (figure.title) } figcaption { (figure.sentence) } } };
    };
    // Inside a page neither the name space nor a size of its own is needed.
    let inner =
        drawing.svg.find("viewBox").map_or("", |at| &drawing.svg[at..]).replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1);
    let svg = format!("<svg role=\"img\" aria-label=\"{}\" {inner}", figure.title);
    let turns = figure.name == SCENE;
    html! {
        figure id=(figure.name) class=(wide) {
            h2 { (figure.title) }
            // Where it is wider than the screen, it is moved under it.
            div.drawing tabindex=[(figure.wide && !turns).then_some("0")] { (PreEscaped(svg)) }
            @if turns {
                canvas tabindex="0" role="img" aria-label="The shells and their poses; arrow keys turn them" {}
                script type="application/json" { (PreEscaped(scene_data(facts))) }
            }
            figcaption { (figure.sentence) @if turns { span.live { " Drag, or press arrow keys, to turn it." } } }
        }
    }
}

/// What `scene.js` draws: base frame, metres; residuals in millimetres.
fn scene_data(facts: &Facts) -> String {
    let rounded = |m: f64| (m * 1e5).round() / 1e5;
    let place = |at: &Vector3<f64>| [at.x, at.y, at.z].map(rounded);
    let point = |row: &RowFact| {
        let chuck = facts.pairings.get(row.pairing).map_or(0, |pairing| pairing.1);
        json!([place(&row.sphere_m), chuck, mm_from_m(row.after_m)])
    };
    let wires = facts.shells.iter().flat_map(|shell| {
        let wires = wires_m(facts, shell).into_iter();
        wires.map(|wire| json!({ "chuck": shell.chuck, "line": wire.iter().map(place).collect::<Vec<_>>() }))
    });
    let colours = CHUCKS.map(|(light, dark)| [hex(light), hex(dark)]);
    let data = json!({
        "points": drawn(facts).into_iter().map(|row| point(&facts.rows[row])).collect::<Vec<_>>(),
        "chucks": facts.chucks.iter().map(|(name, at)| json!({ "name": name, "at": place(at) })).collect::<Vec<_>>(),
        "wires": wires.collect::<Vec<_>>(),
        "colours": colours,
    });
    // Inside a script element only `<` could end it.
    data.to_string().replace('<', "\\u003c")
}
