//! Every argument that `host-cal` refuses, and output that it cannot write: what it says, and that it leaves the disk as it was.

use std::fs;

use ballbar_tests::workbench::{RIG, Workbench, snapshot};

/// Poses of a PUMA 560 on one pairing's shell, and more rows of poses than parameters from all pairings.
fn puma_bench() -> Workbench {
    let bench = Workbench::new();
    let simulate = ["simulate", "--robot", "puma560-optimised", "--plan-robot", "puma560", "--rig", "triangles", "--bar", "460"];
    for (file, more) in [("one.csv", ["--pairings", "A:1", "--per-pair", "12"]), ("all.csv", ["--seed", "3", "--per-pair", "5"])]
    {
        let run = bench.run(&[&simulate[..], &more, &["--out", file]].concat());
        assert_eq!(run.code, 0, "{}", run.transcript());
    }
    bench
}

#[test]
fn a_bar_that_the_rig_says_is_exact_is_no_unknown() {
    let bench = Workbench::new();
    bench.put("rig.toml", format!("{RIG}zero_tolerance_mm = 0\ngain_tolerance = 0\n"));
    for (kind, name) in [("rod-zeros", "unknown_zeros_that_are_exact"), ("bar-gain", "unknown_gain_that_is_exact")] {
        bench.refuses(name, &["fit", "--robot", "robot.toml", "--rig", "rig.toml", "poses.csv", "--unknown", kind]);
    }
}

#[test]
fn arguments_that_make_no_sense_are_refused() {
    const PUMA: [&str; 4] = ["--robot", "puma560", "--rig", "triangles"];
    let bench = puma_bench();
    let cases: [(&str, &str, &[&str]); 36] = [
        ("fit_without_redundancy", "fit", &["one.csv", "--prior", "none", "--hold", "none", "--out", "old.toml"]),
        ("fit_of_as_many_poses_as_parameters", "fit", &["one.csv", "--prior", "none", "--out", "old.toml"]),
        ("exclude_a_row_that_is_not_there", "fit", &["all.csv", "--exclude", "12,1000", "--out", "old.toml"]),
        ("exclude_no_range", "fit", &["all.csv", "--exclude", "3-1"]),
        ("exclude_every_row", "report", &["one.csv", "--exclude", "1-12", "--out", "page.html"]),
        ("unknown_of_no_kind", "fit", &["all.csv", "--unknown", "bar_zero"]),
        ("unknown_rig_without_a_tolerance", "fit", &["all.csv", "--unknown", "bar-zero,rig"]),
        ("unknown_latency_of_poses_that_stood", "report", &["all.csv", "--unknown", "latency", "--out", "page.html"]),
        ("rig_to_write_that_is_known", "fit", &["all.csv", "--out-rig", "found.toml"]),
        ("hold_misspelt", "fit", &["all.csv", "--hold", "sclae3"]),
        ("hold_two_rules", "fit", &["all.csv", "--hold", "auto,none"]),
        ("hold_a_link_that_is_not_there", "fit", &["all.csv", "--hold", "x9"]),
        ("hold_a_joint_that_is_not_there", "fit", &["all.csv", "--hold", "auto,scale7"]),
        ("hold_nothing_said", "fit", &["all.csv", "--hold", ""]),
        ("damping_unknown", "fit", &["all.csv", "--damping", "marquardt"]),
        ("no_poses_named", "fit", &[]),
        ("rank_pairing_of_an_unknown_sphere", "rank", &["all.csv", "--pairings", "A:9"]),
        ("rank_pairing_of_a_chuck_only", "rank", &["all.csv", "--pairings", "A"]),
        ("rank_pairing_twice", "rank", &["all.csv", "--pairings", "A:1,A:1"]),
        ("rank_pairing_with_an_end_comma", "rank", &["all.csv", "--pairings", "A:1,"]),
        ("rank_pairing_without_poses", "rank", &["one.csv", "--pairings", "B:2,C:3"]),
        ("validate_limit_of_zero", "validate", &["all.csv", "--max-rms-mm", "0"]),
        ("validate_limit_of_words", "validate", &["all.csv", "--max-rms-mm", "small"]),
        ("validate_limit_of_nan", "validate", &["all.csv", "--max-rms-mm", "nan"]),
        ("simulate_bar_below_zero", "simulate", &["--bar=-5", "--out", "old.toml"]),
        ("simulate_bar_of_zero", "simulate", &["--bar", "460,0", "--out", "old.toml"]),
        ("simulate_bar_out_of_reach", "simulate", &["--bar", "5000", "--per-pair", "2", "--out", "old.toml"]),
        ("simulate_no_poses", "simulate", &["--per-pair", "0", "--out", "old.toml"]),
        ("simulate_noise_below_zero", "simulate", &["--sigma-mm=-1", "--out", "old.toml"]),
        ("simulate_noise_of_nan", "simulate", &["--sigma-mm", "nan", "--out", "old.toml"]),
        ("simulate_planned_with_other_joints", "simulate", &["--plan-robot", "scara", "--out", "old.toml"]),
        ("simulate_pairing_of_an_unknown_chuck", "simulate", &["--pairings", "Z:1", "--out", "old.toml"]),
        ("robot_neither_file_nor_built_in", "validate", &["all.csv", "--robot", "puma650"]),
        ("unknown_flag", "rank", &["all.csv", "--jsno"]),
        ("two_robots_of_poses", "validate", &["all.csv", "poses.csv"]),
        ("the_same_flag_twice", "validate", &["all.csv", "--max-rms-mm", "1", "--max-rms-mm", "2"]),
    ];
    for (name, command, more) in cases {
        let robot = if more.contains(&"--robot") { &PUMA[2..] } else { &PUMA[..] };
        bench.refuses(name, &[&[command], robot, more].concat());
    }
    let joints: [(&str, &str); 6] = [
        ("fk_of_too_few_joints", "1,2,3"),
        ("fk_of_too_many_joints", "1,2,3,4,5,6,7"),
        ("fk_of_words", "1,2,three,4,5,6"),
        ("fk_of_nan", "1,2,nan,4,5,6"),
        ("fk_of_infinity", "1,2,-inf,4,5,6"),
        ("fk_of_nothing", ""),
    ];
    for (name, q) in joints {
        bench.refuses(name, &["fk", "--robot", "puma560", "--q", q]);
    }
    bench.put("barless.toml", RIG.split_once("[bar]").expect("a bar").0);
    bench.refuses("simulate_without_a_bar", &["simulate", "--robot", "puma560", "--rig", "barless.toml"]);
    bench.refuses("no_command", &[]);
    bench.refuses("unknown_command", &["calibrate"]);
}

