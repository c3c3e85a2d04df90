//! Writing `poses.csv`: measured lengths and where the robot stood. `read_poses.rs` reads it.

use ballbar::{Approach, JointKind, JointVector, Measurement};
use ballbar_calib::model::{PoseRow, Rig, Robot};

use crate::units::{ScreenUnit, mm_from_m};

/// The text of a file of poses; columns as the robot's joints need them.
pub fn write_poses(robot: &Robot, rig: &Rig, rows: &[PoseRow]) -> String {
    let kinds = robot.chain.joint_kinds();
    let has_set = rows.iter().any(|row| row.set.is_some());
    let has_approach = rows.iter().any(|row| row.approach != Approach::UNKNOWN);
    let optional =
        [(has_approach, "approach"), (has_set, "set")].into_iter().filter_map(|(is_there, name)| is_there.then_some(name));
    let mut text = pose_header(kinds, &optional.collect::<Vec<_>>()) + "\n";
    for row in rows {
        let (chuck, sphere) = (&rig.chucks[row.pairing.chuck].name, &rig.spheres[row.pairing.sphere].name);
        let approach = has_approach.then(|| approach_text(row.approach, kinds.len()));
        let set = has_set.then(|| row.set.clone().unwrap_or_default());
        let optional: Vec<String> = approach.into_iter().chain(set).collect();
        let Measurement { q, length_m, .. } = &row.measurement;
        text += &(pose_record(chuck, sphere, kinds, q, *length_m, &optional) + "\n");
    }
    text
}

/// One of `+`, `-` and `0` for each joint; empty where nothing is known.
pub fn approach_text(approach: Approach, joints: usize) -> String {
    if approach == Approach::UNKNOWN { String::new() } else { approach.signs(joints).to_string() }
}

/// The first line of a file of poses, with optional columns at its end.
pub fn pose_header(kinds: &[JointKind], optional: &[&str]) -> String {
    let joints = kinds.iter().enumerate().map(|(i, &kind)| joint_column(i, kind));
    let columns = ["chuck", "sphere"].map(str::to_owned).into_iter().chain(joints).chain(["length_mm".to_owned()]);
    csv_record(columns.chain(optional.iter().map(|&column| column.to_owned())))
}

/// One line of a file of poses, without its end, with the fields of the optional columns.
pub fn pose_record(
    chuck: &str,
    sphere: &str,
    kinds: &[JointKind],
    q: &JointVector<f64>,
    length_m: f64,
    optional: &[String],
) -> String {
    // Nanometres and nanodegrees: far below any encoder, and short enough to read.
    let joints = kinds.iter().zip(q.as_array()).map(|(&kind, &q)| format!("{:.9}", ScreenUnit::from(kind).from_si(q)));
    let length = format!("{:.6}", mm_from_m(length_m));
    let fields = [chuck, sphere].map(str::to_owned).into_iter().chain(joints).chain([length]);
    csv_record(fields.chain(optional.iter().cloned()))
}

pub(super) fn csv_record(fields: impl Iterator<Item = String>) -> String {
    let mut writer = csv::WriterBuilder::new().terminator(csv::Terminator::Any(b'\n')).from_writer(Vec::new());
    // Writing to memory cannot fail.
    let _ = writer.write_record(fields.collect::<Vec<_>>());
    let text = String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default();
    text.trim_end_matches('\n').to_owned()
}

/// Name of a joint's column: `q1_deg`, `q3_mm`.
pub(super) fn joint_column(index: usize, kind: JointKind) -> String {
    format!("q{}_{}", index + 1, ScreenUnit::from(kind).name())
}
