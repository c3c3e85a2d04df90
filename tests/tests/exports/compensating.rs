//! Commands for a controller that keeps its nominal model, held against both robots' chains by 4×4 products.

use std::fs;

use ballbar_calib::kinematics::{Compensation, Compensator, Goal, Unreached};
use ballbar_calib::model::{JointLimits, Robot};
use ballbar_tests::command::{Run, host_cal_in};
use ballbar_tests::exports::{joint_vectors, pose_by_products, write_calibrated};
use host_cal::files::{ROBOTS, Source, Target, UrdfEnds, open_robot, parse_robot, parse_urdf, pose_as_written, read_targets};
use nalgebra::{Matrix4, Rotation3, Vector3};
use tempfile::TempDir;

/// A built-in robot and what calibration makes of it.
fn robots(design: &str) -> (Robot, Robot) {
    let folder = TempDir::new().expect("a temporary folder");
    (write_calibrated(folder.path(), design), open_robot(design).expect("a built-in robot"))
}

fn targets(text: &str, nominal: &Robot) -> Vec<Target> {
    read_targets(&Source::new("targets", text), nominal).unwrap_or_else(|error| panic!("{error}"))
}

/// Commands one after the other, from the middle of the joints' ranges.
fn commands(real: &Robot, nominal: &Robot, text: &str) -> Vec<Result<Compensation, Unreached>> {
    let compensator = Compensator::new(real, nominal).expect("limits in common");
    let mut before = compensator.middle();
    let mut command = |target: &Target| {
        let found = compensator.compensate(&target.goal, &before, |q| q, pose_as_written);
        if let Ok(found) = &found {
            before = found.nominal_q;
        }
        found
    };
    targets(text, nominal).iter().map(&mut command).collect()
}

fn position(pose: &Matrix4<f64>) -> Vector3<f64> {
    pose.fixed_view::<3, 1>(0, 3).into()
}

