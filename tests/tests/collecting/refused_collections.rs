//! What `collect` refuses, and what `--hold-out` and sessions are refused for by the commands that read poses: what is said, and that
//! the disk stays as it was.
#![cfg(unix)]

use std::fs;

use ballbar_calib::model::Robot;
use ballbar_tests::simulated_cell::{SHORT_PLAN, design, plant};
use ballbar_tests::workbench::{Workbench, snapshot};
use host_cal::board::parameter_set;
use host_cal::files::{RIGS, ROBOTS};
use host_cal::virtual_board::{Pace, VirtualBoard, VirtualBoardOptions};

/// Nobody listens at the port of this number.
const NOWHERE: &str = "127.0.0.1:1";
const PUMA: [&str; 4] = ["--robot", "puma560", "--rig", "triangles"];

/// Poses of two bars, of all nine pairings, with a set for each bar.
fn bench_with_poses() -> Workbench {
    let bench = Workbench::new();
    let simulate = ["simulate", "--robot", "puma560-optimised", "--plan-robot", "puma560", "--rig", "triangles"];
    let run = bench.run(&[&simulate[..], &["--bar", "460,610", "--per-pair", "5", "--out", "all.csv"]].concat());
    assert_eq!(run.code, 0, "{}", run.transcript());
    bench
}

/// A folder with a plan, and a session that was begun with it.
fn bench_with_a_session() -> Workbench {
    let bench = Workbench::new();
    bench.put("plan.csv", &*SHORT_PLAN);
    fs::create_dir(bench.path("session")).expect("it is not there");
    bench.put("session/plan.csv", &*SHORT_PLAN);
    for (name, builtin) in [("robot.toml", "puma560"), ("rig.toml", "triangles")] {
        bench.put(&format!("session/{name}"), builtin_text(builtin));
    }
    bench
}

fn builtin_text(name: &str) -> &'static str {
    let builtin = ROBOTS.iter().chain(&RIGS).find(|(other, _)| *other == name);
    builtin.unwrap_or_else(|| panic!("no {name} is built in")).1
}

/// A board at `port` in the bench's folder, which stays as long as what is returned.
fn board(bench: &Workbench, robot: Option<&Robot>, is_homed: bool) -> VirtualBoard {
    let plant = plant(1);
    let parameters = robot.map(|robot| parameter_set(robot, plant.lvdt()).expect("the robot fits a board"));
    let port_name = Some(bench.path("port"));
    let options = VirtualBoardOptions { parameters, is_homed, port_name, ..VirtualBoardOptions::new(plant, Pace::Real) };
    VirtualBoard::start(options).expect("the board starts")
}

#[test]
fn poses_that_cannot_be_held_out_are_refused() {
    let bench = bench_with_poses();
    for (name, rule) in [
        ("hold_out_a_bar_that_is_not_there", "bar=500"),
        ("hold_out_a_set_that_is_not_there", "set=yesterday"),
        ("hold_out_everything", "bar=460,bar=610"),
        ("hold_out_an_unknown_sphere", "pairing=A:9"),
        ("hold_out_a_bar_below_zero", "bar=-460"),
        ("hold_out_a_chuck_only", "pairing=A"),
        ("hold_out_no_value", "bar"),
        ("hold_out_an_unknown_key", "tool=2"),
        ("hold_out_nothing_said", ""),
        ("hold_out_with_an_end_comma", "bar=610,"),
    ] {
        bench.refuses(name, &[&["fit", "all.csv", "--hold-out", rule, "--out", "old.toml"], &PUMA[..]].concat());
    }
    for command in ["validate", "rank"] {
        let said = bench.fails(2, &[&[command, "all.csv", "--hold-out", "bar=500"], &PUMA[..]].concat());
        assert!(said.contains("no pose is of it"), "{command}: {said}");
    }
}

#[test]
fn sessions_that_do_not_tell_what_is_needed_are_refused() {
    let bench = bench_with_poses();
    bench.refuses("fit_without_robot_and_session", &["fit", "all.csv", "--rig", "triangles"]);
    bench.refuses("fit_without_rig_and_session", &["fit", "all.csv", "--robot", "puma560"]);
    let poses = fs::read(bench.path("all.csv")).expect("it was simulated");
    for (session, robot) in [("one", "puma560"), ("two", "puma560-optimised"), ("empty", "puma560")] {
        fs::create_dir(bench.path(session)).expect("it is not there");
        bench.put(&format!("{session}/robot.toml"), builtin_text(robot));
        bench.put(&format!("{session}/rig.toml"), builtin_text("triangles"));
    }
    bench.put("one/poses.csv", &poses);
    bench.put("two/poses.csv", &poses);
    bench.refuses("fit_of_sessions_of_two_robots", &["fit", "one", "two", "--out", "old.toml"]);
    bench.refuses("fit_of_a_session_without_poses", &["fit", "empty", "--out", "old.toml"]);
    let run = bench.run(&["fit", "one", "two", "--robot", "puma560", "--json"]);
    assert_eq!((run.code, &run.json()["poses"]), (0, &180.into()), "told which one, it takes both: {}", run.transcript());
}

