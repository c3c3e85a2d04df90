//! `host-cal report`: the page says what the other commands say, needs nothing else, and lets nobody's names in as HTML.

use std::fs;

use ballbar::{FreeParameters, Kinematics};
use ballbar_calib::assess::{Answer, Assessment, Evidence};
use ballbar_calib::identify::{Fit, FitOptions, LmOptions, Loss, fit, solve_lengths};
use ballbar_calib::model::Dataset;
use ballbar_calib::simulate::tool_error;
use ballbar_tests::command::host_cal_in;
use ballbar_tests::experiment::Puma;
use ballbar_tests::shells::{DESIGN, puma, runs};
use host_cal::files::{RIGS, ROBOTS, open_robot};
use host_cal::report::{Facts, Inputs, figures, html};
use serde_json::Value;
use tempfile::TempDir;

const REPORT: [&str; 4] = ["report", "poses.csv", "--out", "report.html"];
const FIGURES: [&str; 11] = [
    "held-out",
    "shell",
    "histogram",
    "singular-values",
    "convergence",
    "workspace",
    "pairings",
    "time",
    "joints",
    "scene",
    "correlation",
];

fn page(folder: &TempDir) -> String {
    fs::read_to_string(folder.path().join("report.html")).expect("a page")
}

fn facts_of(puma: &Puma, sigma_m: f64) -> (Facts, Dataset, Fit) {
    let dataset = puma.shells(0.46, 30, sigma_m, 3);
    let fit = fit(&puma.design, &dataset, &FitOptions::default()).expect("enough poses");
    (facts(puma, &dataset, &fit), dataset, fit)
}

fn facts(puma: &Puma, dataset: &Dataset, fit: &Fit) -> Facts {
    let (robot, rig) = (&puma.design, &puma.rig);
    let assessment = Assessment::new(&Evidence { robot, rig, dataset, fit, unseen: &[], max_rms_m: None });
    Facts::new(&Inputs { robot, rig, rig_name: "triangles", dataset, fit, assessment: &assessment, remarks: &[] })
}

#[test]
fn the_page_says_what_validate_says() {
    let folder = puma();
    let told = runs(&folder, &[&REPORT, &DESIGN, &["--validate", "other.csv", "--json"]]).json();
    runs(&folder, &[&["fit", "poses.csv", "--out", "calibrated.toml"], &DESIGN]);
    let by_validate =
        runs(&folder, &[&["validate", "--robot", "calibrated.toml", "--rig", "triangles", "other.csv", "--json"]]).json();
    assert_eq!((&told["verdict"], &told["reasons"]), (&"calibrated".into(), &serde_json::json!([])));
    let number = |value: &Value| value.as_f64().expect("a number");
    let rms_mm = number(&told["unseen"][0]["rms_mm"]);
    assert!((rms_mm - number(&by_validate["rms_mm"])).abs() < 1e-6, "{told} {by_validate}");
    let page = page(&folder);
    assert!(page.contains("<h1>Calibrated</h1>"), "the first screen answers");
    assert!(page.contains(&format!("<dd>{rms_mm:.3} mm</dd>")), "the first screen has {rms_mm}");
    let max_abs_mm = number(&by_validate["max_abs_mm"]);
    assert!((number(&told["unseen"][0]["max_abs_mm"]) - max_abs_mm).abs() < 1e-6);
    assert!(page.contains(&format!("<dd>{max_abs_mm:.3} mm</dd>")));
    for named in ["Robot puma560 (built in); rig triangles; poses poses.csv", "On other.csv, 90 lengths"] {
        assert!(page.contains(named), "{named}");
    }
}

#[test]
fn the_page_is_one_file_that_asks_for_no_other() {
    let folder = puma();
    runs(&folder, &[&REPORT, &DESIGN, &["--svg", "figures", "--csv", "figures"]]);
    let page = page(&folder);
    for foreign in ["http", "<script src", "<link", "@import", "url(", "<img", "<iframe"] {
        assert!(!page.contains(foreign), "the page has `{foreign}`");
    }
    for name in FIGURES {
        assert!(page.contains(&format!("<figure id=\"{name}\"")), "{name}");
        let svg = fs::read_to_string(folder.path().join(format!("figures/{name}.svg"))).expect(name);
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && svg.contains("xmlns"), "{name}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
        let csv = fs::read_to_string(folder.path().join(format!("figures/{name}.csv"))).expect(name);
        let columns: Vec<usize> = csv.lines().map(|line| line.split(',').count()).collect();
        assert!(columns.len() > 1 && columns.iter().all(|&count| count == columns[0]), "{name}: {columns:?}");
    }
    assert_eq!(page.matches("<svg").count(), FIGURES.len());
    let parameters = fs::read_to_string(folder.path().join("figures/parameters.csv")).expect("parameters");
    assert_eq!(parameters.lines().count(), 1 + 54);
    assert!(parameters.contains("\nx2,mm,-180.000000000000,"), "{parameters}");
}

