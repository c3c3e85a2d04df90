//! Joint terms of a robot's file: what is read and written, and which commands compute with them.

use std::fs;

use ballbar::{Approach, Direction, STANDARD_GRAVITY_M_S2, TermKind, Vector3};
use ballbar_calib::identify::residuals;
use ballbar_calib::kinematics::{InverseKinematics, Thoroughness, apart};
use ballbar_calib::model::{Calibration, CalibrationVerdict, Dataset, Robot};
use ballbar_tests::command::host_cal_in;
use ballbar_tests::naive;
use ballbar_tests::shells::runs;
use host_cal::board::{NOMINAL_TRAVEL_M, nominal_lvdt, parameter_set, rounding_of_kinematics};
use host_cal::files::{ROBOTS, Source, append_poses, calibrated_toml, open_rig, open_robot, parse_robot};
use num_complex::Complex;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

/// A built-in robot's text with terms on its second and third joint, masses behind them, and a payload.
fn with_terms(design: &str) -> String {
    let (_, text) = ROBOTS.iter().find(|(name, _)| *name == design).expect("a built-in robot");
    let mut parts: Vec<String> = text.split("[[links]]").map(str::to_owned).collect();
    parts[3] = format!("\nmass_kg = 17.4\ncenter_mm = [68.0, 6.0, -16.0] # by CAD{}", parts[3]);
    parts[4] = format!("\nmass_kg = 4.8\ncenter_mm = [0.0, -70.0, 14.0]{}", parts[4]);
    let text = parts.join("[[links]]");
    let mut parts: Vec<String> = text.split("[[joints]]").map(str::to_owned).collect();
    parts[2] = format!("\ncompliance_deg_per_nm = 0.0006 # of the gear\nbacklash_deg = 0.02{}", parts[2]);
    parts[3] = format!("\neccentricity_deg = [0.01, -0.02, 0.005, 0.0]\ncompliance_deg_per_nm = 0.001{}", parts[3]);
    format!("gravity = [0, 0.1, -1]\npayload = {{ mass_kg = 2.5, center_mm = [0, 0, 40] }}\n{}", parts.join("[[joints]]"))
}

fn robot(text: &str) -> Robot {
    parse_robot(&Source::new("arm.toml", text)).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn terms_are_read_in_their_units() {
    let terms = robot(&with_terms("puma560")).terms;
    let close = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-15, "{found} for {expected}");
    close(terms.coefficient(1, TermKind::Compliance), 0.0006_f64.to_radians());
    close(terms.coefficient(1, TermKind::Backlash), 0.02_f64.to_radians());
    close(terms.coefficient(2, TermKind::CosQ), -0.02_f64.to_radians());
    close(terms.coefficient(2, TermKind::Sin2Q), 0.005_f64.to_radians());
    assert_eq!(terms.coefficient(0, TermKind::SinQ), 0.0);
    // Link 3 is what joint 2 moves.
    assert_eq!((terms.masses.links[1].mass_kg, terms.masses.links[2].mass_kg), (17.4, 4.8));
    assert_eq!(terms.masses.links[1].center_m, Vector3::new(0.068, 0.006, -0.016));
    assert_eq!(terms.masses.payload.center_m.z, 0.04);
    let gravity = terms.masses.gravity_base_m_s2;
    close(gravity.norm(), STANDARD_GRAVITY_M_S2);
    close(gravity.y / gravity.z, -0.1);
    assert!(open_robot("puma560").unwrap().terms.are_zero());
}

