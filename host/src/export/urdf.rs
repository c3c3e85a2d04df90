//! URDF: a link is an `origin` with `rpy` = gamma, beta, alpha, and its joint turns about z or slides along it.
//!
//! The value of a URDF joint is θ = offset + scale · q. URDF has no place for offset and scale: they stand in an element of our own
//! within each joint, which `host-cal import` reads and others pass over.

use std::fmt::Write;

use ballbar::{Joint, JointKind};

use super::origin;
use crate::files::{ENCODER_ELEMENT, JointLimits, Robot};

/// The robot as a URDF.
pub(super) fn text(robot: &Robot) -> String {
    let mut text = String::from("<?xml version=\"1.0\"?>\n");
    // A comment may not hold two hyphens.
    let _ = writeln!(text, "<!-- {} -->", origin(robot).replace("--", "__"));
    let _ = writeln!(text, "<!-- A joint's value is offset + scale * encoder output; see {ENCODER_ELEMENT}. -->");
    let _ = writeln!(text, "<robot name=\"{}\">", attribute(&robot.name));
    let joints = robot.chain.joints();
    for link in 0..=joints + 1 {
        let _ = writeln!(text, "  <link name=\"{}\"/>", link_name(link, joints));
    }
    for i in 0..=joints {
        let Some(link) = robot.chain.link(i) else { continue };
        let joint = robot.chain.joint(i);
        let (name, kind) = match joint {
            Some(Joint { kind: JointKind::Revolute, .. }) => (format!("joint_{}", i + 1), "revolute"),
            Some(Joint { kind: JointKind::Prismatic, .. }) => (format!("joint_{}", i + 1), "prismatic"),
            None => ("tool_mount".to_owned(), "fixed"),
        };
        let [x, y, z]: [f64; 3] = link.translation_m.into();
        let _ = writeln!(text, "  <joint name=\"{name}\" type=\"{kind}\">");
        let _ = writeln!(text, "    <parent link=\"{}\"/>", link_name(i, joints));
        let _ = writeln!(text, "    <child link=\"{}\"/>", link_name(i + 1, joints));
        let (roll, pitch, yaw) = (link.gamma_rad, link.beta_rad, link.alpha_rad);
        let _ = writeln!(text, "    <origin xyz=\"{x:?} {y:?} {z:?}\" rpy=\"{roll:?} {pitch:?} {yaw:?}\"/>");
        if let (Some(joint), Some(limits)) = (joint, robot.limits.get(i)) {
            let (lower, upper) = joint_limits(&joint, limits);
            let _ = writeln!(text, "    <axis xyz=\"0 0 1\"/>");
            let _ = writeln!(text, "    <limit lower=\"{lower:?}\" upper=\"{upper:?}\" effort=\"0\" velocity=\"0\"/>");
            let _ = writeln!(text, "    <{ENCODER_ELEMENT} offset=\"{:?}\" scale=\"{:?}\"/>", joint.offset, joint.scale);
        }
        let _ = writeln!(text, "  </joint>");
    }
    text + "</robot>\n"
}

/// A ROS 2 parameter file, for every node: the URDF as `robot_description`.
pub(super) fn ros2_parameters(robot: &Robot) -> String {
    let mut parameters = String::from("/**:\n  ros__parameters:\n    robot_description: |\n");
    for line in text(robot).lines() {
        let _ = writeln!(parameters, "      {line}");
    }
    parameters
}

/// What a user of the URDF should know.
pub(super) fn remarks(robot: &Robot) -> Vec<String> {
    let joints = (0..robot.chain.joints()).filter_map(|i| robot.chain.joint(i));
    let moved: Vec<String> = joints
        .enumerate()
        .filter(|(_, joint)| joint.offset != 0.0 || joint.scale != 1.0)
        .map(|(i, _)| format!("joint_{}", i + 1))
        .collect();
    let mut remarks =
        vec!["effort and velocity limits are not known here and stand as 0: set them before a planner reads them".to_owned()];
    if !moved.is_empty() {
        remarks.push(format!(
            "URDF holds no joint offset and scale: they are in <{ENCODER_ELEMENT}> of {}; publish offset + scale * encoder output as these \
             joints' values",
            moved.join(", ")
        ));
    }
    if robot.encoders.iter().any(|facts| facts.encoder.is_some() || !facts.couplings.is_empty()) {
        remarks.push("encoder counts and couplings are not in it; keep the robot file".to_owned());
    }
    remarks
}

/// Limits of θ.
fn joint_limits(joint: &Joint<f64>, limits: &JointLimits) -> (f64, f64) {
    let [a, b] = [limits.min, limits.max].map(|q| joint.offset + joint.scale * q);
    (a.min(b), a.max(b))
}

fn link_name(link: usize, joints: usize) -> String {
    match link {
        0 => "base".to_owned(),
        link if link == joints + 1 => "tool".to_owned(),
        link => format!("link_{link}"),
    }
}

/// A text as an XML attribute; what XML cannot hold becomes `_`, and what is longer than a reader takes is cut.
fn attribute(text: &str) -> String {
    let text = if text.is_empty() { "robot" } else { text };
    let escaped = text.chars().take(40).map(|c| match c {
        '&' => "&amp;".to_owned(),
        '<' => "&lt;".to_owned(),
        '>' => "&gt;".to_owned(),
        '"' => "&quot;".to_owned(),
        c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => "_".to_owned(),
        c => c.to_string(),
    });
    escaped.collect()
}
