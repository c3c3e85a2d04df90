//! Every input that `host-cal` refuses or warns of: what it says, and that it leaves the disk as it was.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;

use ballbar_tests::command::{Run, host_cal_in};
use tempfile::TempDir;

/// A small robot with a joint of either kind.
const ROBOT: &str = r#"name = "arm"

[[links]]
translation_mm = [0.0, 0.0, 400.0]
rotation_deg = [0.0, 0.0, 0.0]

[[links]]
translation_mm = [150.0, 0.0, 0.0]
rotation_deg = [0.0, 90.0, 0.0]

[[links]]
translation_mm = [0.0, 20.0, 30.0]
rotation_deg = [0.0, 0.0, 0.0]

[[joints]]
type = "revolute"
offset_deg = -90.0
scale = 1.0
min_deg = -170.0
max_deg = 170.0
counts_per_rev = 8192
sign = 1
coupling = { joint = 2, ratio = 0.5 }

[[joints]]
type = "prismatic"
offset_mm = 10.0
scale = 1.0
min_mm = 0.0
max_mm = 500.0
"#;

const RIG: &str = r#"[[chucks]]
name = "A"
position_mm = [565.0, 0.0, 0.0]

[[chucks]]
name = "B"
position_mm = [392.0, 100.0, 0.0]

[[spheres]]
name = "1"
position_mm = [57.0, 0.0, 50.0]

[[spheres]]
name = "2"
position_mm = [-28.0, 50.0, 50.0]

[bar]
lengths_mm = [460.0, 610.0]
travel_mm = 75.0
"#;

const POSES: &str = "chuck,sphere,q1_deg,q2_mm,length_mm
A,1,10.0,100.0,455.5
# the bar was turned over here
A,2,-20.0,150.0,460.25
B,1,30.0,200.0,610.125
";

const OLD: &str = "an older file that must survive\n";
const FIT: [&str; 8] = ["fit", "--robot", "robot.toml", "--rig", "rig.toml", "poses.csv", "--out", "old.toml"];
const VALIDATE: [&str; 6] = ["validate", "--robot", "robot.toml", "--rig", "rig.toml", "poses.csv"];

/// A folder with a good robot, rig and poses, and a file that nothing may touch.
struct Bench(TempDir);

impl Bench {
    fn new() -> Self {
        let bench = Self(TempDir::new().expect("a temporary folder"));
        for (name, text) in [("robot.toml", ROBOT), ("rig.toml", RIG), ("poses.csv", POSES), ("old.toml", OLD)] {
            bench.put(name, text);
        }
        bench
    }

    fn put(&self, name: &str, contents: impl AsRef<[u8]>) {
        fs::write(self.0.path().join(name), contents).expect("a file in the temporary folder");
    }

    fn files(&self) -> BTreeMap<OsString, Option<Vec<u8>>> {
        let entries = fs::read_dir(self.0.path()).expect("the folder").map(|entry| entry.expect("an entry"));
        entries.map(|entry| (entry.file_name(), fs::read(entry.path()).ok())).collect()
    }

    /// Runs a command that must end with this exit code, print no result and leave the folder as it was.
    fn fails(&self, code: i32, name: &str, args: &[&str]) {
        let before = self.files();
        let run = host_cal_in(self.0.path(), args);
        assert_eq!(run.code, code, "{name}: {}", run.transcript());
        assert_eq!(run.stdout, "", "{name}");
        assert!(!run.stderr.contains("panicked"), "{name}: {}", run.stderr);
        assert_eq!(self.files(), before, "{name} changed a file");
        snapshot(name, args, &run);
    }

    fn refuses(&self, name: &str, args: &[&str]) {
        self.fails(2, name, args);
    }
}

fn snapshot(name: &str, args: &[&str], run: &Run) {
    insta::with_settings!({ description => format!("host-cal {}", args.join(" ")), omit_expression => true }, {
        insta::assert_snapshot!(name, run.stderr);
    });
}