#[test]
fn a_calibrated_robot_keeps_its_terms_and_takes_others() {
    // The third joint of a Stanford arm slides.
    let on_a_slide = "compliance_mm_per_n = 0.001";
    let text =
        with_terms("stanford").replace("eccentricity_deg = [0.01, -0.02, 0.005, 0.0]\ncompliance_deg_per_nm = 0.001", on_a_slide);
    let source = Source::new("arm.toml", &text);
    let before = robot(&text);
    let calibration = Calibration {
        when: "2025-01-01T00:00:00Z".into(),
        by: "a test".into(),
        verdict: Some(CalibrationVerdict::Calibrated),
        reasons: Vec::new(),
        from_robot: "arm.toml".into(),
        from_poses: Vec::new(),
        poses: 1,
        free_parameters: 1,
        rms_initial_mm: 1.0,
        rms_mm: 1.0,
        held_out_rms_mm: None,
    };
    let kept = calibrated_toml(&source, &before.chain, &before.terms, &calibration).unwrap();
    assert!(kept.contains("compliance_deg_per_nm = 0.0006 # of the gear\nbacklash_deg = 0.02\n"), "{kept}");
    assert_eq!(robot(&kept).terms, before.terms);

    let mut fitted = before.terms;
    fitted.set_coefficient(1, TermKind::Compliance, 2e-5);
    fitted.set_coefficient(0, TermKind::Cos2Q, 1e-4);
    fitted.set_coefficient(2, TermKind::Compliance, 1e-6);
    fitted.set_coefficient(2, TermKind::Backlash, -3e-5);
    // One centre moves, the other by less than anybody knows of it.
    fitted.masses.links[1].center_m.x += 5e-5;
    fitted.masses.links[2].center_m.x += 0.02;
    let written = calibrated_toml(&source, &before.chain, &fitted, &calibration).unwrap();
    assert!(written.contains(" # of the gear"), "{written}");
    assert!(written.contains("center_mm = [68.0, 6.0, -16.0] # by CAD"), "{written}");
    let read = robot(&written).terms;
    assert!((read.masses.links[2].center_m - fitted.masses.links[2].center_m).norm() < 1e-12, "{written}");
    for joint in 0..6 {
        for term in TermKind::ALL {
            let (found, expected) = (read.coefficient(joint, term), fitted.coefficient(joint, term));
            assert!((found - expected).abs() <= 1e-15 * expected.abs(), "{term:?} of joint {joint}: {found} for {expected}");
        }
    }
}

#[test]
fn the_tool_is_where_the_terms_put_it() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("arm.toml"), with_terms("puma560")).unwrap();
    let robot = robot(&with_terms("puma560"));
    let q_deg = [10.0, -40.0, 100.0, 20.0, -30.0, 50.0];
    let q = q_deg.map(f64::to_radians);
    let loads = naive::gravity_loads(&robot.chain, &q, &robot.terms);
    let displacements = naive::displacements(&robot.terms, &q, &loads, Approach::UNKNOWN, None);
    let parameters: Vec<Complex<f64>> = robot.chain.parameters().iter().map(|&value| value.into()).collect();
    let expected = naive::base_from_tool_displaced(robot.chain.joint_kinds(), &parameters, &q, &displacements);
    let run = runs(&folder, &[&["fk", "--robot", "arm.toml", "--q", "10,-40,100,20,-30,50", "--json"]]);
    for axis in 0..3 {
        let found = run.json()["position_mm"][axis].as_f64().unwrap();
        assert!((found - expected[(axis, 3)].re * 1e3).abs() < 1e-9, "{found} for {}", expected[(axis, 3)].re * 1e3);
    }
    let rigid = runs(&folder, &[&["fk", "--robot", "puma560", "--q", "10,-40,100,20,-30,50", "--json"]]);
    let moved_mm = (rigid.json()["position_mm"][2].as_f64().unwrap() - expected[(2, 3)].re * 1e3).abs();
    assert!((0.05..3.0).contains(&moved_mm), "{moved_mm}");
}

