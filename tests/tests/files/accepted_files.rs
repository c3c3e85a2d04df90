//! Forms of the same measured poses that read the same, and weights that count.

use std::fs;

use ballbar_tests::command::host_cal_in;
use ballbar_tests::shells::{DESIGN, puma, runs};
use host_cal::files::{append_poses, parse_rig, parse_robot};
use serde_json::Value;
use tempfile::TempDir;

fn read(folder: &TempDir, file: &str) -> String {
    fs::read_to_string(folder.path().join(file)).expect("simulated poses")
}

fn put(folder: &TempDir, file: &str, text: &str) {
    fs::write(folder.path().join(file), text).expect("a file in the temporary folder");
}

/// The rows of a file of poses as fields, header first.
fn table(text: &str) -> Vec<Vec<&str>> {
    text.lines().map(|line| line.split(',').collect()).collect()
}

fn csv(rows: impl IntoIterator<Item = Vec<String>>) -> String {
    rows.into_iter().map(|row| row.join(",") + "\n").collect()
}

/// A fit's document, less what differs between files that hold the same.
fn fit(folder: &TempDir, files: &[&str]) -> Value {
    let run = runs(folder, &[&["fit"], &DESIGN, files, &["--json"]]);
    assert_eq!(run.stderr, "", "{files:?}");
    let mut document = run.json();
    // Optional columns say what else may be unknown.
    for key in ["solve_ms", "largest", "outlier_details", "unknowns"] {
        document.as_object_mut().expect("an object").remove(key);
    }
    document
}

#[test]
fn comments_orders_line_ends_spaces_and_quotes_do_not_matter() {
    let folder = puma();
    let text = read(&folder, "poses.csv");
    let expected = fit(&folder, &["poses.csv"]);
    let lines: Vec<&str> = text.lines().collect();
    let quoted = |row: Vec<&str>| row.iter().map(|field| format!("\"{field}\"")).collect();
    let spaced = |row: Vec<&str>| row.iter().map(|field| format!("  {field}\t")).collect();
    let reversed = |row: Vec<&str>| row.iter().rev().map(|field| (*field).to_owned()).collect();
    let forms = [
        ("comments", format!("# before\n\n{}\n# units: degrees, \"mm\"\n{}\n#\n", lines[0], lines[1..].join("\n\n"))),
        ("columns in another order", csv(table(&text).into_iter().map(reversed))),
        ("line ends of Windows", text.replace('\n', "\r\n")),
        ("no end of the last line", text.trim_end().to_owned()),
        ("spaces around fields", csv(table(&text).into_iter().map(spaced))),
        ("quotes around fields", csv(table(&text).into_iter().map(quoted))),
        ("a byte order mark", format!("\u{feff}{text}")),
        (
            "no optional column",
            csv(table(&text).into_iter().map(|row| row[..9].iter().map(|field| (*field).to_owned()).collect())),
        ),
        ("exponents", text.replace(",460\n", ",4.6e2\n").replace("A,1,-116.336893758", "A,1,-1.16336893758E+2")),
    ];
    for (what, form) in forms {
        assert_ne!(form, text, "{what}");
        put(&folder, "form.csv", &form);
        assert_eq!(fit(&folder, &["form.csv"]), expected, "{what}");
    }
}

#[test]
fn two_files_read_like_one_and_rows_are_placed_in_theirs() {
    let folder = puma();
    let text = read(&folder, "poses.csv");
    let lines: Vec<&str> = text.lines().collect();
    put(&folder, "first.csv", &(lines[..100].join("\n") + "\n"));
    put(&folder, "second.csv", &format!("# the rest\n{}\n{}\n", lines[0], lines[100..].join("\n")));
    assert_eq!(fit(&folder, &["first.csv", "second.csv"]), fit(&folder, &["poses.csv"]));

    let largest = |files: &[&str]| runs(&folder, &[&["fit"], &DESIGN, files, &["--json"]]).json()["largest"].clone();
    let (whole, parts) = (largest(&["poses.csv"]), largest(&["first.csv", "second.csv"]));
    for (one, other) in whole.as_array().expect("a list").iter().zip(parts.as_array().expect("a list")) {
        assert_eq!(one["row"], other["row"], "rows are numbered over all files");
        let line: u64 = one["row"].as_u64().expect("a row") + 1;
        let place = if line <= 100 { format!("first.csv:{line}") } else { format!("second.csv:{}", line - 98) };
        assert_eq!((&one["place"], &other["place"]), (&Value::from(format!("poses.csv:{line}")), &Value::from(place)));
    }
}

#[test]
fn set_and_time_columns_are_taken_and_change_nothing() {
    let folder = puma();
    let text = read(&folder, "poses.csv");
    let with_time = |(i, line): (usize, &str)| if i == 0 { format!("t_s,{line}\n") } else { format!("{}.25,{line}\n", i * 3) };
    put(
        &folder,
        "timed.csv",
        &text.lines().enumerate().map(with_time).collect::<String>().replace(",460\n", ",\"shell 1, night\"\n"),
    );
    assert_eq!(fit(&folder, &["timed.csv"]), fit(&folder, &["poses.csv"]));
}