#[test]
fn names_from_files_stay_text() {
    const HOSTILE: &str = "</script><i onclick=alert(1)>&";
    let folder = puma();
    let write = |name: &str, text: String| fs::write(folder.path().join(name), text).expect("a file");
    let text_of = |list: &[(&str, &str)], name: &str| list.iter().find(|entry| entry.0 == name).expect("built in").1.to_owned();
    let robot = text_of(&ROBOTS, "puma560");
    let robot = robot.lines().filter(|line| !line.starts_with("name")).collect::<Vec<_>>().join("\n");
    write("robot.toml", format!("name = \"{HOSTILE}\"\n{robot}\n"));
    write("rig.toml", text_of(&RIGS, "triangles").replace("name = \"A\"", &format!("name = \"{HOSTILE}\"")));
    let poses = fs::read_to_string(folder.path().join("poses.csv")).expect("poses");
    write("<i>.csv", poses.replace("\nA,", &format!("\n{HOSTILE},")));
    runs(&folder, &[&["report", "--robot", "robot.toml", "--rig", "rig.toml", "<i>.csv", "--out", "report.html"]]);
    let page = page(&folder);
    assert!(page.contains("&lt;/script&gt;&lt;i onclick=alert(1)&gt;&amp;"), "the name is shown");
    assert!(page.contains("<p class=\"robot\">&lt;/script&gt;"), "so is the robot's");
    assert!(!page.contains("<i"), "a name became an element");
    assert_eq!(page.matches("</script>").count(), 2, "a name ended a script");
}

#[test]
fn a_fit_that_other_lengths_speak_against_is_not_called_calibrated() {
    let folder = puma();
    let of_design =
        ["simulate", "--robot", "puma560", "--rig", "triangles", "--bar", "460", "--per-pair", "5", "--sigma-mm", "0.05"];
    runs(&folder, &[&of_design, &["--out", "design.csv"]]);
    let run = host_cal_in(folder.path(), &[&REPORT[..], &DESIGN, &["--validate", "design.csv", "--json"]].concat());
    assert_eq!(run.code, 1, "{}", run.transcript());
    let told = run.json();
    assert_eq!(told["verdict"], "not_trusted");
    let reason = told["reasons"][0].as_str().expect("a reason");
    assert!(reason.starts_with("The design predicts better than the fit on design.csv: RMS 0.05"), "{reason}");
    assert!(page(&folder).contains("<h1>Not to be trusted as it is</h1>"));
}

#[test]
fn without_noise_the_workspace_before_is_the_designs_error_and_after_is_none() {
    let puma = Puma::default();
    let (facts, _, _) = facts_of(&puma, 0.0);
    let whole = tool_error(&puma.truth.chain, &puma.design.chain, &puma.truth.limits, 20_000, 1);
    for points in [&facts.workspace.side, &facts.workspace.top] {
        assert!(points.len() > 1_000, "{} points", points.len());
        let largest = |of: fn(&host_cal::report::WorkspacePoint) -> f64| points.iter().map(of).fold(0.0, f64::max);
        assert!(largest(|point| point.after_m) < 1e-6, "{}", largest(|point| point.after_m));
        assert!(largest(|point| point.before_m) <= whole.max_m * 1.1 && largest(|point| point.before_m) > whole.rms_m);
    }
}

#[test]
fn the_error_predicted_after_is_about_the_error_there_is() {
    let puma = Puma::default();
    let (facts, _, fit) = facts_of(&puma, 84e-6);
    let points: Vec<f64> = facts.workspace.side.iter().chain(&facts.workspace.top).map(|point| point.after_m).collect();
    let predicted_m = (points.iter().map(|m| m * m).sum::<f64>() / points.len() as f64).sqrt();
    let actual = tool_error(&puma.truth.chain, &fit.solution.chain, &puma.truth.limits, 20_000, 1);
    let ratio = predicted_m / actual.rms_m;
    assert!((0.5..2.0).contains(&ratio), "predicted {predicted_m}, actual {}", actual.rms_m);
}