/// As the board computes, with every mixture of joints that rose and that fell.
#[test]
fn a_board_is_given_the_terms_and_computes_with_them() {
    let text = with_terms("puma560");
    let robot = robot(&text);
    let set = parameter_set(&robot, nominal_lvdt(NOMINAL_TRAVEL_M)).unwrap();
    let difference = rounding_of_kinematics(&robot.kinematics(), &robot.limits, &set.compile().unwrap(), 500);
    assert!(difference.is_small(), "{difference:?}");
    let rigid = parameter_set(&open_robot("puma560").unwrap(), set.lvdt).unwrap();
    assert!(rigid.terms.is_empty());
    let left_out = rounding_of_kinematics(&robot.kinematics(), &robot.limits, &rigid.compile().unwrap(), 500);
    assert!(left_out.position_m > 1e-4, "{left_out:?}");
}

/// With the closed form of a PUMA, and by steps of a UR5e.
#[test]
fn inverse_kinematics_lead_back_through_the_terms() {
    for design in ["puma560", "irb120", "ur5e"] {
        let robot = robot(&with_terms(design));
        let inverse = InverseKinematics::new(&robot);
        let kinematics = robot.kinematics();
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for step in 0..10 {
            let q: Vec<f64> = robot
                .limits
                .iter()
                .enumerate()
                .map(|(i, limits)| {
                    limits.min + (limits.max - limits.min) * (0.05 + 0.9 * (0.2 + 0.07 * step as f64 + 0.31 * i as f64).fract())
                })
                .collect();
            let target = kinematics.base_from_tool(&robot.chain.joint_vector(&q).unwrap());
            let branches = inverse.branches(&target, Thoroughness { starts: 60, patience: 20 }, &mut rng);
            assert!(!branches.within_limits.is_empty(), "{design} at {q:?}");
            for q in &branches.within_limits {
                let (off_m, off_rad) = apart(&kinematics.base_from_tool(q), &target);
                assert!(off_m < 1e-9 && off_rad < 1e-9, "{design}: {off_m:e} m, {off_rad:e} rad");
            }
        }
    }
}

#[test]
fn simulated_lengths_have_the_terms_and_only_robots_with_them_explain_these() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("arm.toml"), with_terms("puma560")).unwrap();
    let simulate = ["simulate", "--robot", "arm.toml", "--rig", "triangles", "--bar", "460", "--per-pair", "5"];
    runs(&folder, &[&simulate, &["--sigma-mm", "0", "--seed", "1", "--out", "poses.csv"]]);
    let rms_mm = |robot: &str| {
        let run = runs(&folder, &[&["validate", "--robot", robot, "--rig", "triangles", "poses.csv", "--json"]]);
        run.json()["rms_mm"].as_f64().unwrap()
    };
    assert!(rms_mm("arm.toml") < 1e-5, "{}", rms_mm("arm.toml"));
    assert!(rms_mm("puma560") > 0.1, "{}", rms_mm("puma560"));
}

/// Lengths of joints with backlash fit where the file says from which sides they came, and only there.
#[test]
fn the_approach_of_each_row_counts() {
    let robot = robot(&with_terms("puma560"));
    let (rig, kinematics) = (open_rig("triangles").unwrap(), robot.kinematics());
    let pairing = rig.all_pairings()[0];
    let signs = ["+-0+-+", "-+0-+-", "000000", ""];
    let row = |(i, signs): (usize, &&str)| {
        let q = [0.3, -0.7, 1.4, 0.2, -0.5, 0.9].map(|q| q + 0.1 * i as f64);
        let approach = signs.chars().enumerate().fold(Approach::UNKNOWN, |approach, (joint, sign)| {
            let direction = [('+', Direction::Rising), ('-', Direction::Falling)].into_iter().find(|(own, _)| *own == sign);
            approach.with(joint, direction.map(|(_, direction)| direction))
        });
        let vector = robot.chain.joint_vector(&q).unwrap();
        let length_m = kinematics.configuration(&vector, approach).length(&rig.pairing(pairing));
        let q_deg = q.map(|q| q.to_degrees().to_string()).join(",");
        format!("A,1,{q_deg},{},{signs}\n", length_m * 1e3)
    };
    let rows: String = signs.iter().enumerate().map(row).collect();
    let text = format!("chuck,sphere,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,length_mm,approach\n{rows}");
    let read = |text: &str| {
        let mut dataset = Dataset::default();
        append_poses(&mut dataset, &Source::new("poses.csv", text), &robot, &rig).map(|()| dataset)
    };
    let largest_m = |text: &str| {
        let residuals = residuals(&kinematics, &read(text).unwrap());
        residuals.iter().map(|residual| residual.value_m.abs()).fold(0.0, f64::max)
    };
    assert!(largest_m(&text) < 1e-9, "{}", largest_m(&text));
    assert!(largest_m(&text.replace("+-0+-+", "").replace("-+0-+-", "")) > 5e-5);
    for bad in ["+-0+-", "+-0+-+0", "+-0+-x"] {
        let error = read(&text.replace("+-0+-+", bad)).unwrap_err().to_string();
        assert!(error.starts_with("poses.csv:2: column `approach`"), "{error}");
    }
}

