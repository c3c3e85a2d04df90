//! Every file that `host-cal` refuses or warns of: what it says, and that it leaves the disk as it was.

use std::fs;

use ballbar_tests::workbench::{POSES, RIG, ROBOT, Workbench, snapshot};

const FIT: [&str; 8] = ["fit", "--robot", "robot.toml", "--rig", "rig.toml", "poses.csv", "--out", "old.toml"];
const VALIDATE: [&str; 6] = ["validate", "--robot", "robot.toml", "--rig", "rig.toml", "poses.csv"];

/// Changes one place of a good file and expects `fit` to refuse it. A change from nothing is a file of its own.
fn refuses_files(file: &str, good: &str, changes: &[(&str, &str, &str)]) {
    for (name, from, to) in changes {
        assert!(good.contains(from), "{name}: the good file has no {from}");
        let bench = Workbench::new();
        bench.put(file, if from.is_empty() { (*to).to_owned() } else { good.replacen(from, to, 1) });
        bench.refuses(name, &FIT);
        assert!(bench.run(&FIT).stderr.starts_with(&format!("  × {file}")), "{name}: refused, but not for its own file");
    }
}

#[test]
fn the_files_that_the_refused_ones_are_made_of_are_accepted_without_a_warning() {
    let run = Workbench::new().run(&VALIDATE);
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
            ("robot_link_with_an_unknown_key", "rotation_deg = [0.0, 90", "inertia = 3.0\nrotation_deg = [0.0, 90"),
            ("robot_link_in_metres", "translation_mm = [150.0, 0.0, 0.0]", "translation_m = [0.15, 0.0, 0.0]"),
            ("robot_link_of_two_numbers", "[150.0, 0.0, 0.0]", "[150.0, 0.0]"),
            ("robot_link_of_words", "[150.0, 0.0, 0.0]", "[\"150\", 0.0, 0.0]"),
            ("robot_link_with_nan", "[150.0, 0.0, 0.0]", "[150.0, nan, 0.0]"),
            ("robot_mass_without_its_centre", "rotation_deg = [0.0, 90", "mass_kg = 3.0\nrotation_deg = [0.0, 90"),
            (
                "robot_mass_below_zero",
                "rotation_deg = [0.0, 90",
                "mass_kg = -3.0\ncenter_mm = [0, 0, 0]\nrotation_deg = [0.0, 90",
            ),
            ("robot_compliance_without_masses", "scale = 1.0\n", "scale = 1.0\ncompliance_deg_per_nm = 0.001\n"),
            ("robot_compliance_of_the_other_kind", "scale = 1.0\n", "scale = 1.0\ncompliance_mm_per_n = 0.001\n"),
            ("robot_eccentricity_of_two_numbers", "scale = 1.0\n", "scale = 1.0\neccentricity_deg = [0.01, 0.02]\n"),
            ("robot_eccentric_slide", "offset_mm =", "eccentricity_deg = [0.01, 0, 0, 0]\noffset_mm ="),
            ("robot_backlash_of_a_turn", "scale = 1.0\n", "scale = 1.0\nbacklash_deg = 360.0\n"),
            ("robot_gravity_without_direction", "name =", "gravity = [0, 0, 0]\nname ="),
            ("robot_link_tolerance_below_zero", "rotation_deg = [0.0, 90", "tolerance_mm = -0.5\nrotation_deg = [0.0, 90"),
            ("robot_link_tolerance_of_nan", "rotation_deg = [0.0, 90", "tolerance_deg = nan\nrotation_deg = [0.0, 90"),
            ("robot_link_tolerance_of_a_list", "rotation_deg = [0.0, 90", "tolerance_mm = [1, 1, 1]\nrotation_deg = [0.0, 90"),
            ("robot_offset_tolerance_of_infinity", "scale = 1.0\n", "scale = 1.0\ntolerance_deg = inf\n"),
            ("robot_offset_tolerance_of_the_other_kind", "scale = 1.0\n", "scale = 1.0\ntolerance_mm = 0.1\n"),
            ("robot_scale_tolerance_below_zero", "scale = 1.0\n", "scale = 1.0\nscale_tolerance = -5e-4\n"),
            ("robot_tolerances_below_zero", "[[links]]", "[tolerances]\nlink_deg = -1\n\n[[links]]"),
            ("robot_tolerances_with_an_unknown_key", "[[links]]", "[tolerances]\nlinks_mm = 1\n\n[[links]]"),
            ("robot_tolerance_beside_no_value", "name =", "tolerance_mm = 1.0\nname ="),
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
            ("robot_joint_coupled_to_itself", "joint = 1", "joint = 2"),
            ("robot_joint_coupled_to_none_there", "joint = 1", "joint = 7"),
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
            ("rig_name_that_is_a_number", "\"1\"", "1"),
            ("rig_point_of_infinity", "[565.0", "[inf"),
            ("rig_chuck_with_an_unknown_key", "name = \"B\"", "label = \"b\"\nname = \"B\""),
            ("rig_with_an_unknown_key", "[bar]", "[table]\nheight_mm = 0\n[bar]"),
            ("rig_bar_below_zero", "610.0", "-610.0"),
            ("rig_bar_without_length", "[460.0, 610.0]", "[]"),
            ("rig_bar_without_travel", "travel_mm = 75.0\n", ""),
            ("rig_bar_with_no_travel", "75.0", "0"),
            ("rig_tolerance_below_zero", "[[chucks]]", "tolerance_mm = -1\n\n[[chucks]]"),
            ("rig_sphere_tolerance_of_nan", "name = \"2\"\n", "name = \"2\"\ntolerance_mm = nan\n"),
            ("rig_zero_tolerance_below_zero", "75.0\n", "75.0\nzero_tolerance_mm = -0.2\n"),
            ("rig_zero_tolerance_of_a_rod_below_zero", "75.0\n", "75.0\nzero_tolerance_mm = [0.2, -0.2]\n"),
            ("rig_zero_tolerances_of_three_rods", "75.0\n", "75.0\nzero_tolerance_mm = [0.2, 0.2, 0.2]\n"),
            ("rig_zero_tolerance_of_words", "75.0\n", "75.0\nzero_tolerance_mm = \"0.2\"\n"),
            ("rig_gain_tolerance_of_infinity", "75.0\n", "75.0\ngain_tolerance = inf\n"),
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
        let bench = Workbench::new();
        bench.put(file, b"caf\xe9 = \"\xff\"\n");
        bench.refuses(&format!("{what}_that_is_not_utf8"), &FIT);
        fs::remove_file(bench.path(file)).expect("it was there");
        bench.refuses(&format!("{what}_that_is_missing"), &FIT);
        fs::create_dir(bench.path(file)).expect("it is gone");
        bench.refuses(&format!("{what}_that_is_a_folder"), &FIT);
    }
}

