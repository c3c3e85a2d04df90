//! No output takes the place of an input, a recording or a session's file, by whatever name it is called, nor of a file of another kind
//! unless it is told to.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use ballbar_tests::command::{Run, host_cal_command, host_cal_in};
use ballbar_tests::shells::{runs, simulate};
use host_cal::files::{RIGS, ROBOTS};
use host_cal::session::{LOG_NAME, LogWriter};
use tempfile::TempDir;

/// Everything that the commands read: robots, a rig, poses, a plan, targets, a URDF, and a session with all its files.
fn bench() -> TempDir {
    let folder = TempDir::new().expect("a temporary folder");
    let put = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("a file");
    let robot = |name: &str| ROBOTS.iter().find(|(other, _)| *other == name).expect("a built-in robot").1;
    put("design.toml", robot("puma560"));
    put("true.toml", robot("puma560-optimised"));
    put("rig.toml", RIGS[0].1);
    put("targets.csv", "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10,-80,70,5,20,0\n");
    simulate(&folder, "poses.csv", &["--bar", "460", "--per-pair", "12", "--sigma-mm", "0.05"]);
    simulate(&folder, "other.csv", &["--bar", "610", "--per-pair", "4", "--sigma-mm", "0.05", "--seed", "5"]);
    let plan = ["plan", "--robot", "design.toml", "--rig", "rig.toml", "--bar", "460", "--pairings", "A:1", "--per-pair", "3"];
    host_cal_in(folder.path(), &[&plan[..], &["--latitudes-deg", "45", "--out", "plan.csv"]].concat());
    runs(&folder, &[&["export", "--robot", "true.toml", "--format", "urdf", "--out", "arm.urdf"]]);
    fs::create_dir_all(folder.path().join("today/programs")).expect("a session");
    for (from, to) in
        [("poses.csv", "poses.csv"), ("design.toml", "robot.toml"), ("rig.toml", "rig.toml"), ("plan.csv", "plan.csv")]
    {
        fs::copy(folder.path().join(from), folder.path().join("today").join(to)).expect("a copy");
    }
    drop(LogWriter::open(&folder.path().join("today").join(LOG_NAME)).expect("a log"));
    put("today/session.toml", "runs = []\n");
    put("today/programs/BAR01.ls", "/PROG BAR01\n");
    folder
}

/// A command that writes a file, without its `--out`, and what it reads.
const COMMANDS: [(&[&str], &[&str]); 10] = [
    (
        &["fit", "--robot", "design.toml", "--rig", "rig.toml", "poses.csv", "other.csv", "--out"],
        &["design.toml", "rig.toml", "poses.csv", "other.csv"],
    ),
    (&["fit", "today", "--out"], &["today/poses.csv", "today/robot.toml", "today/rig.toml"]),
    (
        &["report", "--robot", "design.toml", "--rig", "rig.toml", "poses.csv", "--validate", "other.csv", "--out"],
        &["design.toml", "rig.toml", "poses.csv", "other.csv"],
    ),
    (
        &[
            "plan",
            "--robot",
            "design.toml",
            "--rig",
            "rig.toml",
            "--bar",
            "460",
            "--pairings",
            "A:1",
            "--per-pair",
            "3",
            "--latitudes-deg",
            "45",
            "--out",
        ],
        &["design.toml", "rig.toml"],
    ),
    (
        &[
            "simulate",
            "--robot",
            "true.toml",
            "--plan-robot",
            "design.toml",
            "--rig",
            "rig.toml",
            "--bar",
            "460",
            "--per-pair",
            "2",
            "--out",
        ],
        &["true.toml", "design.toml", "rig.toml"],
    ),
    (&["export", "--robot", "true.toml", "--format", "csv", "--out"], &["true.toml"]),
    (&["import", "arm.urdf", "--out"], &["arm.urdf"]),
    (
        &["compensate", "--robot", "true.toml", "--nominal", "design.toml", "targets.csv", "--out"],
        &["true.toml", "design.toml", "targets.csv"],
    ),
    (&["log", "export", "today", "--csv"], &["today/stream.bbl"]),
    (&["log", "export", "today/stream.bbl", "--mcap"], &["today/stream.bbl"]),
];

/// The session's files, and a name that it would have.
const SESSION: [&str; 8] = [
    "today/stream.bbl",
    "today/session.toml",
    "today/poses.csv",
    "today/robot.toml",
    "today/rig.toml",
    "today/plan.csv",
    "today/Poses.CSV",
    "today/programs/BAR01.ls",
];

fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()) {
        if entry.is_symlink() && entry.is_dir() {
            continue;
        }
        if entry.is_dir() {
            found.extend(files(&entry));
        } else {
            found.insert(entry.clone(), fs::read(&entry).expect("a file"));
        }
    }
    found
}

