//! A chain as source code: C, Rust, and MATLAB or Octave. Metres and radians.

use std::fmt::Write;

use ballbar::JointKind;
use ballbar_calib::model::Robot;

use super::{model_lines, origin};

/// Six numbers a link: x, y, z, alpha, beta, gamma.
fn links(robot: &Robot) -> Vec<[f64; 6]> {
    let links = (0..=robot.chain.joints()).filter_map(|i| robot.chain.link(i));
    let numbers = links.map(|link| {
        let [x, y, z]: [f64; 3] = link.translation_m.into();
        [x, y, z, link.alpha_rad, link.beta_rad, link.gamma_rad]
    });
    numbers.collect()
}

/// Whether a joint slides, its offset and its scale.
fn joints(robot: &Robot) -> Vec<(bool, f64, f64)> {
    let joints = (0..robot.chain.joints()).filter_map(|i| robot.chain.joint(i));
    joints.map(|joint| (joint.kind == JointKind::Prismatic, joint.offset, joint.scale)).collect()
}

fn commas(numbers: &[f64]) -> String {
    numbers.iter().map(|number| format!("{number:?}")).collect::<Vec<_>>().join(", ")
}

pub(super) fn c_header(robot: &Robot) -> String {
    let mut text = format!("/* {}\n   Metres and radians.\n{} */\n", origin(robot), model_lines("   ").trim_end());
    text += "#ifndef ROBOT_KINEMATICS_H\n#define ROBOT_KINEMATICS_H\n\n";
    let count = robot.chain.joints();
    let _ = writeln!(text, "#define ROBOT_JOINTS {count}\n");
    text += "/* float where the processor has no double */\n#ifndef ROBOT_REAL\n#define ROBOT_REAL double\n#endif\n\n";
    text += "/* x, y, z, alpha, beta, gamma of each link */\nstatic const ROBOT_REAL ROBOT_LINKS[ROBOT_JOINTS + 1][6] = {\n";
    for link in links(robot) {
        let _ = writeln!(text, "    {{{}}},", commas(&link));
    }
    text += "};\n\n/* 1 where the joint slides, 0 where it turns */\nstatic const int ROBOT_IS_PRISMATIC[ROBOT_JOINTS] = {";
    text += &joints(robot).iter().map(|joint| u8::from(joint.0).to_string()).collect::<Vec<_>>().join(", ");
    text += "};\n\n/* offset, scale of each joint */\nstatic const ROBOT_REAL ROBOT_ENCODERS[ROBOT_JOINTS][2] = {\n";
    for (_, offset, scale) in joints(robot) {
        let _ = writeln!(text, "    {{{}}},", commas(&[offset, scale]));
    }
    text + "};\n\n#endif\n"
}

/// What looks like a well-known number is a parameter of the robot.
const PRECISE: &str = "#[allow(clippy::approx_constant, clippy::excessive_precision, clippy::unreadable_literal)]";

pub(super) fn rust_constants(robot: &Robot) -> String {
    let mut text = format!("// {}\n// Metres and radians.\n{}\n", origin(robot), model_lines("// "));
    let count = robot.chain.joints();
    let _ = writeln!(
        text,
        "/// x, y, z, alpha, beta, gamma of each link.\n{PRECISE}\npub const LINKS: [[f64; 6]; {}] = [",
        count + 1
    );
    for link in links(robot) {
        let _ = writeln!(text, "    [{}],", commas(&link));
    }
    text += "];\n\n/// Whether a joint slides rather than turns.\n";
    let slides = joints(robot).iter().map(|joint| joint.0.to_string()).collect::<Vec<_>>().join(", ");
    let _ = writeln!(text, "pub const IS_PRISMATIC: [bool; {count}] = [{slides}];\n");
    let _ = writeln!(text, "/// Offset and scale of each joint.\n{PRECISE}\npub const ENCODERS: [[f64; 2]; {count}] = [");
    for (_, offset, scale) in joints(robot) {
        let _ = writeln!(text, "    [{}],", commas(&[offset, scale]));
    }
    text + "];\n"
}

pub(super) fn octave_function(robot: &Robot) -> String {
    let mut text = String::from("function T = robot_pose(q)\n");
    let _ = writeln!(
        text,
        "% Pose of the tool in the base frame, 4 by 4, at encoder outputs q; metres and radians.\n% {}\n{}",
        origin(robot),
        model_lines("% ").trim_end()
    );
    text += "links = [\n";
    for link in links(robot) {
        let _ = writeln!(text, "  {}", commas(&link));
    }
    text += "];\n% 1 where the joint slides, offset, scale\njoints = [\n";
    for (slides, offset, scale) in joints(robot) {
        let _ = writeln!(text, "  {}, {}", u8::from(slides), commas(&[offset, scale]));
    }
    text += "];\nT = eye(4);\nfor i = 1:size(links, 1)\n  T = T * link_transform(links(i, :));\n  if i <= size(joints, 1)\n";
    text += "    theta = joints(i, 2) + joints(i, 3) * q(i);\n    if joints(i, 1)\n      T = T * link_transform([0, 0, theta, 0, 0, 0]);\n";
    text += "    else\n      T = T * link_transform([0, 0, 0, theta, 0, 0]);\n    end\n  end\nend\nend\n\n";
    text += "function T = link_transform(p)\nca = cos(p(4)); sa = sin(p(4)); cb = cos(p(5)); sb = sin(p(5)); cg = cos(p(6)); sg = sin(p(6));\n";
    text += "Rz = [ca, -sa, 0; sa, ca, 0; 0, 0, 1];\nRy = [cb, 0, sb; 0, 1, 0; -sb, 0, cb];\nRx = [1, 0, 0; 0, cg, -sg; 0, sg, cg];\n";
    text + "T = [Rz * Ry * Rx, p(1:3)'; 0, 0, 0, 1];\nend\n"
}
