//! What `--json` prints: exactly one document, with the keys, types and values that the design promises.

use std::fs;

use ballbar_tests::command::host_cal_in;
use ballbar_tests::shells::{DESIGN, puma, runs};
use serde_json::Value;
use tempfile::TempDir;

/// The document of a command that must end with this exit code and say nothing else on stdout.
fn document(folder: &TempDir, code: i32, parts: &[&[&str]]) -> Value {
    let run = host_cal_in(folder.path(), &[&parts.concat()[..], &["--json"]].concat());
    assert_eq!(run.code, code, "{}", run.transcript());
    let document = run.json();
    assert!(document.is_object() && run.stdout.ends_with("}\n"), "{}", run.stdout);
    document
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn count(value: &Value) -> u64 {
    value.as_u64().unwrap_or_else(|| panic!("{value} is no count"))
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_else(|| panic!("{value} is no text"))
}

fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap_or_else(|| panic!("{value} is no list"))
}

fn near(value: &Value, expected: f64, tolerance: f64) {
    assert!((number(value) - expected).abs() <= tolerance, "{value} is not {expected}");
}

#[test]
fn fit_documents_what_it_found() {
    let folder = puma();
    let fit = document(&folder, 0, &[&["fit"], &DESIGN, &["poses.csv", "--hold", "auto,x7", "--out", "calibrated.toml"]]);
    assert_eq!(fit["status"], "converged");
    assert_eq!((count(&fit["rank"]), count(&fit["free_parameters"]), count(&fit["poses"])), (36, 35, 180));
    assert!((2..20).contains(&count(&fit["iterations"])));
    assert_eq!(count(&fit["iterations"]) as usize + 1, list(&fit["rms_history_mm"]).len(), "steps, and the start");
    assert_eq!((&fit["verdict"], &fit["objection"]), (&"reserved".into(), &Value::Null));
    assert!(text(&fit["reasons"][0]).contains("35 were fitted"), "{}", fit["reasons"]);
    near(&fit["rms_initial_mm"], 9.427, 1e-3);
    near(&fit["rms_mm"], 0.068, 1e-3);
    assert!((10.0..1000.0).contains(&number(&fit["condition"])));
    assert!((0.0..60_000.0).contains(&number(&fit["solve_ms"])));
    assert_eq!((list(&fit["outliers"]).len(), list(&fit["warnings"]).len()), (0, 0));
    assert_eq!(fit["out"], "calibrated.toml");
    assert!(number(&fit["held_out"]["rms_mm"]) > number(&fit["rms_mm"]));

    let parameters = list(&fit["parameters"]);
    assert_eq!(parameters.len(), 54);
    let kinds = ["x", "y", "z", "alpha", "beta", "gamma", "offset", "scale"];
    for (i, parameter) in parameters.iter().enumerate() {
        let kind = kinds[i % 8];
        assert_eq!(text(&parameter["name"]), format!("{kind}{}", i / 8 + 1), "Table II's order");
        assert_eq!(text(&parameter["unit"]), ["mm", "mm", "mm", "deg", "deg", "deg", "deg", "1"][i % 8]);
        let [initial, fitted, change] = ["initial", "final", "change"].map(|key| number(&parameter[key]));
        assert!((fitted - initial - change).abs() < 1e-9, "{parameter}");
        let held = parameter["held"].as_bool().expect("true or false");
        assert_eq!((held, change == 0.0), (parameter["std"].is_null(), held), "{parameter}");
        assert!(held || number(&parameter["std"]) > 0.0, "{parameter}");
    }
    assert_eq!(parameters[0]["initial"], 0.0);
    near(&parameters[0]["final"], 12.59, 0.5);
    assert_eq!((&parameters[48]["name"], &parameters[48]["held"]), (&Value::from("x7"), &Value::from(true)));

    let missing = list(&fit["not_identified"]);
    assert_eq!(missing.len(), 18, "held by name is not the same as not identified");
    assert!(missing.iter().all(|one| !text(&one["name"]).is_empty() && !text(&one["why"]).is_empty()));
    assert_eq!(list(&fit["by_pairing"]).len(), 9);
}

#[test]
fn fit_documents_numbers_that_do_not_exist_as_null() {
    let folder = puma();
    let fit = document(&folder, 0, &[&["fit"], &DESIGN, &["poses.csv", "--hold", "none", "--prior", "none"]]);
    assert!(fit["condition"].is_null(), "infinite is no number of JSON");
    assert_eq!(count(&fit["free_parameters"]), 54);
    assert!(list(&fit["parameters"]).iter().any(|parameter| parameter["held"] == false && parameter["std"].is_null()));
}