/// `poses.csv` with a column `sigma_mm`, and behind it `other.csv` with lengths that are 0 mm to below `wrong_mm` too long.
fn weighed(folder: &TempDir, sigma_mm: &str, garbage_sigma_mm: &str, wrong_mm: usize) -> String {
    let (good, garbage) = (read(folder, "poses.csv"), read(folder, "other.csv"));
    let good_rows = table(&good).into_iter().enumerate().map(|(i, row)| {
        let last = if i == 0 { "sigma_mm" } else { sigma_mm };
        row.iter().map(|field| (*field).to_owned()).chain([last.to_owned()]).collect()
    });
    let garbage_rows = table(&garbage).into_iter().enumerate().skip(1).map(|(i, row)| {
        let mut row: Vec<String> = row.iter().map(|field| (*field).to_owned()).chain([garbage_sigma_mm.to_owned()]).collect();
        let length: f64 = row[8].parse().expect("a length");
        row[8] = format!("{:.6}", length + (i * 7 % wrong_mm) as f64);
        row
    });
    csv(good_rows.chain(garbage_rows))
}

/// Each parameter's fitted value.
fn fitted(document: &Value) -> Vec<f64> {
    let parameters = document["parameters"].as_array().expect("a list");
    parameters.iter().map(|parameter| parameter["final"].as_f64().expect("a number")).collect()
}

fn worst_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn equal_weights_are_none_and_garbage_that_is_said_to_be_garbage_does_no_harm() {
    let folder = puma();
    const PLAIN: [&str; 4] = ["--prior", "none", "--loss", "none"];
    let good = fitted(&fit(&folder, &[&["poses.csv"][..], &PLAIN].concat()));
    let document = |sigma: &str, garbage_sigma: &str| {
        put(&folder, "weighed.csv", &weighed(&folder, sigma, garbage_sigma, 26));
        let run = host_cal_in(folder.path(), &[&["fit"], &DESIGN[..], &PLAIN, &["weighed.csv", "--json"]].concat());
        fitted(&run.json())
    };
    let trusted = document("0.1", "0.1");
    assert!(worst_difference(&trusted, &good) > 0.5, "garbage does harm: {}", worst_difference(&trusted, &good));
    assert!(worst_difference(&document("70", "70"), &trusted) < 1e-9, "only ratios of sigma count");
    let distrusted = document("0.084", "1e6");
    assert!(worst_difference(&distrusted, &good) < 1e-5, "{}", worst_difference(&distrusted, &good));
}

#[test]
fn a_row_within_its_own_sigma_is_no_outlier() {
    let folder = puma();
    put(&folder, "weighed.csv", &weighed(&folder, "0.084", "1e3", 26));
    let run = runs(&folder, &[&["fit"], &DESIGN, &["weighed.csv", "--json"]]);
    assert_eq!(run.json()["outliers"], serde_json::json!([]));
}

#[test]
fn distrusted_rows_do_not_decide_whether_a_fit_is_kept() {
    let folder = puma();
    // Twice as many rows that agree with the design, but are said to be worth nothing.
    let simulate = ["--bar", "610", "--per-pair", "40", "--seed", "8", "--out", "other.csv"];
    runs(&folder, &[&["simulate"], &DESIGN, &simulate]);
    put(&folder, "weighed.csv", &weighed(&folder, "0.084", "1e6", 1));
    let run = host_cal_in(folder.path(), &[&["fit"], &DESIGN[..], &["weighed.csv", "--json"]].concat());
    let document = run.json();
    let history = document["rms_history_mm"].as_array().expect("a list");
    let last = history.last().expect("a step").as_f64().expect("a number");
    let rms = document["rms_mm"].as_f64().expect("a number");
    assert!(run.code == 0 && (rms - last).abs() < 1e-6, "exit code {}, {rms} mm is not {last} mm", run.code);
}

#[test]
fn the_examples_of_the_documentation_are_files_that_are_read() {
    let docs = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/files.md")).expect("docs/files.md");
    let blocks: Vec<&str> = docs.split("```").skip(1).step_by(2).collect();
    let block = |language: &str, n: usize| -> &str {
        blocks.iter().filter_map(|block| block.strip_prefix(language)).nth(n).expect("a block of this language")
    };
    let source = |text: &str| host_cal::files::Source::new("docs/files.md", text);
    let robot = parse_robot(&source(block("toml\n", 0))).expect("the robot");
    let rig = parse_rig(&source(block("toml\n", 1))).expect("the rig");
    assert_eq!((robot.chain.joints(), rig.chucks.len(), rig.spheres.len()), (2, 1, 1));
    let mut poses = ballbar_calib::model::Dataset::default();
    append_poses(&mut poses, &source(block("csv\n", 0)), &robot, &rig).expect("the poses");
}