/// Changes one place of a good file and expects `fit` to refuse it. A change from nothing is a file of its own.
fn refuses_files(file: &str, good: &str, changes: &[(&str, &str, &str)]) {
    for (name, from, to) in changes {
        assert!(good.contains(from), "{name}: the good file has no {from}");
        let bench = Bench::new();
        bench.put(file, if from.is_empty() { (*to).to_owned() } else { good.replacen(from, to, 1) });
        bench.refuses(name, &FIT);
    }
}

#[test]
fn the_files_that_the_refused_ones_are_made_of_are_accepted_without_a_warning() {
    let run = host_cal_in(Bench::new().0.path(), &VALIDATE);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
}

#[test]
fn a_bad_robot_is_refused_with_its_line() {
    let link = "[[links]]\ntranslation_mm = [0.0, 20.0, 30.0]\nrotation_deg = [0.0, 0.0, 0.0]\n\n";
    let slide = ROBOT.split_once("[[joints]]\ntype = \"prismatic\"").expect("a slide").1;
    let nine = format!("{ROBOT}{}", format!("\n[[joints]]\ntype = \"prismatic\"{slide}").repeat(7));
    let none = format!("joints = []\n{}", ROBOT.split_once("[[joints]]").expect("joints").0);
    let no_key = ROBOT.split_once("[[joints]]").expect("joints").0;
    refuses_files(
        "robot.toml",
        ROBOT,
        &[
            ("robot_with_nine_joints", "", &nine),
            ("robot_with_no_joints", "", &none),
            ("robot_without_the_joints_key", "", no_key),
            ("robot_that_is_empty", "", "\n"),
            ("robot_with_a_link_too_few", link, ""),
            ("robot_with_a_link_too_many", link, &format!("{link}{link}")),
            ("robot_with_an_unknown_key", "name =", "maker = \"Unimation\"\nname ="),
            ("robot_link_with_an_unknown_key", "rotation_deg = [0.0, 90", "mass_kg = 3.0\nrotation_deg = [0.0, 90"),
            ("robot_link_in_metres", "translation_mm = [150.0, 0.0, 0.0]", "translation_m = [0.15, 0.0, 0.0]"),
            ("robot_link_of_two_numbers", "[150.0, 0.0, 0.0]", "[150.0, 0.0]"),
            ("robot_link_of_four_numbers", "[150.0, 0.0, 0.0]", "[150.0, 0.0, 0.0, 0.0]"),
            ("robot_link_of_words", "[150.0, 0.0, 0.0]", "[\"150\", 0.0, 0.0]"),
            ("robot_link_with_nan", "[150.0, 0.0, 0.0]", "[150.0, nan, 0.0]"),
            ("robot_joint_with_an_unknown_key", "counts_per_rev", "counts_per_turn"),
            ("robot_joint_without_type", "type = \"revolute\"\n", ""),
            ("robot_joint_of_unknown_type", "\"revolute\"", "\"spherical\""),
            ("robot_offset_mm_on_a_revolute_joint", "offset_deg", "offset_mm"),
            ("robot_offset_deg_on_a_prismatic_joint", "offset_mm", "offset_deg"),
            ("robot_joint_with_both_offsets", "offset_deg = -90.0", "offset_deg = -90.0\noffset_mm = 3.0"),
            ("robot_joint_without_offset", "offset_deg = -90.0\n", ""),
            ("robot_joint_without_scale", "scale = 1.0\n", ""),
            ("robot_joint_without_lower_limit", "min_deg = -170.0\n", ""),
            ("robot_slide_without_upper_limit", "max_mm = 500.0\n", ""),
            ("robot_limits_in_the_wrong_unit", "min_deg", "min_mm"),
            ("robot_limits_upside_down", "min_deg = -170.0", "min_deg = 175.5"),
            ("robot_limits_without_range", "max_mm = 500.0", "max_mm = 0.0"),
            ("robot_scale_of_zero", "scale = 1.0", "scale = 0.0"),
            ("robot_scale_of_infinity", "scale = 1.0", "scale = inf"),
            ("robot_offset_of_nan", "offset_mm = 10.0", "offset_mm = nan"),
            ("robot_counts_below_zero", "8192", "-8192"),
            ("robot_counts_per_mm_on_a_revolute_joint", "counts_per_rev", "counts_per_mm"),
            ("robot_sign_of_two", "sign = 1", "sign = 2"),
            ("robot_joint_coupled_to_itself", "joint = 2", "joint = 1"),
            ("robot_joint_coupled_to_none_there", "joint = 2", "joint = 7"),
            ("robot_of_broken_toml", "scale = 1.0", "scale = = 1.0"),
            ("robot_with_a_key_twice", "scale = 1.0", "scale = 1.0\nscale = 1.0"),
        ],
    );
}

