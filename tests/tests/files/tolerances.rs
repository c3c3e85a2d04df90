//! Tolerances of robots and rigs: what files say of them, what holds where they say nothing, and that edited files keep them.

use std::fs;

use ballbar_calib::model::{JointTolerance, LinkTolerance, Rig, Robot, Tolerances};
use ballbar_tests::command::host_cal_in;
use ballbar_tests::shells::{puma, runs};
use ballbar_tests::workbench::{RIG, ROBOT};
use host_cal::files::{RIGS, ROBOTS, Source, fitted_rig_toml, open_robot, parse_rig, parse_robot};

fn robot(text: &str) -> Robot {
    parse_robot(&Source::new("arm.toml", text)).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn rig(text: &str) -> Rig {
    parse_rig(&Source::new("rig.toml", text)).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn link(displacement_m: f64, rotation_deg: f64) -> LinkTolerance {
    LinkTolerance { displacement_m, rotation_rad: rotation_deg.to_radians() }
}

fn joint(offset: f64, scale: f64) -> JointTolerance {
    JointTolerance { offset, scale }
}

/// A robot of a turn and a slide, with lines before its first link, behind its second link, and behind its joints' scales.
fn with(table: &str, of_link: &str, of_turn: &str, of_slide: &str) -> Robot {
    let text = ROBOT.replacen("\n\n[[links]]", &format!("\n{table}\n[[links]]"), 1);
    let text = text.replace("[0.0, 90.0, 0.0]\n", &format!("[0.0, 90.0, 0.0]\n{of_link}\n"));
    let text = text.replace("min_deg", &format!("{of_turn}\nmin_deg")).replace("min_mm", &format!("{of_slide}\nmin_mm"));
    robot(&text)
}

#[test]
fn a_robot_that_says_nothing_has_the_usual_tolerances() {
    let found = robot(ROBOT).tolerances;
    assert_eq!(found.links, [link(50e-3, 5.0), link(1e-3, 0.5), link(5e-3, 2.0)]);
    assert_eq!(found.joints, [joint(0.5_f64.to_radians(), 5e-4), joint(1e-3, 5e-4)]);
    for (name, _) in ROBOTS {
        let robot = open_robot(name).unwrap();
        let mut usual = Tolerances::usual(robot.chain.joint_kinds());
        if name == "puma560" {
            usual.joints.iter_mut().for_each(|joint| joint.scale = 1.2e-3);
        }
        assert_eq!(robot.tolerances, usual, "{name}");
    }
}

#[test]
fn tolerances_stand_beside_values_or_once_for_what_says_none() {
    let table = "[tolerances]\nlink_mm = 0.25\nlink_deg = 0.1\noffset_deg = 0.2\noffset_mm = 2\nscale = 1e-4\n";
    let once = with(table, "", "", "").tolerances;
    // Where the robot stands and how its tool is mounted has nothing to do with how an arm is made.
    assert_eq!(once.links, [link(50e-3, 5.0), link(0.25e-3, 0.1), link(5e-3, 2.0)]);
    assert_eq!(once.joints, [joint(0.2_f64.to_radians(), 1e-4), joint(2e-3, 1e-4)]);

    // Each key by its own: the others hold what holds without it.
    let own = with("", "tolerance_deg = 0.05", "scale_tolerance = 1e-3", "tolerance_mm = 0.125").tolerances;
    assert_eq!(own.links[1], link(1e-3, 0.05));
    assert_eq!(own.joints, [joint(0.5_f64.to_radians(), 1e-3), joint(0.125e-3, 5e-4)]);
    let both = with(table, "tolerance_mm = 3", "tolerance_deg = 25", "scale_tolerance = 0.5").tolerances;
    assert_eq!(both.links[1], link(3e-3, 0.1));
    assert_eq!(both.joints, [joint(25_f64.to_radians(), 1e-4), joint(2e-3, 0.5)]);

    let ends = ROBOT.replace("[0.0, 0.0, 400.0]", "[0.0, 0.0, 400.0]\ntolerance_mm = 2.0");
    let ends = robot(&ends.replace("[0.0, 20.0, 30.0]", "[0.0, 20.0, 30.0]\ntolerance_deg = 0.25")).tolerances;
    assert_eq!(ends.links, [link(2e-3, 5.0), link(1e-3, 0.5), link(5e-3, 0.25)]);
}

#[test]
fn zero_is_known_exactly_and_has_no_sign() {
    let table = "[tolerances]\nlink_mm = 0\nlink_deg = -0.0\noffset_deg = 0\noffset_mm = 0.0\nscale = 0e9\n";
    let Tolerances { links, joints } = with(table, "", "", "tolerance_mm = -0.0").tolerances;
    let inside = [links[1].displacement_m, links[1].rotation_rad];
    let all = inside.into_iter().chain(joints.iter().flat_map(|joint| [joint.offset, joint.scale]));
    assert!(all.into_iter().all(|tolerance| tolerance == 0.0 && tolerance.is_sign_positive()), "{links:?} {joints:?}");
}

#[test]
fn numbers_that_no_tolerance_can_be_are_refused_where_they_stand() {
    let refused = |text: &str| match parse_robot(&Source::new("arm.toml", text)) {
        Ok(_) => panic!("taken:\n{text}"),
        Err(error) => error.to_string(),
    };
    // Of either sign, below the smallest that counts, beyond the largest.
    for number in ["-1e-9", "-1", "1e-7", "1e7", "-inf", "inf", "nan", "-nan"] {
        for key in ["link_mm", "link_deg", "offset_deg", "offset_mm"] {
            let said = refused(&ROBOT.replacen("\n[[links]]", &format!("[tolerances]\n{key} = {number}\n[[links]]"), 1));
            assert!(said.starts_with(&format!("arm.toml:3: `{key}` is ")), "{said}");
            assert!(said.ends_with("expected 0, or a number from 1e-6 to 1e6"), "{said}");
        }
        let said = refused(&ROBOT.replace("offset_deg", &format!("tolerance_deg = {number}\noffset_deg")));
        assert!(said.starts_with("arm.toml:17: `tolerance_deg` is "), "{said}");
    }
    for number in ["-5e-4", "1e-12", "1001", "inf", "nan"] {
        let said = refused(&ROBOT.replace("offset_deg", &format!("scale_tolerance = {number}\noffset_deg")));
        assert!(said.starts_with("arm.toml:17: `scale_tolerance` is "), "{said}");
        assert!(said.ends_with("expected 0, or a number from 1e-9 to 1e3"), "{said}");
        refused(&ROBOT.replacen("\n[[links]]", &format!("[tolerances]\nscale = {number}\n[[links]]"), 1));
    }
    let said = refused(&ROBOT.replace("offset_mm", "tolerance_deg = 1\noffset_mm"));
    assert_eq!(said, "arm.toml:26: `tolerance_deg` on a prismatic joint, expected `tolerance_mm`");
    // At the bounds.
    for number in ["1e-6", "1e6", "1000000"] {
        robot(&ROBOT.replace("offset_deg", &format!("tolerance_deg = {number}\noffset_deg")));
    }
}

#[test]
fn a_bar_is_known_once_for_all_rods_or_rod_by_rod() {
    let bar = |lines: &str| rig(&format!("{RIG}{lines}\n")).bar.expect("a bar");
    assert_eq!((bar("").zero_tolerances_m, bar("").gain_tolerance), (None, None));
    assert_eq!(bar("zero_tolerance_mm = 0.25").zero_tolerances_m, Some(vec![0.25e-3, 0.25e-3]));
    assert_eq!(bar("zero_tolerance_mm = 0").zero_tolerances_m, Some(vec![0.0, 0.0]));
    assert_eq!(bar("zero_tolerance_mm = [0.5, 2]").zero_tolerances_m, Some(vec![0.5e-3, 2e-3]));
    assert_eq!(bar("gain_tolerance = 2e-3").gain_tolerance, Some(2e-3));
    for lines in [
        "zero_tolerance_mm = []",
        "zero_tolerance_mm = [0.5]",
        "zero_tolerance_mm = [0.5, [0.5]]",
        "zero_tolerance_mm = { rod = 460 }",
        "zero_tolerance_mm = true",
        "zero_tolerance_mm = 1e-9",
        "zero_tolerance_mm = 18446744073709551616",
        "zero_tolerance_mm = [nan, 0.1]",
        "gain_tolerance = -1e-3",
        "gain_tolerance = [1e-3]",
    ] {
        let error = parse_rig(&Source::new("rig.toml", &format!("{RIG}{lines}\n"))).expect_err(lines).to_string();
        assert!(error.starts_with("rig.toml:20: "), "{error}");
    }
}

#[test]
fn a_rig_says_it_once_for_chucks_and_spheres_that_have_none_of_their_own() {
    let text = format!("tolerance_mm = 0.1\n{}", RIG.replace("name = \"B\"", "name = \"B\"\ntolerance_mm = 0"));
    let rig = rig(&text);
    let tolerances_m: Vec<_> = rig.chucks.iter().chain(&rig.spheres).map(|point| point.tolerance_m).collect();
    assert_eq!(tolerances_m, [Some(1e-4), Some(0.0), Some(1e-4), Some(1e-4)]);
    for (_, text) in RIGS {
        let bar = parse_rig(&Source::new("built in", text)).unwrap().bar;
        assert!(bar.is_none_or(|bar| bar.zero_tolerances_m.is_none() && bar.gain_tolerance.is_none()));
    }
}

/// A PUMA whose file says, in every place, how well it is known.
fn puma_with_tolerances() -> String {
    let (_, text) = ROBOTS.iter().find(|(name, _)| *name == "puma560").expect("a built-in robot");
    let own = "[tolerances]\nscale = 1.2e-3\n";
    assert!(text.contains(own), "{text}");
    let said = text.replacen(own, "[tolerances] # by the maker\nscale = 1.2e-3\nlink_mm = 2\n", 1);
    let mut parts: Vec<String> = said.split("[[links]]").map(str::to_owned).collect();
    parts[1].insert_str(0, "\ntolerance_mm = 20 # by tape\ntolerance_deg = 1");
    let text = parts.join("[[links]]");
    let mut parts: Vec<String> = text.split("[[joints]]").map(str::to_owned).collect();
    parts[2].insert_str(0, "\ntolerance_deg = 2 # remastered\nscale_tolerance = 0");
    parts.join("[[joints]]")
}

#[test]
fn calibrated_robots_and_fitted_rigs_keep_what_is_said() {
    let folder = puma();
    let before = puma_with_tolerances();
    fs::write(folder.path().join("arm.toml"), &before).unwrap();
    let (_, triangles) = RIGS.iter().find(|(name, _)| *name == "triangles").expect("a built-in rig");
    let bar = "[bar]\nzero_tolerance_mm = [0.2, 0.3] # by gauge\ngain_tolerance = 1e-3\n";
    let triangles = format!("tolerance_mm = 0.1\n{}", triangles.replace("[bar]\n", bar));
    fs::write(folder.path().join("rig.toml"), &triangles).unwrap();
    let files = ["--robot", "arm.toml", "--rig", "rig.toml", "poses.csv"];
    runs(&folder, &[&["fit"], &files, &["--out", "calibrated.toml"]]);
    let text = fs::read_to_string(folder.path().join("calibrated.toml")).unwrap();
    for line in
        ["[tolerances] # by the maker\nscale = 1.2e-3\nlink_mm = 2\n", "20 # by tape\n", "2 # remastered\nscale_tolerance = 0\n"]
    {
        assert!(text.contains(line), "{line}: {text}");
    }
    assert!(robot(&text).calibration.is_some());
    let said = robot(&before).tolerances;
    assert_eq!(robot(&text).tolerances, said);
    assert_eq!((said.links[0], said.links[1]), (link(20e-3, 1.0), link(2e-3, 0.5)));
    assert_eq!((said.joints[0].scale, said.joints[1]), (1.2e-3, joint(2_f64.to_radians(), 0.0)));

    let mut found = rig(&triangles);
    found.chucks[1].position_m.x += 1e-4;
    let written = fitted_rig_toml(&Source::new("rig.toml", &triangles), &found).unwrap();
    assert!(written.contains(bar), "{written}");
    let again = rig(&written);
    assert_eq!((again.bar, again.chucks[1].tolerance_m), (found.bar, Some(1e-4)));
}

#[test]
fn an_exported_robot_says_how_well_it_is_known() {
    let folder = tempfile::TempDir::new().unwrap();
    fs::write(folder.path().join("arm.toml"), puma_with_tolerances()).unwrap();
    let export = |format| host_cal_in(folder.path(), &["export", "--robot", "arm.toml", "--format", format]).stdout;
    let document: serde_json::Value = serde_json::from_str(&export("json")).unwrap();
    assert_eq!(document["links"][0]["tolerance_m"], 0.02);
    assert_eq!(document["links"][6]["tolerance_rad"], 2_f64.to_radians());
    assert_eq!(document["joints"][1]["offset_tolerance"], 2_f64.to_radians());
    assert_eq!(
        (&document["joints"][0]["scale_tolerance"], &document["joints"][1]["scale_tolerance"]),
        (&1.2e-3.into(), &0.0.into())
    );
    let yaml = export("yaml");
    assert!(yaml.contains("    tolerance_m: 0.02\n") && yaml.contains("    scale_tolerance: 0.0012\n"), "{yaml}");
}
