//! JSON, YAML and CSV of a chain's parameters.

use std::fmt::Write;

use ballbar::{JointKind, Parameter};
use ballbar_calib::model::{JointLimits, JointTolerance, LinkTolerance, Robot};
use serde::Serialize;

use super::{MODEL, model_lines, origin};
use crate::units::{ScreenUnit, as_in_a_file};

/// A robot for JSON and YAML, metres and radians.
#[derive(Serialize)]
struct RobotData<'a> {
    name: &'a str,
    is_calibrated: bool,
    model: &'static str,
    links: Vec<LinkData>,
    joints: Vec<JointData>,
}

#[derive(Serialize)]
struct LinkData {
    translation_m: [f64; 3],
    alpha_rad: f64,
    beta_rad: f64,
    gamma_rad: f64,
    /// Of each coordinate of the translation.
    tolerance_m: f64,
    /// Of each component of the rotation vector.
    tolerance_rad: f64,
}

#[derive(Serialize)]
struct JointData {
    #[serde(rename = "type")]
    kind: &'static str,
    /// Of offset, its tolerance and limits.
    unit: &'static str,
    offset: f64,
    scale: f64,
    offset_tolerance: f64,
    scale_tolerance: f64,
    min: f64,
    max: f64,
}

impl<'a> RobotData<'a> {
    fn new(robot: &'a Robot) -> Self {
        let chain = &robot.chain;
        let link = |(link, tolerance): (ballbar::Link<f64>, &LinkTolerance)| LinkData {
            translation_m: link.translation_m.into(),
            alpha_rad: link.alpha_rad,
            beta_rad: link.beta_rad,
            gamma_rad: link.gamma_rad,
            tolerance_m: tolerance.displacement_m,
            tolerance_rad: tolerance.rotation_rad,
        };
        let joint = |((joint, limits), tolerance): ((ballbar::Joint<f64>, &JointLimits), &JointTolerance)| {
            let (kind, unit) = match joint.kind {
                JointKind::Revolute => ("revolute", "rad"),
                JointKind::Prismatic => ("prismatic", "m"),
            };
            JointData {
                kind,
                unit,
                offset: joint.offset,
                scale: joint.scale,
                offset_tolerance: tolerance.offset,
                scale_tolerance: tolerance.scale,
                min: limits.min,
                max: limits.max,
            }
        };
        let links = (0..=chain.joints()).filter_map(|i| chain.link(i)).zip(&robot.tolerances.links);
        let joints = (0..chain.joints()).filter_map(|i| chain.joint(i)).zip(&robot.limits).zip(&robot.tolerances.joints);
        Self {
            name: &robot.name,
            is_calibrated: robot.standing().is_calibrated(),
            model: MODEL,
            links: links.map(link).collect(),
            joints: joints.map(joint).collect(),
        }
    }
}

pub(super) fn json(robot: &Robot) -> Result<String, serde_json::Error> {
    Ok(serde_json::to_string_pretty(&RobotData::new(robot))? + "\n")
}

/// YAML in blocks.
pub(super) fn yaml(robot: &Robot) -> String {
    let data = RobotData::new(robot);
    let mut text = format!("name: {}\n", quoted(data.name));
    let _ = writeln!(text, "is_calibrated: {}\nmodel: {}\nlinks:", data.is_calibrated, quoted(data.model));
    for link in &data.links {
        let _ = writeln!(text, "  - translation_m: [{}]", link.translation_m.map(yaml_number).join(", "));
        for (key, value) in [
            ("alpha_rad", link.alpha_rad),
            ("beta_rad", link.beta_rad),
            ("gamma_rad", link.gamma_rad),
            ("tolerance_m", link.tolerance_m),
            ("tolerance_rad", link.tolerance_rad),
        ] {
            let _ = writeln!(text, "    {key}: {}", yaml_number(value));
        }
    }
    text += "joints:\n";
    for joint in &data.joints {
        let _ = writeln!(text, "  - type: {}\n    unit: {}", joint.kind, joint.unit);
        for (key, value) in [
            ("offset", joint.offset),
            ("scale", joint.scale),
            ("offset_tolerance", joint.offset_tolerance),
            ("scale_tolerance", joint.scale_tolerance),
            ("min", joint.min),
            ("max", joint.max),
        ] {
            let _ = writeln!(text, "    {key}: {}", yaml_number(value));
        }
    }
    text
}

/// With a point even before an exponent: YAML 1.1 reads `1e-17` as a text.
fn yaml_number(value: f64) -> String {
    let text = format!("{value:?}");
    if text.contains('.') { text } else { text.replacen('e', ".0e", 1) }
}

/// A text in double quotes. YAML takes fewer characters as they are than JSON does, and more of them as ends of a line.
fn quoted(text: &str) -> String {
    let escaped = text.chars().map(|c| match c {
        '"' | '\\' => format!("\\{c}"),
        c if c == ' ' || c.is_ascii_graphic() || c.is_alphanumeric() => c.to_string(),
        c => format!("\\U{:08x}", u32::from(c)),
    });
    format!("\"{}\"", escaped.collect::<String>())
}

/// Parameters, and the limits of each joint's encoder output.
pub(super) fn csv(robot: &Robot) -> String {
    let mut text = format!("# {}\n{}parameter,unit,value\n", origin(robot), model_lines("# "));
    for (i, &value) in robot.chain.parameters().iter().enumerate() {
        let parameter = Parameter::from_index(i);
        let unit = ScreenUnit::from(robot.chain.unit(parameter));
        let _ = writeln!(text, "{parameter},{},{:?}", unit.name(), as_in_a_file(unit, value));
    }
    for (i, (limits, &kind)) in robot.limits.iter().zip(robot.chain.joint_kinds()).enumerate() {
        let unit = ScreenUnit::from(kind);
        for (name, value) in [("min", limits.min), ("max", limits.max)] {
            let _ = writeln!(text, "{name}{},{},{:?}", i + 1, unit.name(), as_in_a_file(unit, value));
        }
    }
    text
}