#[test]
fn a_bad_rig_is_refused_with_its_line() {
    let spheres = RIG.split_once("[[spheres]]").expect("spheres").1.split_once("[bar]").expect("a bar").0;
    refuses_files(
        "rig.toml",
        RIG,
        &[
            ("rig_with_a_chuck_twice", "\"B\"", "\"A\""),
            ("rig_without_spheres", &format!("[[spheres]]{spheres}"), ""),
            ("rig_with_an_empty_list_of_spheres", "", "chucks = [{ name = \"A\", position_mm = [0, 0, 0] }]\nspheres = []\n"),
            ("rig_name_with_a_comma", "\"B\"", "\"B,C\""),
            ("rig_name_with_a_colon", "\"B\"", "\"B:C\""),
            ("rig_name_that_is_empty", "\"B\"", "\"\""),
            ("rig_name_with_a_carriage_return", "\"B\"", "\"B\\rC\""),
            ("rig_name_that_is_a_number", "\"1\"", "1"),
            ("rig_point_of_infinity", "[565.0", "[inf"),
            ("rig_chuck_with_an_unknown_key", "name = \"B\"", "label = \"b\"\nname = \"B\""),
            ("rig_with_an_unknown_key", "[bar]", "[table]\nheight_mm = 0\n[bar]"),
            ("rig_bar_below_zero", "610.0", "-610.0"),
            ("rig_bar_without_length", "[460.0, 610.0]", "[]"),
            ("rig_bar_without_travel", "travel_mm = 75.0\n", ""),
            ("rig_bar_with_no_travel", "75.0", "0"),
        ],
    );
}

#[test]
fn bad_poses_are_refused_with_their_line_and_column() {
    refuses_files(
        "poses.csv",
        POSES,
        &[
            ("poses_that_are_empty", "", ""),
            ("poses_of_a_header_only", "", "chuck,sphere,q1_deg,q2_mm,length_mm\n"),
            ("poses_without_a_header", "chuck,sphere,q1_deg,q2_mm,length_mm\n", ""),
            ("poses_without_chuck", "chuck,", "place,"),
            ("poses_without_length", ",length_mm", ""),
            ("poses_with_a_column_twice", "length_mm", "length_mm,length_mm"),
            ("poses_with_an_unknown_column", "length_mm", "length_mm,temperature_c"),
            ("poses_with_millimetres_on_a_revolute_joint", "q1_deg", "q1_mm"),
            ("poses_with_degrees_on_a_prismatic_joint", "q2_mm", "q2_deg"),
            ("poses_with_a_joint_too_few", ",q2_mm", ""),
            ("poses_with_a_joint_too_many", "q2_mm", "q2_mm,q3_deg"),
            ("poses_with_a_joint_misnumbered", "q2_mm", "q3_mm"),
            ("poses_between_semicolons", "", &POSES.replace(',', ";")),
            ("poses_row_with_a_field_too_few", ",460.25", ""),
            ("poses_row_with_a_field_too_many", "460.25", "460.25,0"),
            ("poses_with_a_decimal_comma", "460.25", "460,25"),
            ("poses_with_a_comment_behind_a_row", "460.25", "460.25 # again"),
            ("poses_length_of_nan", "460.25", "nan"),
            ("poses_length_of_infinity", "460.25", "inf"),
            ("poses_length_beyond_all_numbers", "460.25", "1e999"),
            ("poses_length_of_zero", "460.25", "0"),
            ("poses_length_below_zero", "460.25", "-460.25"),
            ("poses_length_that_is_empty", "460.25", ""),
            ("poses_last_length_that_is_empty", "610.125\n", ""),
            ("poses_length_of_words", "460.25", "about 460"),
            ("poses_length_with_a_unit", "460.25", "460.25mm"),
            ("poses_joint_of_nan", "-20.0", "NaN"),
            ("poses_joint_that_is_empty", "-20.0", " "),
            ("poses_joint_of_words", "-20.0", "minus twenty"),
            ("poses_with_an_unknown_chuck", "A,2", "D,2"),
            ("poses_with_an_unknown_sphere", "A,2", "A,two"),
            ("poses_with_a_lower_case_chuck", "A,2", "a,2"),
            ("poses_with_umlauts", "A,2,-20.0", "Ä,2,-20.0"),
            ("poses_sigma_of_zero", "", "chuck,sphere,q1_deg,q2_mm,length_mm,sigma_mm\nA,1,10.0,100.0,455.5,0\n"),
            ("poses_sigma_below_zero", "", "chuck,sphere,q1_deg,q2_mm,length_mm,sigma_mm\nA,1,10.0,100.0,455.5,-0.1\n"),
            ("poses_sigma_that_is_empty", "", "chuck,sphere,q1_deg,q2_mm,length_mm,sigma_mm\nA,1,10.0,100.0,455.5,\n"),
            ("poses_time_of_words", "", "t_s,chuck,sphere,q1_deg,q2_mm,length_mm\nnoon,A,1,10.0,100.0,455.5\n"),
        ],
    );
}

