//! Which of a robot's range the poses have measured: beyond it, a fit extrapolates.

use std::f64::consts::TAU;

use ballbar::JointKind;

use crate::model::{Dataset, JointLimits, Robot};
use crate::units::{fixed, mm_from_m};

/// Joints that were measured in a smaller part of their range are said.
const NARROW: f64 = 0.2;

/// A sentence that names all joints that were measured in a small part of their range (or turn, where that is more than one).
pub(super) fn narrow_joints(robot: &Robot, dataset: &Dataset) -> Option<String> {
    let kinds = robot.chain.joint_kinds();
    let narrow = |(i, (limits, &kind)): (usize, (&JointLimits, &JointKind))| {
        let values = dataset.rows.iter().map(|row| row.measurement.q.as_array()[i]);
        let (least, most) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), q| (least.min(q), most.max(q)));
        let turn = if kind == JointKind::Revolute { TAU } else { f64::INFINITY };
        let range = (limits.max - limits.min).min(turn);
        let shown = |value: f64| match kind {
            JointKind::Revolute => format!("{}°", fixed(value.to_degrees(), 0)),
            JointKind::Prismatic => format!("{} mm", fixed(mm_from_m(value), 0)),
        };
        let [least_shown, most_shown, min, max] = [least, most, limits.min, limits.max].map(shown);
        (most - least < NARROW * range).then(|| format!("joint {} from {least_shown} to {most_shown} of {min} to {max}", i + 1))
    };
    let joints: Vec<String> = robot.limits.iter().zip(kinds).enumerate().filter_map(narrow).collect();
    (!joints.is_empty()).then(|| {
        format!(
            "Joints were measured in less than a fifth of their range: {}. What the fit says beyond is extrapolation.",
            joints.join(", ")
        )
    })
}