#[test]
fn output_that_cannot_be_written_is_exit_code_3_and_changes_nothing() {
    let bench = puma_bench();
    fs::create_dir(bench.path("folder")).expect("it is not there");
    let simulate = ["simulate", "--robot", "puma560", "--rig", "triangles", "--bar", "460", "--per-pair", "1", "--out"];
    let fit = ["fit", "--robot", "puma560", "--rig", "triangles", "all.csv", "--out"];
    let unwritable = |name: &str, args: &[&str]| snapshot(name, args, &bench.fails(3, args));
    unwritable("write_poses_to_a_missing_folder", &[&simulate[..], &["missing/poses.csv"]].concat());
    unwritable("write_poses_onto_a_folder", &[&simulate[..], &["folder"]].concat());
    unwritable("write_a_robot_to_a_missing_folder", &[&fit[..], &["missing/calibrated.toml"]].concat());
    unwritable("write_a_robot_below_a_file", &[&fit[..], &["old.toml/calibrated.toml"]].concat());
    unwritable("write_a_demo_onto_a_file", &["demo", "--out", "old.toml"]);
}

#[test]
fn a_number_below_zero_is_refused_as_a_number() {
    const PUMA: [&str; 4] = ["--robot", "puma560", "--rig", "triangles"];
    let bench = Workbench::new();
    for (command, flag, number) in [
        ("simulate", "--bar", "-5"),
        ("simulate", "--sigma-mm", "-1"),
        ("simulate", "--per-pair", "-3"),
        ("validate", "--max-rms-mm", "-0.1"),
    ] {
        let poses: &[&str] = if command == "validate" { &["poses.csv"] } else { &[] };
        let said = bench.fails(2, &[&[command, flag, number], &PUMA[..], poses].concat());
        assert!(said.contains(flag) && said.contains(number) && !said.contains("unexpected argument"), "{said}");
    }
}

#[test]
fn more_poses_than_a_computer_can_count_are_refused() {
    let bench = Workbench::new();
    for count in ["50000000000000000", "18446744073709551615"] {
        let said = bench.fails(2, &["simulate", "--robot", "puma560", "--rig", "triangles", "--bar", "460", "--per-pair", count]);
        assert!(said.contains("--per-pair"), "{said}");
    }
}

#[test]
fn a_file_that_cannot_be_written_is_named_without_the_temporary_one() {
    let bench = Workbench::new();
    let args =
        ["simulate", "--robot", "puma560", "--rig", "triangles", "--bar", "460", "--per-pair", "1", "--out", "missing/p.csv"];
    let said = bench.fails(3, &args);
    assert!(said.contains("missing/p.csv") && !said.contains(".host-cal-"), "{said}");
}

#[test]
fn what_is_no_file_is_not_replaced_by_one() {
    let bench = Workbench::new();
    let socket = std::os::unix::net::UnixListener::bind(bench.path("socket")).expect("a socket in the temporary folder");
    let args = ["simulate", "--robot", "puma560", "--rig", "triangles", "--bar", "460", "--per-pair", "1", "--out", "socket"];
    let run = bench.run(&args);
    let kind = fs::symlink_metadata(bench.path("socket")).expect("it stands there").file_type();
    assert!(run.code == 3 && !kind.is_file(), "{}", run.transcript());
    drop(socket);
}