#[test]
fn fit_documents_outliers_by_row_number_and_why_nothing_was_written() {
    let folder = puma();
    let path = folder.path().join("poses.csv");
    let text_of_poses = fs::read_to_string(&path).expect("simulated poses");
    let rows: Vec<String> = text_of_poses
        .lines()
        .enumerate()
        .map(|(i, line)| {
            let length = line.split(',').nth(8).expect("a length");
            let longer = |length: &str| length.parse::<f64>().map(|mm| format!("{:.6}", mm + 2.0)).unwrap_or_default();
            if i == 25 || i == 100 { line.replace(length, &longer(length)) } else { line.to_owned() }
        })
        .collect();
    fs::write(&path, rows.join("\n")).expect("a file in the temporary folder");
    let fit = document(&folder, 0, &[&["fit"], &DESIGN, &["poses.csv"]]);
    let left_out: Vec<u64> = list(&fit["left_out"]).iter().map(|line| count(&line["row"])).collect();
    assert_eq!(left_out, [25, 100], "rows are numbered from 1, without the header");
    assert_eq!(list(&fit["outliers"]).len(), 0);
    near(&fit["left_out"][0]["residual_mm"], 2.0, 0.5);
    assert!(number(&fit["left_out"][0]["deviations"]) > 10.0);
    let without = document(&folder, 0, &[&["fit"], &DESIGN, &["poses.csv", "--exclude", "25,100-100"]]);
    assert_eq!(without["parameters"], fit["parameters"], "as if they had not been measured");
    assert_eq!(count(&without["poses"]), count(&fit["poses"]) - 2);
    let fit = document(&folder, 0, &[&["fit"], &DESIGN, &["poses.csv", "--loss", "none"]]);
    let outliers: Vec<u64> = list(&fit["outliers"]).iter().map(count).collect();
    assert!(outliers.contains(&25) && outliers.contains(&100), "{outliers:?}");

    // The design's own lengths with much noise: whatever a fit changes is wrong.
    let noise = ["--bar", "460", "--per-pair", "6", "--sigma-mm", "5", "--seed", "1", "--out", "noise.csv"];
    runs(&folder, &[&["simulate"], &DESIGN, &noise]);
    let fit = document(&folder, 1, &[&["fit"], &DESIGN, &["noise.csv", "--hold", "paper", "--out", "calibrated.toml"]]);
    assert_eq!(fit["status"], "converged");
    assert!(text(&fit["objection"]).contains("left out"));
    assert_eq!(fit["verdict"], "not_trusted");
    assert!(fit.get("out").is_none() && !folder.path().join("calibrated.toml").exists());
}

#[test]
fn validate_documents_the_residuals() {
    let folder = puma();
    let optimised = ["validate", "--robot", "puma560-optimised", "--rig", "triangles"];
    let good = document(&folder, 0, &[&optimised, &["poses.csv", "other.csv", "--max-rms-mm", "0.1"]]);
    assert_eq!(count(&good["poses"]), 270);
    near(&good["rms_mm"], 0.084, 0.01);
    near(&good["mean_mm"], 0.0, 0.02);
    assert!((0.15..0.5).contains(&number(&good["max_abs_mm"])));
    assert_eq!(good["within_max_rms"], true);
    let pairings = list(&good["by_pairing"]);
    let names: Vec<&str> = pairings.iter().map(|pairing| text(&pairing["pairing"])).collect();
    assert_eq!(names, ["A:1", "A:2", "A:3", "B:1", "B:2", "B:3", "C:1", "C:2", "C:3"]);
    assert!(pairings.iter().all(|pairing| count(&pairing["poses"]) == 30 && number(&pairing["rms_mm"]) < 0.15));

    let bad = document(&folder, 1, &[&["validate"], &DESIGN, &["poses.csv", "--max-rms-mm", "0.1"]]);
    assert_eq!(bad["within_max_rms"], false);
    near(&bad["rms_mm"], 9.427, 1e-3);
}