#[test]
fn longitude_latitude_and_length_lead_from_the_chuck_to_the_sphere() {
    let puma = Puma::default();
    let (facts, dataset, fit) = facts_of(&puma, 84e-6);
    let kinematics = Kinematics::new(&fit.solution.chain);
    for (row, fact) in dataset.rows.iter().zip(&facts.rows) {
        let d = kinematics.length(&row.measurement.q, &row.measurement.pairing);
        let (sin, cos) = fact.latitude_rad.sin_cos();
        let bar = ballbar::Vector3::new(cos * fact.longitude_rad.cos(), cos * fact.longitude_rad.sin(), sin) * d;
        assert!((row.measurement.pairing.chuck_base_m + bar - fact.sphere_m).norm() < 1e-12);
        assert!((row.measurement.length_m - d - fact.after_m).abs() < 1e-15);
    }
}

#[test]
fn left_out_residuals_are_those_of_a_fit_without_them() {
    let puma = Puma::default();
    let dataset = facts_of(&puma, 84e-6).1;
    let fit = fit(&puma.design, &dataset, &FitOptions::plain()).expect("enough poses");
    let facts = facts(&puma, &dataset, &fit);
    let proof = facts.assessment.proofs.last().expect("enough poses");
    let folds = fit.cross_validation.expect("enough poses").folds;
    // Every pose is a posture of its own here, so that rows take turns.
    let (left_out, kept): (Vec<usize>, Vec<usize>) = (0..dataset.rows.len()).partition(|row| row % folds == 0);
    let kept: Vec<_> = kept.into_iter().map(|row| dataset.rows[row].measurement).collect();
    let free = FreeParameters::from_indices((0..54).filter(|&index| fit.parameters[index].held.is_none())).unwrap();
    let without = solve_lengths(&puma.design.chain, &kept, &free, &LmOptions::default());
    let (design, refitted) = (Kinematics::new(&puma.design.chain), Kinematics::new(&without.chain));
    for row in left_out {
        let measurement = &dataset.rows[row].measurement;
        assert!((proof.before[row].value_m - design.residual(measurement)).abs() < 1e-12, "row {row}");
        assert!((proof.after[row].value_m - refitted.residual(measurement)).abs() < 1e-9, "row {row}");
        assert!((proof.after[row].value_m - fit.residuals[row].value_m).abs() > 1e-9, "row {row}: the fit has seen it");
    }
}

/// The same poses, of which the pairings take turns.
fn in_turn<T: Clone>(rows: &[T], pairings: usize, count: usize) -> Vec<T> {
    let per_pairing = rows.len() / pairings;
    (0..count).map(|i| rows[i % pairings * per_pairing + i / pairings % per_pairing].clone()).collect()
}

#[test]
fn a_page_of_very_many_poses_is_no_larger_than_one_of_many() {
    let puma = Puma::default();
    let (facts, _, _) = facts_of(&puma, 84e-6);
    let of_many = |count: usize| {
        let mut facts = facts.clone();
        facts.rows = in_turn(&facts.rows, 9, count);
        facts.assessment.order.places = (0..count).map(|place| place as f64).collect();
        for proof in &mut facts.assessment.proofs {
            proof.before = in_turn(&proof.before, 9, count);
            proof.after = in_turn(&proof.after, 9, count);
        }
        let figures = figures(&facts).expect("drawn");
        (html(&facts, &figures, "now"), figures)
    };
    let (many, (page, figures)) = (of_many(5_000).0, of_many(20_000));
    assert!(page.len() < 4_500_000, "{} bytes", page.len());
    assert!(page.len() < many.len() * 11 / 10, "{} of {} bytes", page.len(), many.len());
    for name in ["shell", "pairings", "time", "joints", "scene"] {
        let figure = figures.iter().find(|figure| figure.name == name).expect(name);
        assert!(figure.sentence.contains("of the 20000 lengths are drawn"), "{}", figure.sentence);
        let rows = figure.drawing.as_ref().expect(name).data.rows.len();
        assert!(rows == 20_000 || name == "pairings", "{name}: {rows} rows of data");
    }

    // What is drawn is a fair choice: each chuck keeps its third.
    let (_, data) = page.split_once("<script type=\"application/json\">").expect("data");
    let data: Value = serde_json::from_str(data.split_once("</script>").expect("an end").0).expect("JSON");
    let points = data["points"].as_array().expect("points");
    assert!((2_900..3_400).contains(&points.len()), "{}", points.len());
    for chuck in 0..3 {
        let share = points.iter().filter(|point| point[1] == chuck).count() as f64 / points.len() as f64;
        assert!((share - 1.0 / 3.0).abs() < 0.02, "chuck {chuck}: {share}");
    }
}