#[test]
fn weights_for_some_poses_only_are_refused() {
    let bench = Workbench::new();
    bench.put("weighed.csv", "chuck,sphere,q1_deg,q2_mm,length_mm,sigma_mm\nA,1,10.0,100.0,455.5,0.1\n");
    bench.refuses("sigma_in_the_second_file_only", &[&VALIDATE[..], &["weighed.csv"]].concat());
}

#[test]
fn rows_that_may_be_mistakes_are_warned_of_once_a_kind_and_used() {
    let bench = Workbench::new();
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
        let run = bench.run(args);
        assert_eq!(run.code, 0, "{}", run.transcript());
        snapshot(name, args, &run.stderr);
        let json = bench.run(&[args, &["--json"]].concat());
        assert_eq!((json.code, &json.stderr), (0, &run.stderr), "the same warnings beside JSON");
        if args[0] != "fk" {
            let document = json.json();
            let listed = document["warnings"].as_array().expect("a list of warnings");
            let lines: String = listed.iter().map(|line| format!("warning: {}\n", line.as_str().expect("text"))).collect();
            assert_eq!(lines, run.stderr, "the document holds the warnings too");
        }
    }
}

#[test]
fn a_vector_of_four_numbers_is_refused() {
    for (file, good, from, to) in [
        ("robot.toml", ROBOT, "[150.0, 0.0, 0.0]", "[150.0, 0.0, 0.0, 7.0]"),
        ("robot.toml", ROBOT, "[0.0, 90.0, 0.0]", "[0.0, 90.0, 0.0, 7.0]"),
        ("rig.toml", RIG, "[565.0, 0.0, 0.0]", "[565.0, 0.0, 0.0, 7.0]"),
    ] {
        let bench = Workbench::new();
        bench.put(file, good.replacen(from, to, 1));
        assert!(bench.fails(2, &VALIDATE).starts_with(&format!("  × {file}")));
    }
}

#[test]
fn a_name_that_a_row_of_poses_cannot_hold_is_refused() {
    for name in ["B\\rC", "B\\tC", "\\u001b[31mB"] {
        let bench = Workbench::new();
        bench.put("rig.toml", RIG.replacen("\"B\"", &format!("\"{name}\""), 1));
        assert!(bench.fails(2, &VALIDATE).starts_with("  × rig.toml:6"));
    }
}

#[test]
fn a_quote_that_is_never_closed_is_refused() {
    let bench = Workbench::new();
    let rows = "chuck,sphere,q1_deg,q2_mm,length_mm,set\nA,1,10.0,100.0,455.5,\"shell\nA,2,-20.0,150.0,460.25,shell\n";
    bench.put("poses.csv", rows);
    assert!(bench.fails(2, &VALIDATE).starts_with("  × poses.csv:2"));
}

#[test]
fn a_line_of_white_space_is_skipped_or_refused_where_it_stands() {
    let bench = Workbench::new();
    bench.put("poses.csv", POSES.replacen("A,2", "   \nA,2", 1));
    let run = bench.run(&VALIDATE);
    assert!(run.code == 0 || run.stderr.starts_with("  × poses.csv:4"), "{}", run.transcript());
}

#[test]
fn lines_that_end_by_a_carriage_return_alone_are_counted() {
    let bench = Workbench::new();
    bench.put("poses.csv", POSES.replace("460.25", "nan").replace('\n', "\r"));
    assert!(bench.fails(2, &VALIDATE).starts_with("  × poses.csv:4"));
}
