//! Calibrated robots, and where the command says that their tools are, for tests of what is written for others.

use std::f64::consts::TAU;
use std::fs;
use std::path::Path;

use ballbar::{Chain, JointKind, PARAMETERS_PER_JOINT};
use ballbar_calib::model::{Calibration, CalibrationVerdict, Robot};
use host_cal::files::{calibrated_toml, open_robot, parse_robot, robot_source};
use nalgebra::Matrix4;
use num_complex::Complex;

use crate::command::host_cal_in;
use crate::naive;

/// A name that would end a comment, a quoted text, an element or a line wherever it is not written with care.
pub const HOSTILE_NAME: &str = "*/ --> \" ' <&> \\ ]]> ${x} \u{2028}- a: #{ =cmd() %% é";

/// Writes `calibrated.toml`: a built-in robot as a calibration leaves one, every parameter a little off its design, with a hostile name.
pub fn write_calibrated(folder: &Path, design: &str) -> Robot {
    let source = robot_source(design).expect("a built-in robot");
    let design = parse_robot(&source).expect("a built-in robot");
    let mut parameters = design.chain.parameters().to_vec();
    for (i, value) in parameters.iter_mut().enumerate() {
        // A millimetre and 0.06 degrees, up and down.
        *value += 1e-3 * (1.0 + 2.4 * i as f64).sin();
    }
    let chain = Chain::new(design.chain.joint_kinds(), &parameters).expect("a chain");
    let calibration = Calibration {
        when: "2025-01-01T00:00:00Z".into(),
        by: "a test".into(),
        verdict: Some(CalibrationVerdict::Calibrated),
        reasons: Vec::new(),
        from_robot: "design.toml".into(),
        from_poses: vec!["poses.csv".into()],
        poses: 100,
        free_parameters: 36,
        rms_initial_mm: 3.0,
        rms_mm: 0.1,
        held_out_rms_mm: None,
    };
    let text = calibrated_toml(&source, &chain, &design.terms, &calibration).expect("a robot's text");
    // What JSON quotes TOML quotes alike.
    let name = serde_json::to_string(HOSTILE_NAME).expect("a text");
    let named = |line: &str| if line.starts_with("name =") { format!("name = {name}\n") } else { format!("{line}\n") };
    let text: String = text.lines().map(named).collect();
    let path = folder.join("calibrated.toml");
    fs::write(&path, text).expect("a file");
    let robot = open_robot(&path.display().to_string()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(robot.name, HOSTILE_NAME);
    robot
}

/// Joint vectors over the limits, radians and metres; no two joints go alike.
pub fn joint_vectors(robot: &Robot, count: usize) -> Vec<Vec<f64>> {
    let share = |step: usize, joint: usize| (0.137 + step as f64 / count as f64 + 0.618 * joint as f64).fract();
    let joints =
        |step| robot.limits.iter().enumerate().map(move |(i, limits)| limits.min + (limits.max - limits.min) * share(step, i));
    (0..count).map(|step| joints(step).collect()).collect()
}

/// The tool's pose, metres, as `host-cal fk` says it.
pub fn pose_by_command(folder: &Path, robot_file: &str, robot: &Robot, q: &[f64]) -> Matrix4<f64> {
    let on_screen = |(&kind, &q): (&JointKind, &f64)| match kind {
        JointKind::Revolute => q * 360.0 / TAU,
        JointKind::Prismatic => q * 1e3,
    };
    let words: Vec<String> = robot.chain.joint_kinds().iter().zip(q).map(|pair| format!("{:?}", on_screen(pair))).collect();
    let run = host_cal_in(folder, &["fk", "--robot", robot_file, "--q", &words.join(","), "--json"]);
    assert_eq!(run.code, 0, "{}", run.transcript());
    let document = run.json();
    let mut pose = Matrix4::identity();
    for i in 0..3 {
        pose[(i, 3)] = document["position_mm"][i].as_f64().expect("a number") / 1e3;
        for j in 0..3 {
            pose[(i, j)] = document["rotation"][i][j].as_f64().expect("a number");
        }
    }
    pose
}

/// The tool's pose, metres, by complex 4×4 products of the file's parameters.
pub fn pose_by_products(robot: &Robot, q: &[f64]) -> Matrix4<f64> {
    let parameters: Vec<Complex<f64>> = robot.chain.parameters().iter().map(|&value| value.into()).collect();
    assert!(q.len() >= robot.chain.joints() && parameters.len() == robot.chain.joints() * PARAMETERS_PER_JOINT + 6);
    naive::base_from_tool(robot.chain.joint_kinds(), &parameters, q).map(|entry| entry.re)
}