#[test]
fn report_documents_its_verdict_and_proofs() {
    let folder = puma();
    let report = document(&folder, 0, &[&["report"], &DESIGN, &["poses.csv", "--validate", "other.csv", "--out", "report.html"]]);
    assert_eq!((&report["out"], &report["verdict"]), (&"report.html".into(), &"calibrated".into()));
    assert_eq!((count(&report["poses"]), list(&report["reasons"]).len(), list(&report["not_drawn"]).len()), (180, 0, 0));
    near(&report["rms_initial_mm"], 9.427, 1e-3);
    near(&report["rms_mm"], 0.068, 1e-3);
    let unseen = list(&report["unseen"]);
    assert_eq!((unseen.len(), text(&unseen[0]["name"]), count(&unseen[0]["poses"])), (2, "other.csv", 90));
    for proof in unseen {
        assert!(number(&proof["rms_mm"]) < number(&proof["max_abs_mm"]) && number(&proof["rms_initial_mm"]) > 5.0, "{proof}");
        near(&proof["mean_mm"], 0.0, 0.05);
    }
    assert_eq!(list(&report["figures"]).len(), 11);
}

#[test]
fn rank_documents_the_singular_values() {
    let folder = puma();
    let all = document(&folder, 0, &[&["rank"], &DESIGN, &["poses.csv"]]);
    assert_eq!((count(&all["rank"]), count(&all["parameters"]), count(&all["independent_expected"])), (36, 54, 36));
    let values: Vec<f64> = list(&all["singular_values"]).iter().map(number).collect();
    assert_eq!(values.len(), 54);
    assert!(values.is_sorted_by(|a, b| a >= b) && values[35] > 1e-2 && values[36] < 1e-10, "{values:?}");
    assert_eq!(list(&all["not_identified"]).len(), 18);

    let three = document(&folder, 0, &[&["rank"], &DESIGN, &["poses.csv", "other.csv", "--pairings", "A:1, B:1,C:1"]]);
    assert_eq!((count(&three["rank"]), count(&three["poses"]), list(&three["not_identified"]).len()), (33, 90, 21));
    assert_eq!(three["pairings"], serde_json::json!(["A:1", "B:1", "C:1"]));
}

#[test]
fn fk_documents_the_pose_of_the_tool() {
    let folder = TempDir::new().expect("a temporary folder");
    let zero = document(&folder, 0, &[&["fk", "--robot", "puma560", "--q", "0,0,0,0,0,0"]]);
    for (found, expected) in list(&zero["position_mm"]).iter().zip([411.48, 149.09, 1149.72]) {
        near(found, expected, 1e-9);
    }
    for (i, row) in list(&zero["rotation"]).iter().enumerate() {
        for (j, found) in list(row).iter().enumerate() {
            near(found, f64::from(i == j), 1e-12);
        }
    }
    // Rows, base from tool: a quarter turn of joint 6 brings the tool's x to the base's y.
    let turned = document(&folder, 0, &[&["fk", "--robot", "puma560", "--q", "0,0,0,0,0,90"]]);
    near(&turned["rotation"][1][0], 1.0, 1e-12);
    near(&turned["rotation"][0][1], -1.0, 1e-12);
}

#[test]
fn export_documents_the_file_or_where_it_is() {
    let folder = TempDir::new().expect("a temporary folder");
    let dh = document(&folder, 0, &[&["export", "--robot", "puma560-optimised", "--format", "dh"]]);
    assert_eq!((text(&dh["robot"]), text(&dh["format"]), &dh["calibrated"]), ("PUMA 560 (optimised)", "dh", &Value::from(false)));
    assert!(text(&dh["text"]).contains("joint,type,theta_deg,d_mm,a_mm,alpha_deg,scale\n") && dh["out"].is_null());
    // Axes 2 and 3 meet 100 m away.
    assert!(
        (0.0..1e-8).contains(&number(&dh["largest_difference_mm"]))
            && (0.0..1e-8).contains(&number(&dh["largest_difference_deg"]))
    );
    assert_eq!(list(&dh["nearly_parallel"]).len(), 1);
    let pair = &dh["nearly_parallel"][0];
    assert_eq!((&pair["joints"][0], &pair["joints"][1]), (&Value::from(2), &Value::from(3)));
    near(&pair["angle_deg"], 0.18, 0.01);
    assert!(text(&list(&dh["warnings"])[0]).contains("axes 2 and 3"));

    let urdf = document(&folder, 0, &[&["export", "--robot", "stanford", "--format", "urdf", "--out", "s.urdf"]]);
    assert_eq!(
        (&urdf["out"], &urdf["text"], &urdf["largest_difference_mm"]),
        (&Value::from("s.urdf"), &Value::Null, &Value::Null)
    );
    assert!(list(&urdf["warnings"]).iter().any(|warning| text(warning).contains("effort and velocity")));
    let import = document(&folder, 0, &[&["import", "s.urdf"]]);
    assert_eq!(
        (&import["robot"], &import["base"], &import["tip"]),
        (&Value::from("Stanford arm"), &Value::from("base"), &Value::from("tool"))
    );
    let joints: Vec<&str> = list(&import["joints"]).iter().map(text).collect();
    assert_eq!(joints, ["joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6"]);
    assert!(text(&import["text"]).contains("type = \"prismatic\"") && list(&import["warnings"]).is_empty());
}