/// Runs a command that must be refused because of its output's name, and change nothing; also with `--force`.
fn refuses(folder: &TempDir, command: &[&str], out: &str, says: &str) {
    let before = files(folder.path());
    for force in [&[][..], &["--force"]] {
        let args = [command, &[out], force].concat();
        let run = host_cal_in(folder.path(), &args);
        let said = one_line(&run);
        assert!(run.code == 2 && run.stdout.is_empty() && said.contains(says), "{args:?}: {}", run.transcript());
        assert_eq!(files(folder.path()), before, "{args:?} changed a file");
    }
}

/// What was said, without the renderer's line breaks.
fn one_line(run: &Run) -> String {
    run.stderr.replace("\n  │ ", " ").replace("\n        ", " ")
}

#[test]
fn no_output_replaces_an_input_by_whatever_name() {
    let folder = bench();
    fs::create_dir(folder.path().join("sub")).expect("a folder");
    for (command, inputs) in COMMANDS {
        for (i, input) in inputs.iter().enumerate() {
            let absolute = folder.path().join(input).display().to_string();
            let names = [(*input).to_owned(), format!("./{input}"), format!("sub/../{input}"), absolute];
            for name in &names[..if i == 0 { 4 } else { 1 }] {
                let says = if input.starts_with("today") { "no output replaces" } else { "is read by this command" };
                refuses(&folder, command, name, says);
            }
        }
    }
}

#[cfg(unix)]
#[test]
fn nor_by_a_link_of_either_kind_nor_by_an_open_file() {
    use std::os::unix::fs::symlink;
    let folder = bench();
    let at = |name: &str| folder.path().join(name);
    symlink("poses.csv", at("symbolic")).expect("a link");
    symlink("symbolic", at("twice")).expect("a link");
    symlink(".", at("here")).expect("a link");
    fs::hard_link(at("poses.csv"), at("hard")).expect("a link");
    symlink("today/stream.bbl", at("log")).expect("a link");
    symlink("today", at("session")).expect("a link");
    let fit = COMMANDS[0].0;
    for name in ["symbolic", "twice", "here/poses.csv", "hard", "here/hard"] {
        refuses(&folder, fit, name, "is read by this command");
    }
    // What is read by the other name is the same file.
    let by_link = ["fit", "--robot", "design.toml", "--rig", "rig.toml", "hard", "--out"];
    refuses(&folder, &by_link, "poses.csv", "is read by this command");
    for name in ["log", "session/stream.bbl", "session/../today/poses.csv"] {
        refuses(&folder, fit, name, "no output replaces");
    }
    fs::hard_link(at("today/stream.bbl"), at("kept.bbl")).expect("a link");
    refuses(&folder, fit, "kept.bbl", "kept.bbl: is the recording of a session");

    let before = files(folder.path());
    for (input, out) in [("/dev/stdin", "poses.csv"), ("poses.csv", "/dev/stdin"), ("/dev/stdin", "/proc/self/fd/0")] {
        let args = ["fit", "--robot", "design.toml", "--rig", "rig.toml", input, "--out", out, "--force"];
        let mut command = host_cal_command(folder.path(), &args);
        command.stdin(fs::File::open(at("poses.csv")).expect("poses"));
        let output = command.output().expect("host-cal starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains("is read by this command"), "{args:?}: {said}");
        assert_eq!(files(folder.path()), before, "{args:?} changed a file");
    }
}

#[test]
fn no_output_replaces_a_sessions_file() {
    let folder = bench();
    for name in SESSION {
        refuses(&folder, COMMANDS[0].0, name, "is a file of a session, which no output replaces");
    }
    for (command, _) in COMMANDS {
        refuses(&folder, command, "today/stream.bbl", "is a file of a session, which no output replaces");
        refuses(&folder, command, "today/poses.csv", "is a file of a session, which no output replaces");
    }
    fs::copy(folder.path().join("today/stream.bbl"), folder.path().join("kept.bbl")).expect("a copy");
    refuses(&folder, COMMANDS[0].0, "kept.bbl", "kept.bbl: is the recording of a session, which no output replaces");
}

#[test]
fn folders_of_outputs_replace_no_input_either() {
    let folder = bench();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("figures")).expect("a folder");
    fs::copy(at("poses.csv"), at("figures/shell.csv")).expect("a copy");
    fs::copy(at("poses.csv"), at("figures/scene.svg")).expect("a copy");
    let report = ["report", "--robot", "design.toml", "--rig", "rig.toml", "--out", "new.html"];
    refuses(&folder, &[&report[..], &["figures/shell.csv", "--csv"]].concat(), "figures", "shell.csv: is read by this command");
    refuses(&folder, &[&report[..], &["figures/scene.svg", "--svg"]].concat(), "figures", "scene.svg: is read by this command");
}

