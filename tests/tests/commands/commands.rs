//! What every subcommand prints for people, and what it writes.

use std::fs;

use ballbar_tests::command::{Run, host_cal_in};
use ballbar_tests::shells::{DESIGN, puma, runs, simulate};
use tempfile::TempDir;

const FIT: [&str; 6] = ["fit", "--robot", "puma560", "--rig", "triangles", "poses.csv"];
const VALIDATE: [&str; 6] = ["validate", "--robot", "calibrated.toml", "--rig", "triangles", "other.csv"];

/// A snapshot of text, less what no two runs share: times and rounding.
fn snapshot(name: &str, command: &[&str], text: &str) {
    insta::with_settings!({
        description => format!("host-cal {}", command.join(" ")),
        omit_expression => true,
        filters => vec![
            (r#"when = "\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ""#, "when = [TIME]"),
            (r"\b\d(\.\d)?e-1[0-9]\b", "[ROUNDING]"),
            (r"(\d\.\d{6})\d{4,}", "$1…"),
        ],
    }, {
        insta::assert_snapshot!(name, text);
    });
}

/// Runs a command that must end well and snapshots all that it printed.
fn shows(folder: &TempDir, name: &str, args: &[&str]) -> Run {
    let run = runs(folder, &[args]);
    snapshot(name, args, &run.transcript());
    run
}

fn read(folder: &TempDir, file: &str) -> String {
    fs::read_to_string(folder.path().join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// The lines of a fit's screen before the table of parameters.
fn headline(run: &Run) -> &str {
    run.stdout.split_once("\n  parameter").expect("a table of parameters").0
}

#[test]
fn help_says_what_each_command_is_for_and_how_to_begin() {
    let folder = TempDir::new().expect("a temporary folder");
    shows(&folder, "help", &["--help"]);
    let with_a_board = ["ports", "stream", "log", "status", "home", "lvdt", "apply", "pose", "virtual-board"];
    for command in
        ["fit", "validate", "rank", "report", "fk", "export", "import", "compensate", "plan", "simulate", "paper", "demo"]
            .into_iter()
            .chain(with_a_board)
    {
        let long = shows(&folder, &format!("help_{command}"), &[command, "--help"]);
        assert_eq!(long.stdout, runs(&folder, &[&["help", command]]).stdout);
        assert_eq!(long.stdout, runs(&folder, &[&[command, "-h"]]).stdout);
    }
    assert_eq!(runs(&folder, &[&["--version"]]).stdout, format!("host-cal {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn fk_shows_where_the_tool_of_a_robot_with_revolute_or_prismatic_joints_is() {
    let folder = TempDir::new().expect("a temporary folder");
    shows(&folder, "fk_revolute", &["fk", "--robot", "puma560", "--q", "10,-40,100,20,-30,50"]);
    shows(&folder, "fk_prismatic", &["fk", "--robot", "stanford", "--q", "10,-40,500,20,-30,50"]);
}

#[test]
fn export_prints_a_file_or_writes_it_and_says_what_the_format_cannot_hold() {
    let folder = TempDir::new().expect("a temporary folder");
    shows(&folder, "export_urdf", &["export", "--robot", "puma560", "--format", "urdf"]);
    shows(&folder, "export_octave", &["export", "--robot", "scara", "--format", "octave"]);
    shows(&folder, "export_dh_to_a_file", &["export", "--robot", "puma560-optimised", "--format", "dh", "--out", "dh.csv"]);
    shows(&folder, "export_mdh", &["export", "--robot", "stanford", "--format", "mdh"]);
    let no_urdf = host_cal_in(folder.path(), &["export", "--robot", "scara", "--format", "c", "--joint-zero", "encoder"]);
    snapshot("export_refused", &["export", "--format", "c", "--joint-zero", "encoder"], &no_urdf.transcript());
}

#[test]
fn import_writes_a_robot_file_of_what_export_wrote() {
    let folder = TempDir::new().expect("a temporary folder");
    runs(&folder, &[&["export", "--robot", "scara", "--format", "urdf", "--joint-zero", "encoder", "--out", "scara.urdf"]]);
    shows(&folder, "import_to_a_file", &["import", "scara.urdf", "--out", "scara.toml"]);
    snapshot("imported_toml", &["import", "scara.urdf"], &read(&folder, "scara.toml"));
}

#[test]
fn simulate_writes_the_same_poses_to_a_file_as_to_stdout_and_the_same_for_the_same_seed() {
    let folder = TempDir::new().expect("a temporary folder");
    let args =
        ["simulate", "--robot", "stanford", "--rig", "triangles", "--pairings", "A:1,B:3", "--per-pair", "2", "--seed", "5"];
    let printed = shows(&folder, "simulate_to_stdout", &args).stdout;
    shows(&folder, "simulate_to_a_file", &[&args[..], &["--out", "poses.csv"]].concat());
    assert_eq!(read(&folder, "poses.csv"), printed);
    assert_eq!(runs(&folder, &[&args]).stdout, printed);
    assert_ne!(runs(&folder, &[&args[..9], &["--seed", "6"]]).stdout, printed);
    let noisy = runs(&folder, &[&args, &["--sigma-mm", "0.5"]]).stdout;
    let without_length = |text: &str| -> Vec<String> {
        text.lines().map(|line| line.split(',').enumerate().filter(|(i, _)| *i != 8).map(|(_, field)| field).collect()).collect()
    };
    assert_ne!(noisy, printed);
    assert_eq!(without_length(&noisy), without_length(&printed), "noise changes lengths, not poses");
}

#[test]
fn fit_shows_what_it_found_for_each_rule_of_holding() {
    let folder = puma();
    shows(&folder, "fit", &FIT);
    shows(&folder, "fit_damped_by_the_diagonal", &[&FIT[..], &["--damping", "diagonal"]].concat());
    shows(&folder, "fit_hold_auto_and_names", &[&FIT[..], &["--hold", "auto,scale3,x7"]].concat());

    const PLAIN: [&str; 2] = ["--prior", "none"];
    let auto = shows(&folder, "fit_without_prior", &[&FIT[..], &PLAIN].concat());
    let paper = runs(&folder, &[&FIT, &PLAIN, &["--hold", "paper"]]);
    // The same parameters by other steps: those of the paper's set are taken in the frames of the file.
    let table = |text: &str| text.split_once("parameter  unit").expect("a table of parameters").1.to_owned();
    assert_eq!(table(&paper.stdout.replace("as in the paper", "redundant")), table(&without_reasons(&auto.stdout)));
    let names = "offset1,z2,alpha2,offset2,z3,alpha3,offset3,z4,alpha4,offset4,z5,alpha5,offset5,z6,alpha6,offset6,z7,alpha7";
    let named = runs(&folder, &[&FIT, &PLAIN, &["--hold", names]]);
    assert_eq!(named.stdout.replace("by name", "as in the paper"), paper.stdout);

    // Redundant parameters share their changes in a way that rounding decides: the headline only.
    let args = [&FIT[..], &PLAIN, &["--hold", "none"]].concat();
    let none = runs(&folder, &[&args]);
    snapshot("fit_hold_none", &args, headline(&none));
    assert!(none.stdout.contains("undetermined"));
}

/// A fit's screen with one word for every reason of redundancy.
fn without_reasons(text: &str) -> String {
    let line = |line: &str| line.split_once("redundant with").map_or(line, |(before, _)| before).to_owned();
    let one_word = |text: &str| if text.ends_with("held: ") { format!("{text}redundant\n") } else { format!("{text}\n") };
    text.lines().map(|text| one_word(&line(text))).collect()
}

#[test]
fn fit_shows_rows_that_stand_out() {
    let folder = puma();
    let mut lines: Vec<String> = read(&folder, "poses.csv").lines().map(str::to_owned).collect();
    let fields: Vec<&str> = lines[60].split(',').collect();
    let length: f64 = fields[8].parse().expect("a length");
    lines[60] = lines[60].replace(fields[8], &format!("{:.6}", length + 3.0));
    fs::write(folder.path().join("poses.csv"), lines.join("\n")).expect("a file in the temporary folder");
    let run = runs(&folder, &[&FIT]);
    let outliers = run.stdout.split_once("largest residuals").expect("a table of the largest residuals").1;
    snapshot("fit_outliers", &FIT, outliers);
}

#[test]
fn fit_writes_a_robot_that_keeps_the_comments_and_that_every_command_reads() {
    let folder = puma();
    let run = runs(&folder, &[&FIT, &["--out", "calibrated.toml"]]);
    assert!(run.stdout.ends_with("\nwrote calibrated.toml\n"));
    let text = read(&folder, "calibrated.toml");
    snapshot("calibrated_toml", &[&FIT[..], &["--out", "calibrated.toml"]].concat(), &text);

    let design = host_cal::files::ROBOTS.iter().find(|(name, _)| *name == "puma560").expect("built in").1;
    let comments =
        |text: &str| -> Vec<String> { text.lines().filter_map(|line| Some(line.split_once('#')?.1.to_owned())).collect() };
    let (note, rest) = text.split_at(text.find("# Unimation").expect("the design's first comment"));
    assert!(note.starts_with("# CALIBRATED"), "the first line says what the numbers are: {note}");
    assert!(comments(rest).starts_with(&comments(design)), "all comments of the design stand there in their order");

    let tool = |robot: &str| runs(&folder, &[&["fk", "--robot", robot, "--q", "10,-40,100,20,-30,50"]]).stdout;
    assert_ne!(tool("calibrated.toml"), tool("puma560"));
    shows(&folder, "validate", &VALIDATE);
    shows(&folder, "validate_within_the_limit", &[&VALIDATE[..], &["--max-rms-mm", "0.15"]].concat());
    let args = [&VALIDATE[..], &["--max-rms-mm", "0.05"]].concat();
    let above = host_cal_in(folder.path(), &args);
    snapshot("validate_above_the_limit", &args, &above.transcript());
    assert_eq!(above.code, 1);

    // A calibrated robot is a design like another: fitted anew, with more free, its table is replaced.
    runs(&folder, &[&FIT, &["--hold", "auto,x1,z1,y3", "--out", "calibrated.toml"]]);
    let again = ["fit", "--robot", "calibrated.toml", "--rig", "triangles", "other.csv", "poses.csv", "--out", "again.toml"];
    runs(&folder, &[&again]);
    let text = read(&folder, "again.toml");
    assert_eq!(text.matches("\n[calibration]\n").count(), 1);
    assert_eq!(text.matches("# CALIBRATED").count(), 1);
    assert!(
        text.contains("from_robot = \"calibrated.toml\"\nfrom_poses = [\"other.csv\", \"poses.csv\"]\nposes = 270\n"),
        "{text}"
    );
}

#[test]
fn poses_held_out_of_a_fit_prove_it() {
    let folder = TempDir::new().expect("a temporary folder");
    simulate(&folder, "both.csv", &["--bar", "460,610", "--per-pair", "10", "--sigma-mm", "0.084", "--seed", "7"]);
    let fit = [&["fit"], &DESIGN[..], &["both.csv", "--hold-out"]].concat();
    let by_bar = [&fit[..], &["bar=610", "--out", "calibrated.toml"]].concat();
    snapshot("fit_held_out", &by_bar, headline(&runs(&folder, &[&by_bar])));
    let validate = ["validate", "--robot", "calibrated.toml", "--rig", "triangles", "both.csv", "--hold-out", "bar=610"];
    let run = shows(&folder, "validate_held_out", &validate);
    // The set that `simulate` names after a bar has the same poses.
    let by_set = runs(&folder, &[&validate[..7], &["set=610"]]).stdout;
    assert_eq!(by_set.replace("set=610", "bar=610"), run.stdout);
    let by_pairing = [&fit[..], &["set=610,pairing=A:1"]].concat();
    snapshot("fit_held_out_by_two_rules", &by_pairing, headline(&runs(&folder, &[&by_pairing])));
}

#[test]
fn a_fit_that_predicts_poses_left_out_worse_than_the_design_is_not_written() {
    let folder = TempDir::new().expect("a temporary folder");
    // The design's own lengths with much noise: whatever a fit changes is wrong.
    let noise = ["--bar", "460", "--per-pair", "6", "--sigma-mm", "5", "--seed", "1", "--out", "poses.csv"];
    runs(&folder, &[&["simulate"], &DESIGN, &noise]);
    fs::write(folder.path().join("old.toml"), "older\n").expect("a file in the temporary folder");
    let args = [&FIT[..], &["--hold", "paper", "--out", "old.toml"]].concat();
    let run = host_cal_in(folder.path(), &args);
    snapshot("fit_not_written", &args, &format!("{}\n--- stderr ---\n{}", headline(&run), run.stderr));
    assert_eq!((run.code, read(&folder, "old.toml").as_str()), (1, "older\n"));
    assert!(!run.stdout.contains("wrote"));
    let without_out = host_cal_in(folder.path(), &args[..8]);
    let same = run.stdout.replace("old.toml was not written\n", "");
    let verdict = same.split_once("\nNOT TO BE TRUSTED AS IT IS\n").expect("a verdict").1;
    assert!(verdict.starts_with("  Poses left out of the fit are predicted no better than by the design"), "{verdict}");
    assert!(verdict.contains("--max-rms-mm raises the limit"), "{verdict}");
    assert_eq!((without_out.code, without_out.stdout), (1, same), "the verdict does not depend on --out");
}

#[test]
fn rank_shows_what_the_poses_can_tell() {
    let folder = TempDir::new().expect("a temporary folder");
    simulate(&folder, "poses.csv", &["--bar", "460", "--per-pair", "40", "--seed", "3"]);
    shows(&folder, "rank", &[&["rank"], &DESIGN[..], &["poses.csv"]].concat());
    shows(&folder, "rank_of_one_pairing", &[&["rank"], &DESIGN[..], &["poses.csv", "--pairings", "A:1"]].concat());
    simulate(&folder, "few.csv", &["--bar", "460", "--per-pair", "2", "--seed", "3"]);
    shows(&folder, "rank_of_few_poses", &[&["rank"], &DESIGN[..], &["few.csv"]].concat());
}

#[test]
fn paper_shows_its_numbers_beside_ours() {
    shows(&TempDir::new().expect("a temporary folder"), "paper", &["paper"]);
}

#[test]
fn demo_leaves_files_for_the_commands_that_it_prints() {
    let folder = TempDir::new().expect("a temporary folder");
    let run = shows(&folder, "demo", &["demo", "--out", "my-demo"]);
    for file in ["design.toml", "rig.toml", "poses-460.csv", "poses-610.csv", "calibrated.toml"] {
        assert!(!read(&folder, &format!("my-demo/{file}")).is_empty());
    }
    let commands: Vec<&str> = run.stdout.lines().filter_map(|line| line.strip_prefix("  host-cal ")).collect();
    assert_eq!(commands.len(), 4, "{commands:?}");
    for command in commands {
        let words: Vec<&str> = command.split_whitespace().collect();
        assert_eq!(runs(&folder, &[&words]).stderr, "", "{command}");
    }
    // Run again, it replaces its own files by the same ones, the time of the fit aside.
    let poses = read(&folder, "my-demo/poses-460.csv");
    assert_eq!(runs(&folder, &[&["demo", "--out", "my-demo"]]).stdout, run.stdout);
    assert_eq!(read(&folder, "my-demo/poses-460.csv"), poses);
}

#[test]
fn a_fit_of_a_robot_to_its_own_lengths_says_that_it_was_optimal_already() {
    let folder = TempDir::new().expect("a temporary folder");
    runs(&folder, &[&["simulate"], &DESIGN, &["--bar", "460", "--per-pair", "20", "--seed", "5", "--out", "poses.csv"]]);
    let run = runs(&folder, &[&FIT, &["--out", "same.toml"]]);
    assert!(headline(&run).contains("\nalready optimal after 0 steps"), "{}", headline(&run));
    assert!(run.stdout.contains("\nNOTHING TO CORRECT\n"), "{}", run.stdout);
    assert!(read(&folder, "same.toml").contains("\nverdict = \"reserved\"\n"));
    assert!(run.stdout.contains("no outliers"));
    assert!(!run.stdout.contains("-0.0000"), "zero has no sign");
}

#[test]
fn demo_prints_commands_that_a_shell_takes_though_the_folder_has_a_space() {
    let folder = TempDir::new().expect("a temporary folder");
    let run = runs(&folder, &[&["demo", "--out", "my demo"]]);
    assert!(run.stdout.contains("--robot 'my demo/design.toml'") || run.stdout.contains("--robot \"my demo/design.toml\""));
}