#[test]
fn terms_are_part_of_the_robot_wherever_it_is_computed_with_or_are_refused_by_name() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("arm.toml"), with_terms("puma560")).unwrap();
    runs(
        &folder,
        &[&["simulate", "--robot", "arm.toml", "--rig", "triangles", "--bar", "460", "--per-pair", "5", "--out", "poses.csv"]],
    );
    let measured = ["--robot", "arm.toml", "--rig", "triangles", "poses.csv"];
    let run = host_cal_in(folder.path(), &["export", "--robot", "arm.toml", "--format", "urdf"]);
    assert_eq!(run.code, 2, "{}", run.transcript());
    let said = "arm.toml: its joints have terms, which `host-cal export` would leave out";
    assert!(run.stderr.contains(said), "{}", run.transcript());

    // Its own lengths, to the digits of the file: nothing is left that a fit without the terms would have to explain.
    let fit = host_cal_in(folder.path(), &[&["fit"], &measured[..], &["--json"]].concat()).json();
    assert!(fit["rms_initial_mm"].as_f64().unwrap() < 1e-4, "{}", fit["rms_initial_mm"]);
    assert!(fit["rms_mm"].as_f64().unwrap() < 1e-4, "{}", fit["rms_mm"]);
    assert_eq!(host_cal_in(folder.path(), &[&["rank"], &measured[..]].concat()).code, 0);
}

#[test]
fn what_is_simulated_of_a_robot_with_backlash_says_from_which_sides_the_joints_came() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("arm.toml"), with_terms("puma560")).unwrap();
    let simulate =
        ["simulate", "--robot", "arm.toml", "--rig", "triangles", "--bar", "460", "--per-pair", "12", "--out", "poses.csv"];
    runs(&folder, &[&simulate]);
    let text = fs::read_to_string(folder.path().join("poses.csv")).unwrap();
    let column = text.lines().next().unwrap().split(',').position(|name| name == "approach").expect("the column is there");
    let signs: Vec<&str> = text.lines().skip(1).map(|line| line.split(',').nth(column).unwrap()).collect();
    assert_eq!((signs.len(), signs[0]), (108, ""), "nobody knows where the first came from");
    assert!(signs[1..].iter().all(|signs| signs.len() == 6 && signs.bytes().all(|sign| b"+-".contains(&sign))), "{signs:?}");
    // The lengths are those of joints that came so.
    let validate = ["validate", "--robot", "arm.toml", "--rig", "triangles", "poses.csv", "--json"];
    let rms_mm = |run: ballbar_tests::command::Run| run.json()["rms_mm"].as_f64().unwrap();
    assert!(rms_mm(host_cal_in(folder.path(), &validate)) < 1e-5);
    let without: String = text
        .lines()
        .map(|line| {
            line.split(',').enumerate().filter(|(i, _)| *i != column).map(|(_, field)| field).collect::<Vec<_>>().join(",") + "\n"
        })
        .collect();
    fs::write(folder.path().join("poses.csv"), without).unwrap();
    assert!(rms_mm(host_cal_in(folder.path(), &validate)) > 0.01);
}