#[test]
fn a_collection_that_is_not_the_sessions_is_refused() {
    let bench = bench_with_a_session();
    let mut lines: Vec<&str> = SHORT_PLAN.lines().collect();
    lines.pop();
    bench.put("other.csv", lines.join("\n"));
    bench.put("moved.toml", builtin_text("triangles").replacen("0.0", "0.1", 1));
    let collect = ["collect", "port", "--robot-link", "sim", "--robot-address", NOWHERE];
    for (name, more) in [
        ("collect_another_plan", &["--session", "session", "--plan", "other.csv"][..]),
        ("collect_with_another_robot", &["--session", "session", "--robot", "puma560-optimised"]),
        ("collect_with_another_rig", &["--session", "session", "--rig", "moved.toml"]),
        ("collect_without_a_plan", &["--session", "new", "--robot", "puma560", "--rig", "triangles"]),
        ("collect_without_a_robot", &["--session", "new", "--plan", "plan.csv", "--rig", "triangles"]),
        (
            "collect_a_plan_of_another_robot",
            &["--session", "new", "--plan", "plan.csv", "--robot", "puma560-optimised", "--rig", "triangles"],
        ),
        (
            "collect_from_a_missing_plan",
            &["--session", "new", "--plan", "missing.csv", "--robot", "puma560", "--rig", "triangles"],
        ),
        ("collect_at_no_speed", &["--session", "session", "--speed-deg-s", "0"]),
        ("collect_slowly_at_no_speed", &["--session", "session", "--continuous", "--slow-deg-s=-5"]),
        ("collect_from_no_controller", &["--session", "session"]),
    ] {
        bench.refuses(name, &[&collect[..], more].concat());
    }
    let no_address = ["collect", "port", "--session", "session", "--robot-link", "sim"];
    bench.refuses("collect_without_an_address", &no_address);
    // The help lists the ports of this machine.
    let said = bench.fails(2, &["collect", "port", "--session", "session", "--robot-link", "manual"]);
    assert!(said.contains("port: there is no such port"), "{said}");
    bench.refuses("collect_without_a_link", &["collect", "port", "--session", "session"]);
}

#[test]
fn programs_that_cannot_be_what_was_asked_for_are_refused_before_anything_else() {
    let bench = bench_with_a_session();
    let collect = ["collect", "port", "--session", "session", "--robot-link", "file"];
    for (name, more) in [
        ("collect_by_no_language", &[][..]),
        ("collect_by_fanuc_without_its_j3", &["--dialect", "fanuc"]),
        ("collect_by_fanuc_with_another_j3", &["--dialect", "fanuc", "--fanuc-j23", "-2"]),
        ("collect_by_krl_with_a_tool_by_name", &["--dialect", "krl", "--robot-tool", "plate"]),
        ("collect_by_val_with_a_tool", &["--dialect", "val", "--robot-tool", "1"]),
        ("collect_by_percent_too_slowly", &["--dialect", "krl", "--speed-deg-s", "5"]),
        ("collect_by_no_full_speed", &["--dialect", "krl", "--robot-fastest-deg-s", "0"]),
    ] {
        bench.refuses(name, &[&collect[..], more].concat());
    }
}

#[test]
fn a_board_that_cannot_be_collected_from_is_refused() {
    let mut geared = design();
    geared.encoders[2].encoder.as_mut().expect("a known encoder").counts_per_unit *= 2.0;
    let cases = [
        ("collect_from_a_board_without_parameters", None, true),
        ("collect_from_a_board_with_another_robot", Some(geared), true),
        ("collect_from_a_board_that_is_not_homed", Some(design()), false),
    ];
    for (name, robot, is_homed) in cases {
        let bench = bench_with_a_session();
        let _board = board(&bench, robot.as_ref(), is_homed);
        let args = ["collect", "port", "--session", "session", "--robot-link", "manual", "--yes"];
        let run = bench.run(&args);
        assert_eq!(run.code, 2, "{}", run.transcript());
        snapshot(name, &args, &run.stderr);
        assert!(!bench.path("session/poses.csv").exists(), "{name}");
    }
}