#[test]
fn a_file_that_cannot_be_read_as_text_is_refused() {
    for (file, what) in [("robot.toml", "robot"), ("rig.toml", "rig"), ("poses.csv", "poses")] {
        let path = |bench: &Bench| bench.0.path().join(file);
        let bench = Bench::new();
        bench.put(file, b"caf\xe9 = \"\xff\"\n");
        bench.refuses(&format!("{what}_that_is_not_utf8"), &FIT);
        fs::remove_file(path(&bench)).expect("it was there");
        bench.refuses(&format!("{what}_that_is_missing"), &FIT);
        fs::create_dir(path(&bench)).expect("it is gone");
        bench.refuses(&format!("{what}_that_is_a_folder"), &FIT);
    }
}

#[test]
fn weights_for_some_poses_only_are_refused() {
    let bench = Bench::new();
    bench.put("weighed.csv", "chuck,sphere,q1_deg,q2_mm,length_mm,sigma_mm\nA,1,10.0,100.0,455.5,0.1\n");
    bench.refuses("sigma_in_the_second_file_only", &[&VALIDATE[..], &["weighed.csv"]].concat());
}

/// Poses of a PUMA 560 on one pairing's shell, and more rows of poses than parameters from all pairings.
fn puma_bench() -> Bench {
    let bench = Bench::new();
    let simulate = ["simulate", "--robot", "puma560-optimised", "--plan-robot", "puma560", "--rig", "triangles", "--bar", "460"];
    for (file, more) in [("one.csv", ["--pairings", "A:1", "--per-pair", "12"]), ("all.csv", ["--seed", "3", "--per-pair", "5"])]
    {
        let run = host_cal_in(bench.0.path(), &[&simulate[..], &more, &["--out", file]].concat());
        assert_eq!(run.code, 0, "{}", run.transcript());
    }
    bench
}