fn largest_change(found: &Compensation) -> f64 {
    found.q.as_array().iter().zip(found.nominal_q.as_array()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

const JOINTS: &str = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n";
const POSE: &str = "x_mm,y_mm,z_mm,alpha_deg,beta_deg,gamma_deg\n";

#[test]
fn joint_targets_are_reached_where_the_nominal_model_has_them() {
    for (design, rows) in [
        // The elbow well bent: near a straight arm a millimetre turns it by degrees.
        ("puma560", "10,-40,160,20,-50,50\n-60,-100,30,-20,40,0\n"),
        ("ur5e", "10,-70,80,-30,60,200\n-200,-110,-70,20,-90,0\n"),
    ] {
        let (real, nominal) = robots(design);
        for found in commands(&real, &nominal, &format!("{JOINTS}{rows}")) {
            let found = found.unwrap();
            let wanted = pose_by_products(&nominal, found.nominal_q.as_array());
            let off = |q: &[f64]| (pose_by_products(&real, q) - wanted).amax();
            assert!(off(found.nominal_q.as_array()) > 5e-4, "the robots are the same");
            assert!(off(found.q.as_array()) < 1e-9, "{design}: {found:?}");
            assert!(found.before.0 > 5e-4 && found.left.0 < 1e-9 && found.left.1 < 1e-9, "{found:?}");
            assert!(largest_change(&found) < 0.02, "{design}: another branch, {found:?}");
            let believed = pose_by_products(&nominal, found.q.as_array());
            assert!((position(&believed) - found.nominal_base_from_tool.translation_m).amax() < 1e-12);
        }
    }
}

#[test]
fn poses_are_reached_on_the_branch_nearest_to_where_the_arm_was_or_to_the_joints_beside_them() {
    let (real, nominal) = robots("puma560");
    let path = "500,150,600,0,90,0\n510,150,600,0,90,0\n520,160,590,10,80,0\n";
    let along: Vec<Compensation> = commands(&real, &nominal, &format!("{POSE}{path}")).into_iter().map(Result::unwrap).collect();
    assert!((position(&pose_by_products(&real, along[0].q.as_array())) - Vector3::new(0.5, 0.15, 0.6)).amax() < 1e-9);
    for pair in along.windows(2) {
        let moved = pair[0].q.as_array().iter().zip(pair[1].q.as_array()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(moved < 0.4, "the arm turns over on its way: {pair:?}");
    }
    // The elbow the other way, as the joints beside the pose have it: the same place, another branch.
    let header = format!("{},{POSE}", JOINTS.trim_end());
    let other = commands(&real, &nominal, &format!("{header}0,-120,-30,0,60,0,500,150,600,0,90,0\n"))[0].unwrap();
    assert!((position(&pose_by_products(&real, other.q.as_array())) - Vector3::new(0.5, 0.15, 0.6)).amax() < 1e-9);
    assert!((other.q.as_array()[2] - along[0].q.as_array()[2]).abs() > 1.0, "{other:?}");
    assert!(largest_change(&other) < 0.1, "`before` is what the controller would do, not the joints beside the pose: {other:?}");
}

#[test]
fn a_controller_that_takes_poses_gets_one_that_its_own_inverse_turns_into_the_command() {
    let (real, nominal) = robots("ur5e");
    let q = "10,-70,80,-30,60,200";
    let found = commands(&real, &nominal, &format!("{JOINTS}{q}\n"))[0].unwrap();
    // The controller: its model's inverse, near where it would have been.
    let controller = Compensator::new(&nominal, &nominal).expect("limits in common");
    let goal = Goal::Pose(found.nominal_base_from_tool, Some(found.nominal_q));
    let theirs = controller.compensate(&goal, &found.nominal_q, |q| q, pose_as_written).unwrap();
    let off = theirs.q.as_array().iter().zip(found.q.as_array()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-8, "{off:e}");
}

#[test]
fn an_arm_of_few_joints_gets_to_the_position_and_says_how_far_it_is_turned() {
    let (real, nominal) = robots("scara");
    let kinds = "q1_deg,q2_deg,q3_mm,q4_deg\n";
    for q in joint_vectors(&nominal, 3) {
        let row = format!(
            "{:?},{:?},{:?},{:?}\n",
            q[0].to_degrees(),
            40.0 + q[1].to_degrees().abs() / 3.0,
            q[2] * 1e3,
            q[3].to_degrees()
        );
        match commands(&real, &nominal, &format!("{kinds}{row}"))[0] {
            Ok(found) => {
                let wanted = pose_by_products(&nominal, found.nominal_q.as_array());
                let reached = pose_by_products(&real, found.q.as_array());
                assert!((position(&wanted) - position(&reached)).amax() < 1e-6, "{found:?}");
                assert!(found.before.0 > 1e-4 && found.left.0 < 1e-6, "{found:?}");
                // Its tilt is no joint's to mend.
                assert!(found.left.1 > 1e-5 && found.left.1 < 0.01, "{found:?}");
            }
            Err(unreached) => panic!("{unreached}: {row}"),
        }
    }
    let pose = commands(&real, &nominal, &format!("{POSE}400,200,100,30,0,180\n400,200,100,30,5,180\n"));
    assert_eq!(pose[1], Err(Unreached::ByNominal), "no SCARA tilts its tool");
}

#[test]
fn an_arm_with_a_joint_to_spare_stays_near_where_it_is() {
    let folder = TempDir::new().expect("a temporary folder");
    let urdf = Source::new("seven axes", include_str!("../../urdf/seven_axes.urdf"));
    let imported = parse_urdf(&urdf, UrdfEnds::default()).unwrap_or_else(|error| panic!("{error}"));
    let design = folder.path().join("design.toml");
    fs::write(&design, &imported.toml).expect("a file");
    let (real, nominal) = (write_calibrated(folder.path(), &design.display().to_string()), imported.robot);
    let header = format!("{},q7_deg,{POSE}", JOINTS.trim_end());
    // Where the design is at 20, -40, 30, 70, 10, -50, 15, and 5 mm on.
    let at: Vec<f64> = [20.0, -40.0, 30.0, 70.0, 10.0, -50.0, 15.0].into_iter().map(f64::to_radians).collect();
    let wanted = pose_by_products(&nominal, &at);
    let [roll, pitch, yaw]: [f64; 3] = {
        let (roll, pitch, yaw) = Rotation3::from_matrix_unchecked(wanted.fixed_view::<3, 3>(0, 0).into()).euler_angles();
        [roll, pitch, yaw].map(f64::to_degrees)
    };
    let row = |x_off_mm: f64| {
        let [x, y, z]: [f64; 3] = (position(&wanted) * 1e3).into();
        format!("20,-40,30,70,10,-50,15,{},{y},{z},{yaw},{pitch},{roll}\n", x + x_off_mm)
    };
    let found = commands(&real, &nominal, &format!("{header}{}{}", row(0.0), row(5.0)));
    for (found, x_off_mm) in found.into_iter().zip([0.0, 5.0]) {
        let found = found.unwrap();
        let reached = position(&pose_by_products(&real, found.q.as_array()));
        assert!((reached - position(&wanted) - Vector3::new(x_off_mm / 1e3, 0.0, 0.0)).amax() < 1e-9, "{found:?}");
        assert!(largest_change(&found) < 0.05, "{found:?}");
        assert!(found.nominal_q.as_array().iter().zip(&at).all(|(a, b)| (a - b).abs() < 0.05), "{found:?}");
    }
}

#[test]
fn an_arm_shorter_than_its_design_does_not_reach_as_far() {
    let (_, text) = ROBOTS.iter().find(|(name, _)| *name == "ur5e").expect("a built-in robot");
    let nominal = open_robot("ur5e").expect("a built-in robot");
    let shorter = parse_robot(&Source::new("shorter", &text.replace("-425.0", "-424.0"))).expect("a robot");
    let stretched = format!("{JOINTS}0,-90,0,-90,0,0\n0,-90,30,-90,60,0\n");
    let found = commands(&shorter, &nominal, &stretched);
    assert_eq!(found[0], Err(Unreached::ByCalibrated));
    assert!(found[1].is_ok(), "{found:?}");
}

/// Of a calibrated puma560, the third joint's limits as degrees in its file.
fn with_third_joint(folder: &TempDir, min_deg: &str, max_deg: &str) {
    write_calibrated(folder.path(), "puma560");
    let path = folder.path().join("calibrated.toml");
    let text = fs::read_to_string(&path).expect("a file");
    let narrowed = text.replacen("min_deg = -45.0", &format!("min_deg = {min_deg}"), 1);
    let narrowed = narrowed.replacen("max_deg = 225.0", &format!("max_deg = {max_deg}"), 1);
    assert!(parse_robot(&Source::new("narrowed", &narrowed)).expect("a robot").limits[2].min.to_degrees() > -40.0, "{text}");
    fs::write(&path, narrowed).expect("a file");
}

#[test]
fn branches_are_looked_for_within_what_both_robots_allow() {
    let folder = TempDir::new().expect("a temporary folder");
    with_third_joint(&folder, "60.0", "225.0");
    // From a posture with the elbow the way that only the nominal robot may have it.
    let start = "--start=0,-120,-30,0,60,0";
    let run = run(&folder, &format!("{POSE}500,150,600,0,90,0\n400,250,500,0,90,0\n"), &[start, "--json"]);
    assert_eq!(run.code, 0, "{}", run.transcript());
    for command in run.json()["commands"].as_array().expect("commands") {
        assert!((60.0..=225.0).contains(&command["q"][2].as_f64().expect("a number")), "{command}");
    }
}

#[test]
fn robots_that_allow_nothing_in_common_are_refused_by_the_joint() {
    let folder = TempDir::new().expect("a temporary folder");
    with_third_joint(&folder, "226.0", "230.0");
    let run = run(&folder, &format!("{JOINTS}10,-40,160,20,-50,50\n"), &[]);
    assert_eq!(run.code, 2, "{}", run.transcript());
    assert!(
        run.stderr.contains("joint 3: the calibrated robot allows 226 to 230 deg, the nominal one -45 to 225 deg"),
        "{}",
        run.stderr
    );
}

#[test]
fn a_joint_that_can_hardly_move_is_no_trouble() {
    let mut robot = open_robot("ur5e").expect("a built-in robot");
    let min = 10.0_f64.to_radians();
    robot.limits[2] = JointLimits { min, max: min.next_up() };
    let found = commands(&robot, &robot, &format!("{POSE}500,150,600,0,90,0\n"))[0];
    assert!(found.is_err_and(|why| why == Unreached::ByNominal), "{found:?}");
}

fn run(folder: &TempDir, text: &str, more: &[&str]) -> Run {
    fs::write(folder.path().join("targets.csv"), text).expect("a file");
    let arguments = ["compensate", "--robot", "calibrated.toml", "--nominal", "puma560", "targets.csv"];
    host_cal_in(folder.path(), &[&arguments, more].concat())
}

#[test]
fn each_target_that_cannot_be_reached_is_named_with_its_line_and_the_others_are_written() {
    let folder = TempDir::new().expect("a temporary folder");
    write_calibrated(folder.path(), "puma560");
    let rows = "10,-40,160,20,-50,50\n# a comment\n159.99,-40,160,20,-50,50\n0,-45,135,0,30,0\n";
    let joints = run(&folder, &format!("{JOINTS}{rows}"), &["--out", "commands.csv"]);
    insta::assert_snapshot!("targets_beyond_limits", joints.transcript());
    insta::assert_snapshot!("commands_csv", fs::read_to_string(folder.path().join("commands.csv")).expect("a file"));
    let poses = run(&folder, &format!("{POSE}500,150,600,0,90,0\n9000,150,600,0,90,0\n"), &[]);
    insta::assert_snapshot!("poses_out_of_reach", poses.transcript());
    assert_eq!((joints.code, poses.code), (1, 1));
}

#[test]
fn a_posture_next_to_a_singular_one_is_warned_of() {
    let folder = TempDir::new().expect("a temporary folder");
    write_calibrated(folder.path(), "puma560");
    let straight = run(&folder, &format!("{JOINTS}0,-45,92,0,30,0\n"), &[]);
    assert!(straight.stderr.contains("targets.csv:2: joint 3 goes"), "{}", straight.transcript());
}

#[test]
fn a_pose_that_does_not_lead_back_to_the_joints_is_warned_of() {
    let folder = TempDir::new().expect("a temporary folder");
    write_calibrated(folder.path(), "puma560");
    // A bent wrist, and a nearly straight one that calibration turns far about axis 4.
    let rows = "0,-45,135,60,30,0\n0,-45,135,60,0.3,0\n0,-45,135,120,0.3,0\n";
    let run = run(&folder, &format!("{JOINTS}{rows}"), &["--json"]);
    let leads = |row: usize| run.json()["commands"][row]["pose_leads_to_q"].as_bool().expect("a truth");
    assert!(leads(0) && !leads(1) && !leads(2), "{}", run.transcript());
    assert!(run.stderr.contains("targets.csv:3: of 2 commands, this one the first"), "{}", run.transcript());
}

#[test]
fn targets_and_starts_that_make_no_sense_are_refused() {
    let folder = TempDir::new().expect("a temporary folder");
    write_calibrated(folder.path(), "puma560");
    for (text, more, says) in [
        ("x_mm,y_mm,z_mm,alpha_deg,beta_deg\n1,2,3,4,5\n", &[][..], "`gamma_deg` is missing"),
        ("line,x_mm\n1,2\n", &[], "unknown column `line`"),
        ("q1_deg,q2_deg\n1,2\n", &[], "2 joint columns, but the robot has 6"),
        ("# nothing\n", &[], "no targets"),
        (JOINTS, &[], "no targets"),
        ("", &[], "no targets"),
        ("q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n1,2,3,4,5,nan\n", &[], "`q6_deg` is nan"),
        (POSE, &["--start", "1,2"], "--start has 2 values"),
        (POSE, &["--start", "1,2,3,4,5,inf"], "--start is inf"),
    ] {
        let run = run(&folder, text, &[more, &["--out", "commands.csv"]].concat());
        assert_eq!(run.code, 2, "{text}: {}", run.transcript());
        assert!(run.stderr.contains(says), "{says}: {}", run.transcript());
        assert!(!folder.path().join("commands.csv").exists());
    }
}