#[test]
fn a_steady_drift_is_told_with_its_error() {
    let puma = Puma::default();
    let mut dataset = puma.shells(0.46, 30, 84e-6, 3);
    dataset.rows = in_turn(&dataset.rows, 9, dataset.rows.len());
    let told = |dataset: &Dataset| {
        let fit = fit(&puma.design, dataset, &FitOptions::default()).expect("enough poses");
        let facts = facts(&puma, dataset, &fit);
        let sentence = |name: &str| {
            figures(&facts).expect("drawn").into_iter().find(|figure| figure.name == name).expect("a figure").sentence
        };
        (facts.assessment.trend.expect("enough poses"), sentence("time"), sentence("pairings"))
    };
    let (trend, time, pairings) = told(&dataset);
    assert!(!trend.is_significant() && time.contains(" mm: no more than chance gives."), "{time}");
    assert!(pairings.contains("none is further off than chance allows"), "{pairings}");

    let drift_m = 2.0 * 84e-6;
    let last = (dataset.rows.len() - 1) as f64;
    for (i, row) in dataset.rows.iter_mut().enumerate() {
        row.measurement.length_m += drift_m * i as f64 / last;
    }
    let (trend, time, _) = told(&dataset);
    // The parameters take a part of it, and never more than there is.
    assert!((0.5..1.1).contains(&(trend.change_m / drift_m)), "{trend:?}");
    assert!(trend.is_significant() && time.contains("standard errors, more than chance gives."), "{time}");
    assert!(!time.contains("follow one another (drift"), "{time}");
}

#[test]
fn a_single_length_not_seen_is_seen_in_its_figure() {
    let (mut facts, _, _) = facts_of(&Puma::default(), 84e-6);
    let circles = |facts: &Facts| {
        let figures = figures(facts).expect("drawn");
        let proof = figures.iter().find(|figure| figure.name == "held-out").and_then(|figure| figure.drawing.as_ref());
        proof.expect("a drawing").svg.matches("<circle").count()
    };
    assert_eq!(circles(&facts), 0, "curves");
    for residuals in facts.assessment.proofs.iter_mut().flat_map(|proof| [&mut proof.before, &mut proof.after]) {
        residuals.truncate(1);
    }
    assert_eq!(circles(&facts), 2, "before and after");
}

#[test]
fn correlations_are_one_on_the_diagonal_and_symmetric() {
    let (facts, _, _) = facts_of(&Puma::default(), 84e-6);
    let values = &facts.correlation.values;
    assert_eq!(values.nrows(), facts.free_parameters());
    for i in 0..values.nrows() {
        assert!((values[(i, i)] - 1.0).abs() < 1e-9);
        assert!((0..i).all(|j| (values[(i, j)] - values[(j, i)]).abs() < 1e-9 && values[(i, j)].abs() <= 1.0));
    }
    assert_eq!(figures(&facts).expect("drawn").len(), FIGURES.len());
}

#[test]
fn an_outlier_drift_and_few_parameters_are_reasons_for_reserve() {
    let puma = Puma::default();
    let mut dataset = puma.shells(0.46, 30, 84e-6, 3);
    let fitted = |dataset: &Dataset| {
        let options = FitOptions { loss: Loss::None, ..FitOptions::default() };
        fit(&puma.design, dataset, &options).expect("enough poses")
    };
    assert_eq!(facts(&puma, &dataset, &fitted(&dataset)).assessment.answer, Answer::Calibrated);

    let reasons = |dataset: &Dataset| {
        let verdict = facts(&puma, dataset, &fitted(dataset)).assessment;
        assert_eq!(verdict.answer, Answer::Reserved, "{:?}", verdict.reasons);
        verdict.reasons.join(" ")
    };
    dataset.rows[17].measurement.length_m += 2e-3;
    assert!(reasons(&dataset).contains("1 length stands out"), "{}", reasons(&dataset));
    let without = facts(&puma, &dataset, &fit(&puma.design, &dataset, &FitOptions::default()).expect("enough poses"));
    let left_out: Vec<usize> = without.left_out.iter().map(|(row, _)| row.number).collect();
    assert_eq!((left_out, without.rows.len()), (vec![dataset.rows[17].number], dataset.rows.len() - 1));

    dataset.rows[17].measurement.length_m -= 2e-3;
    let drifting = |mut dataset: Dataset| {
        for (i, row) in dataset.rows.iter_mut().enumerate() {
            row.measurement.length_m += 1e-3 * (i as f64 / 60.0).sin();
        }
        dataset
    };
    // Pairing by pairing, the same drift is as if the pairings were off.
    let by_pairing = drifting(dataset.clone());
    let offset = facts(&puma, &by_pairing, &fitted(&by_pairing)).assessment.farthest_offset.expect("enough poses");
    assert!(offset.is_beyond_chance, "{offset:?}");
    dataset.rows = in_turn(&dataset.rows, 9, dataset.rows.len());
    let dataset = drifting(dataset);
    assert!(reasons(&dataset).contains("Residuals follow one another"), "{}", reasons(&dataset));

    let mut one_pairing = puma.shells(0.46, 200, 84e-6, 3);
    one_pairing.rows.retain(|row| row.pairing.chuck == 0 && row.pairing.sphere == 0);
    assert!(reasons(&one_pairing).contains("of the 36 parameters"), "{}", reasons(&one_pairing));
}