#[test]
fn compensate_documents_each_command_and_each_target_without_one() {
    let folder = TempDir::new().expect("a temporary folder");
    let targets = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10,-40,160,20,-50,50\n159.999,-40,160,20,-50,50\n";
    fs::write(folder.path().join("targets.csv"), targets).expect("a file");
    let robots = ["compensate", "--robot", "puma560-optimised", "--nominal", "puma560", "targets.csv", "--out", "commands.csv"];
    let document = document(&folder, 1, &[&robots]);
    assert_eq!((count(&document["targets"]), &document["out"]), (2, &Value::from("commands.csv")));
    let [command] = list(&document["commands"]) else { panic!("{document}") };
    assert_eq!(count(&command["line"]), 2);
    for (joint, nominal) in [10.0, -40.0, 160.0, 20.0, -50.0, 50.0].into_iter().enumerate() {
        near(&command["nominal_q"][joint], nominal, 1e-9);
        near(&command["q"][joint], nominal, 6.0);
        assert!(number(&command["q"][joint]) != nominal);
    }
    assert_eq!((list(&command["position_mm"]).len(), list(&command["alpha_beta_gamma_deg"]).len()), (3, 3));
    assert!(number(&command["before_mm"]) > 1.0 && number(&command["before_deg"]) > 0.1, "{command}");
    assert!(number(&command["left_mm"]) < 1e-6 && number(&command["left_deg"]) < 1e-6, "{command}");
    let [missed] = list(&document["not_reached"]) else { panic!("{document}") };
    assert_eq!(count(&missed["line"]), 3);
    assert!(text(&missed["why"]).starts_with("joint 1 would have to go to 160."), "{missed}");
    for (largest, of) in [("largest_before_mm", "before_mm"), ("largest_left_mm", "left_mm"), ("largest_left_deg", "left_deg")] {
        assert_eq!(document[largest], command[of]);
    }
    assert_eq!(list(&document["warnings"]).len(), 2, "no calibration, and the second target: {document}");
}

#[test]
fn simulate_paper_and_demo_document_the_same_as_their_text() {
    let folder = TempDir::new().expect("a temporary folder");
    let simulate =
        [&["simulate"], &DESIGN[..], &["--per-pair", "2", "--bar", "460", "--pairings", "C:3", "--seed", "9"]].concat();
    let printed = document(&folder, 0, &[&simulate]);
    let rows = list(&printed["rows"]);
    let lines: Vec<String> = runs(&folder, &[&simulate]).stdout.lines().skip(1).map(str::to_owned).collect();
    assert_eq!((rows.len(), count(&printed["poses"]), lines.len()), (2, 2, 2));
    for (row, line) in rows.iter().zip(lines) {
        let q: String = list(&row["q"]).iter().map(|value| format!("{:.9},", number(value))).collect();
        assert_eq!(line, format!("C,3,{q}{:.6},460", number(&row["length_mm"])));
    }
    let written = document(&folder, 0, &[&simulate, &["--out", "poses.csv"]]);
    assert!(written.get("rows").is_none() && written["out"] == "poses.csv");

    let demo = document(&folder, 0, &[&["demo", "--out", "my-demo"]]);
    assert_eq!((text(&demo["status"]), count(&demo["poses"]), count(&demo["free_parameters"])), ("converged", 810, 36));
    assert!(list(&demo["files"]).iter().all(|file| folder.path().join(text(file)).is_file()));
    assert!(number(&demo["tool"]["after_mm"]) < 0.4 && number(&demo["tool"]["before_mm"]) > 10.0);

    let paper = document(&folder, 0, &[&["paper"]]);
    assert_eq!((list(&paper["table_one"]).len(), list(&paper["table_two"]).len()), (23, 36));
    assert_eq!((count(&paper["seed"]), count(&paper["poses"])), (1993, 810));
}