#[test]
fn what_a_command_wrote_it_writes_again() {
    let folder = bench();
    let formats = ["urdf", "ros2", "dh", "mdh", "json", "yaml", "csv", "c", "rust", "octave"];
    let exports = formats.map(|format| ["export", "--robot", "true.toml", "--format", format, "--out"]);
    let commands = COMMANDS.iter().map(|(command, _)| *command).chain(exports.iter().map(|command| &command[..]));
    for (i, command) in commands.enumerate() {
        let name = format!("out{i}");
        for time in ["first", "second"] {
            let run = host_cal_in(folder.path(), &[command, &[&name]].concat());
            assert!(run.code < 2, "{command:?}, {time}: {}", run.transcript());
        }
        assert!(folder.path().join(&name).exists(), "{command:?} wrote nothing");
    }
    let folders: [&[&str]; 2] = [
        &["report", "--robot", "design.toml", "--rig", "rig.toml", "poses.csv", "--out", "r.html", "--svg", "f", "--csv", "f"],
        &["manual", "--out", "man"],
    ];
    for command in folders.iter().chain(folders.iter()) {
        assert!(host_cal_in(folder.path(), command).code < 2, "{command:?}");
    }
    fs::write(folder.path().join("empty"), "").expect("an empty file");
    runs(&folder, &[COMMANDS[5].0, &["empty"]]);
}

#[test]
fn a_file_of_another_kind_is_replaced_only_when_told_to() {
    let folder = bench();
    let put = |name: &str, contents: &[u8]| fs::write(folder.path().join(name), contents).expect("a file");
    let recorded = "chuck,sphere,q1_deg,length_mm,t_s\nA,1,2,460,3\n";
    put("recorded.csv", recorded.as_bytes());
    put("page.html", b"<!DOCTYPE html><html><title>Mine</title></html>");
    put("drawing.svg", b"<svg xmlns='http://www.w3.org/2000/svg'/>");
    put("image.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
    put("package.json", b"{\"name\": \"mine\"}");
    put("Cargo.toml", b"[package]\nname = \"mine\"\n");
    put("notes.txt", b"Bolt 3, left, was loose.\n");
    put("broken.toml", b"[[links]\n");
    put("table.csv", b"a,b\n1,2\n");
    put("foreign.urdf", b"<robot name='mine'/>");
    fs::copy(folder.path().join("poses.csv"), folder.path().join("kept.csv")).expect("a copy");
    fs::copy(folder.path().join("design.toml"), folder.path().join("kept.toml")).expect("a copy");
    // The command's place in the table, the file, and what it is.
    let cases = [
        (0, "kept.csv", "a file of poses, and a robot file is to be written"),
        (0, "recorded.csv", "a file of measured poses"),
        (0, "notes.txt", "another file"),
        (0, "broken.toml", "another file"),
        (0, "Cargo.toml", "TOML of another program"),
        (0, "image.png", "a file that is no text"),
        (2, "page.html", "a web page of another program, and a report is to be written"),
        (2, "kept.toml", "a robot file"),
        (3, "kept.csv", "a file of poses, and a plan is to be written"),
        (4, "recorded.csv", "a file of measured poses, and a file of poses is to be written"),
        (4, "plan.csv", "a plan"),
        (5, "table.csv", "a table of another program"),
        (6, "foreign.urdf", "XML of another program"),
        (7, "targets.csv", "is read by this command"),
        (7, "kept.csv", "a file of poses, and a file of commands is to be written"),
        (8, "table.csv", "a table of another program, and a log as CSV is to be written"),
        (9, "package.json", "JSON of another program, and an MCAP file is to be written"),
    ];
    for (command, name, says) in cases {
        let old = fs::read(folder.path().join(name)).expect("a file");
        let args = [COMMANDS[command].0, &[name]].concat();
        let run = host_cal_in(folder.path(), &args);
        assert!(run.code == 2 && run.stdout.is_empty() && one_line(&run).contains(says), "{args:?}: {}", run.transcript());
        assert_eq!(fs::read(folder.path().join(name)).expect("a file"), old, "{args:?}");
        if !says.contains("read by") {
            assert!(run.stderr.contains("--force"), "{}", run.stderr);
            let forced = host_cal_in(folder.path(), &[&args[..], &["--force"]].concat());
            assert!(forced.code < 2, "{args:?}: {}", forced.transcript());
            assert_ne!(fs::read(folder.path().join(name)).expect("a file"), old, "{args:?}");
            fs::write(folder.path().join(name), old).expect("as it was");
        }
    }
    fs::create_dir(folder.path().join("f")).expect("a folder");
    put("f/scene.svg", b"<svg xmlns='http://www.w3.org/2000/svg'/>");
    let report = ["report", "--robot", "design.toml", "--rig", "rig.toml", "poses.csv", "--out", "r.html", "--svg", "f"];
    let run = host_cal_in(folder.path(), &report);
    assert!(run.code == 2 && one_line(&run).contains("f/scene.svg: is a drawing of another program"), "{}", run.transcript());
    assert!(!folder.path().join("r.html").exists(), "all or nothing is written");
}