#[test]
fn a_robot_that_is_as_designed_has_nothing_to_correct() {
    let puma = Puma::default();
    let same = Puma { truth: open_robot("puma560").expect("built in"), ..Puma::default() };
    let dataset = same.shells(0.46, 30, 0.0, 3);
    let fit = fit(&puma.design, &dataset, &FitOptions::default()).expect("enough poses");
    let facts = facts(&puma, &dataset, &fit);
    assert_eq!(facts.assessment.answer, Answer::Unchanged, "{:?}", facts.assessment.reasons);
    let figures = figures(&facts).expect("drawn");
    let missing: Vec<&str> = figures.iter().filter(|figure| figure.drawing.is_none()).map(|figure| figure.name).collect();
    assert_eq!(missing, ["histogram"], "residuals of rounding have no distribution");
}

#[test]
fn poses_that_the_fit_has_seen_are_refused_as_a_proof() {
    let folder = puma();
    let poses = fs::read_to_string(folder.path().join("poses.csv")).expect("poses");
    let seen: String = poses.lines().take(4).map(|line| format!("{line}\n")).collect();
    fs::write(folder.path().join("seen.csv"), seen).expect("a file");
    let run = host_cal_in(folder.path(), &[&REPORT[..], &DESIGN, &["--validate", "seen.csv"]].concat());
    assert_eq!(run.code, 2, "{}", run.transcript());
    assert!(run.stderr.contains("seen.csv: 3 of its 3 poses are among the fitted ones"), "{}", run.stderr);
    assert!(!folder.path().join("report.html").exists());
}

#[test]
fn figures_that_cannot_be_drawn_say_why() {
    let folder = puma();
    let poses = fs::read_to_string(folder.path().join("poses.csv")).expect("poses");
    let two: String = poses.lines().take(3).map(|line| format!("{line}\n")).collect();
    fs::write(folder.path().join("two.csv"), two).expect("a file");
    // Two lengths and one free parameter: neither can be left out, and nothing can be correlated.
    let kinds = ["x", "y", "z", "alpha", "beta", "gamma", "offset", "scale"];
    let names = (0..54).map(|i| format!("{}{}", kinds[i % 8], i / 8 + 1)).filter(|name| name != "x1");
    let hold = names.collect::<Vec<_>>().join(",");
    let run = host_cal_in(
        folder.path(),
        &[
            &["report", "two.csv", "--out", "report.html", "--svg", "figures", "--hold", &hold, "--prior", "none", "--json"][..],
            &DESIGN,
        ]
        .concat(),
    );
    assert_eq!(run.code, 1, "{}", run.transcript());
    let told = run.json();
    let page = page(&folder);
    let missing = told["not_drawn"].as_array().expect("a list");
    assert_eq!(
        missing.iter().map(|one| one["name"].as_str().unwrap_or_default()).collect::<Vec<_>>(),
        ["held-out", "correlation"]
    );
    for one in missing {
        let (name, why) = (one["name"].as_str().unwrap_or_default(), one["why"].as_str().unwrap_or_default());
        assert!(why.starts_with("Not drawn: ") && page.contains(why), "{one}");
        assert!(page.contains(&format!("<figure id=\"{name}\" class=\"missing")), "{name}");
        assert!(!folder.path().join(format!("figures/{name}.svg")).exists(), "{name}");
    }
    assert_eq!(told["figures"].as_array().map(Vec::len), Some(FIGURES.len() - 2));
}