#[test]
fn arguments_that_make_no_sense_are_refused() {
    const PUMA: [&str; 4] = ["--robot", "puma560", "--rig", "triangles"];
    let bench = puma_bench();
    let cases: [(&str, &str, &[&str]); 33] = [
        ("fit_without_redundancy", "fit", &["one.csv", "--hold", "none", "--out", "old.toml"]),
        ("fit_of_as_many_poses_as_parameters", "fit", &["one.csv", "--out", "old.toml"]),
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
        ("validate_limit_below_zero", "validate", &["all.csv", "--max-rms-mm", "-0.1"]),
        ("validate_limit_of_words", "validate", &["all.csv", "--max-rms-mm", "small"]),
        ("validate_limit_of_nan", "validate", &["all.csv", "--max-rms-mm", "nan"]),
        ("simulate_bar_below_zero", "simulate", &["--bar", "-5", "--out", "old.toml"]),
        ("simulate_bar_below_zero_after_an_equals_sign", "simulate", &["--bar=-5", "--out", "old.toml"]),
        ("simulate_bar_of_zero", "simulate", &["--bar", "460,0", "--out", "old.toml"]),
        ("simulate_bar_out_of_reach", "simulate", &["--bar", "5000", "--per-pair", "2", "--out", "old.toml"]),
        ("simulate_no_poses", "simulate", &["--per-pair", "0", "--out", "old.toml"]),
        ("simulate_poses_below_zero", "simulate", &["--per-pair", "-3", "--out", "old.toml"]),
        ("simulate_noise_below_zero", "simulate", &["--sigma-mm", "-1", "--out", "old.toml"]),
        ("simulate_noise_below_zero_after_an_equals_sign", "simulate", &["--sigma-mm=-1", "--out", "old.toml"]),
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
    fs::create_dir(bench.0.path().join("folder")).expect("it is not there");
    let simulate = ["simulate", "--robot", "puma560", "--rig", "triangles", "--bar", "460", "--per-pair", "1", "--out"];
    let fit = ["fit", "--robot", "puma560", "--rig", "triangles", "all.csv", "--out"];
    bench.fails(3, "write_poses_to_a_missing_folder", &[&simulate[..], &["missing/poses.csv"]].concat());
    bench.fails(3, "write_poses_onto_a_folder", &[&simulate[..], &["folder"]].concat());
    bench.fails(3, "write_a_robot_to_a_missing_folder", &[&fit[..], &["missing/calibrated.toml"]].concat());
    bench.fails(3, "write_a_robot_below_a_file", &[&fit[..], &["old.toml/calibrated.toml"]].concat());
    bench.fails(3, "write_a_demo_onto_a_file", &["demo", "--out", "old.toml"]);
}

#[test]
fn rows_that_may_be_mistakes_are_warned_of_once_a_kind_and_used() {
    let bench = Bench::new();
    let rows = "A,1,10.0,100.0,455.5\nA,1,171.0,100.0,455.5\nB,2,-170.5,600.0,455.5\nB,2,0.0,0.0,530.0\nB,1,30.0,200.0,610.125\n";
    bench.put("doubtful.csv", format!("{POSES}{rows}"));
    let many = "A,1,10.0,-0.5,460.0\n".repeat(7);
    bench.put("many.csv", format!("chuck,sphere,q1_deg,q2_mm,length_mm\n{many}"));
    let cases: [(&str, &[&str]); 4] = [
        ("warning_of_each_kind", &["validate", "--robot", "robot.toml", "--rig", "rig.toml", "doubtful.csv"]),
        ("warning_of_many_rows", &["rank", "--robot", "robot.toml", "--rig", "rig.toml", "many.csv"]),
        ("warning_of_poses_in_two_files", &["validate", "--robot", "robot.toml", "--rig", "rig.toml", "poses.csv", "poses.csv"]),
        ("warning_of_fk_beyond_limits", &["fk", "--robot", "robot.toml", "--q", "-180,600"]),
    ];
    for (name, args) in cases {
        let run = host_cal_in(bench.0.path(), args);
        assert_eq!(run.code, 0, "{}", run.transcript());
        snapshot(name, args, &run);
        let json = host_cal_in(bench.0.path(), &[args, &["--json"]].concat());
        assert_eq!((json.code, &json.stderr), (0, &run.stderr), "the same warnings beside JSON");
        let listed = json.json()["warnings"]
            .as_array()
            .map(|list| list.iter().map(|line| format!("warning: {}\n", line.as_str().expect("text"))).collect::<String>());
        assert_eq!(listed.unwrap_or_default(), run.stderr, "the document holds the warnings too");
    }
}
