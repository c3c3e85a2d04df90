//! URDF: a link is an `origin` with `rpy` = gamma, beta, alpha, and its joint turns about z or slides along it.
//!
//! The value of a URDF joint is θ = offset + scale · q. URDF has no place for offset and scale: they stand in an element of our own
//! within each joint, which `host-cal import` reads and others pass over. On request an offset goes into the joint's origin instead,
//! behind the link: `Rz(offset + scale · q) = Rz(offset) · Rz(scale · q)`, and alike for a slide.

use std::fmt::Write;

use ballbar::{Joint, JointKind, Link, Vector3};
use ballbar_calib::kinematics::{compose, from_link, link_angles};
use ballbar_calib::model::{JointLimits, Robot};

use super::{JointZero, origin};
use crate::files::{ENCODER_ELEMENT, MOST_NAME_BYTES};

/// The robot as a URDF.
pub(super) fn text(robot: &Robot, zero: JointZero) -> String {
    let mut text = String::from("<?xml version=\"1.0\"?>\n");
    // A comment may not hold two hyphens.
    let _ = writeln!(text, "<!-- {} -->", origin(robot).replace("--", "__"));
    let _ = writeln!(text, "<!-- A joint's value is offset + scale * encoder output; see {ENCODER_ELEMENT}. -->");
    let _ = writeln!(text, "<robot name=\"{}\">", escaped(urdf_name(&cleaned(&robot.name))));
    let joints = robot.chain.joints();
    for link in 0..=joints + 1 {
        let _ = writeln!(text, "  <link name=\"{}\"/>", link_name(link, joints));
    }
    for i in 0..=joints {
        let Some(link) = robot.chain.link(i) else { continue };
        let (link, joint) = match (robot.chain.joint(i), zero) {
            (Some(joint), JointZero::Encoder) => (moved(&link, &joint), Some(Joint { offset: 0.0, ..joint })),
            (joint, _) => (link, joint),
        };
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
pub(super) fn ros2_parameters(robot: &Robot, zero: JointZero) -> String {
    let mut parameters = String::from("/**:\n  ros__parameters:\n    robot_description: |\n");
    for line in text(robot, zero).lines() {
        let _ = writeln!(parameters, "      {line}");
    }
    parameters
}

/// What a user of the URDF should know.
pub(super) fn remarks(robot: &Robot, zero: JointZero) -> Vec<String> {
    let joints = (0..robot.chain.joints()).filter_map(|i| robot.chain.joint(i));
    let moved: Vec<String> = joints
        .enumerate()
        .filter(|(_, joint)| (joint.offset != 0.0 && zero == JointZero::Model) || joint.scale != 1.0)
        .map(|(i, _)| format!("joint_{}", i + 1))
        .collect();
    let mut remarks =
        vec!["effort and velocity limits are not known here and stand as 0: set them before a planner reads them".to_owned()];
    let name = cleaned(&robot.name);
    if urdf_name(&name) != name {
        remarks.push(format!("the robot's name is longer than the {MOST_NAME_BYTES} bytes that `import` takes, and cut there"));
    }
    if !moved.is_empty() {
        let (holds_no, value) = match zero {
            JointZero::Model => ("offset and scale: they are", "offset + scale * encoder output"),
            JointZero::Encoder => ("scale: it is", "scale * encoder output"),
        };
        remarks.push(format!(
            "URDF holds no joint {holds_no} in <{ENCODER_ELEMENT}> of {}; publish {value} as these joints' values",
            moved.join(", ")
        ));
    }
    if zero == JointZero::Model && (0..robot.chain.joints()).filter_map(|i| robot.chain.joint(i)).any(|joint| joint.offset != 0.0)
    {
        remarks.push(
            "with --joint-zero encoder the offsets are in the origins, and joint values begin at the encoders' zero".to_owned(),
        );
    }
    if robot.encoders.iter().any(|facts| facts.encoder.is_some() || !facts.couplings.is_empty()) {
        remarks.push("encoder counts and couplings are not in it; keep the robot file".to_owned());
    }
    remarks
}

/// A link with its joint's offset behind it.
fn moved(link: &Link<f64>, joint: &Joint<f64>) -> Link<f64> {
    let offset = match joint.kind {
        JointKind::Revolute => from_link(Vector3::zeros(), [joint.offset, 0.0, 0.0]),
        JointKind::Prismatic => from_link(Vector3::new(0.0, 0.0, joint.offset), [0.0; 3]),
    };
    let pose = compose(&from_link(link.translation_m, [link.alpha_rad, link.beta_rad, link.gamma_rad]), &offset);
    let [alpha_rad, beta_rad, gamma_rad] = link_angles(&pose.rotation);
    Link { translation_m: pose.translation_m, alpha_rad, beta_rad, gamma_rad }
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

/// A name with `_` for what XML cannot hold, and for `$`, with which xacro begins what it computes.
fn cleaned(name: &str) -> String {
    let is_replaced = |c: char| c.is_control() || matches!(c, '$' | '\u{fffe}' | '\u{ffff}');
    let cleaned: String = name.chars().map(|c| if is_replaced(c) { '_' } else { c }).collect();
    if cleaned.trim().is_empty() { "robot".to_owned() } else { cleaned }
}

/// As much of a name as a reader takes.
fn urdf_name(name: &str) -> &str {
    &name[..name.floor_char_boundary(MOST_NAME_BYTES)]
}

/// A text as an XML attribute. Whatever a parser of YAML might take for the end of a line is written by its number.
fn escaped(text: &str) -> String {
    let escaped = text.chars().map(|c| match c {
        '&' => "&amp;".to_owned(),
        '<' => "&lt;".to_owned(),
        '>' => "&gt;".to_owned(),
        '"' => "&quot;".to_owned(),
        c if c.is_ascii() || c.is_alphanumeric() => c.to_string(),
        c => format!("&#x{:x};", u32::from(c)),
    });
    escaped.collect()
}
