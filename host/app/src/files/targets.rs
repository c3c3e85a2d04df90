//! `targets.csv`: where a tool is to go, as joint vectors of a controller, as poses, or as both.

use ballbar::{JointKind, JointVector, Pose, Vector3};
use ballbar_calib::kinematics::{Compensation, Goal, from_link, link_angles};
use ballbar_calib::model::Robot;

use super::csv_rows::{CsvRows, Expected};
use super::numbers::Range as Of;
use super::poses::{csv_record, joint_column};
use super::source::{InputError, Source};
use crate::units::{ScreenUnit, fixed, m_from_mm, mm_from_m};

/// A row of a file of targets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Where the tool is to go.
    pub goal: Goal,
    /// Line in the file, from 1.
    pub line: usize,
}

const POSE: [&str; 6] = ["x_mm", "y_mm", "z_mm", "alpha_deg", "beta_deg", "gamma_deg"];
const MM_DECIMALS: usize = 6;
/// A turn of a nanodegree moves what is a metre away by less than a nanometre.
const DEG_DECIMALS: usize = 9;

/// Reads a file of targets: the robot's joint columns, or all six of `x_mm,y_mm,z_mm,alpha_deg,beta_deg,gamma_deg`, or both.
///
/// # Errors
/// [`InputError`] naming the line and the column that is wrong.
pub fn read_targets(source: &Source, robot: &Robot) -> Result<Vec<Target>, InputError> {
    const EXPECTED: Expected<'_> = Expected {
        rows_are: "targets",
        required: &[],
        optional: &POSE,
        joints_are_optional: true,
        header: "q1_deg,…,qJ_deg (qi_mm for a prismatic joint), or x_mm,y_mm,z_mm,alpha_deg,beta_deg,gamma_deg, or both",
    };
    let rows = CsvRows::split(source, robot, &EXPECTED)?;
    let has_pose = POSE.iter().any(|name| rows.optional(name).is_some());
    let pose = if has_pose { POSE.iter().map(|name| rows.required(name)).collect::<Result<Vec<_>, _>>()? } else { Vec::new() };
    // Of a header with neither, the joints are what is missed.
    let joints = if rows.has_joints() || !has_pose { rows.joints()? } else { Vec::new() };
    let mut targets = Vec::new();
    for record in rows.records() {
        let numbers: Vec<f64> =
            pose.iter().map(|&column| rows.number(record, column, Of::Plausible)).collect::<Result<_, _>>()?;
        let base_from_tool = match numbers[..] {
            [x, y, z, alpha, beta, gamma] => {
                Some(from_link(Vector3::new(x, y, z).map(m_from_mm), [alpha, beta, gamma].map(f64::to_radians)))
            }
            _ => None,
        };
        let goal = match base_from_tool {
            None => Goal::Joints(rows.joint_vector(record, &joints)?),
            Some(pose) if joints.is_empty() => Goal::Pose(pose, None),
            Some(pose) => Goal::Pose(pose, Some(rows.joint_vector(record, &joints)?)),
        };
        targets.push(Target { goal, line: rows.line(record) });
    }
    Ok(targets)
}

/// A pose as a file of commands has it: to the nanometre and the nanodegree.
pub fn pose_as_written(pose: &Pose<f64>) -> Pose<f64> {
    let rounded = |value: f64, decimals: i32| (value * 10_f64.powi(decimals)).round() / 10_f64.powi(decimals);
    let translation_m = pose.translation_m.map(|m| m_from_mm(rounded(mm_from_m(m), MM_DECIMALS as i32)));
    from_link(translation_m, link_angles(&pose.rotation).map(|rad| rounded(rad.to_degrees(), DEG_DECIMALS as i32).to_radians()))
}

/// Joints as a file of commands has them: to the nanodegree and the picometre.
pub fn joints_as_written(kinds: &[JointKind], mut q: JointVector<f64>) -> JointVector<f64> {
    const PER_UNIT: f64 = 1e9;
    for (value, &kind) in q.as_array_mut().iter_mut().zip(kinds) {
        let unit = ScreenUnit::from(kind);
        *value = unit.to_si((unit.from_si(*value) * PER_UNIT).round() / PER_UNIT);
    }
    q
}

/// Commands as a file: the target's line, joints to command, the pose that the controller believes to reach by them, and the
/// predicted errors.
pub fn compensated_csv(robot: &Robot, commands: &[(usize, Compensation)]) -> String {
    const ERRORS: [&str; 4] = ["before_mm", "before_deg", "left_mm", "left_deg"];
    let kinds = robot.chain.joint_kinds();
    let words = |words: &[&str]| words.iter().map(|&word| word.to_owned()).collect::<Vec<_>>();
    let joints = kinds.iter().enumerate().map(|(i, &kind)| joint_column(i, kind));
    let header = words(&["line"]).into_iter().chain(joints).chain(words(&POSE)).chain(words(&ERRORS));
    let mut text = csv_record(header) + "\n";
    for (line, found) in commands {
        let pose = &found.nominal_base_from_tool;
        let mut fields = vec![line.to_string()];
        fields.extend(kinds.iter().zip(found.q.as_array()).map(|(&kind, &q)| fixed(ScreenUnit::from(kind).from_si(q), 9)));
        fields.extend(pose.translation_m.iter().map(|&m| fixed(mm_from_m(m), MM_DECIMALS)));
        fields.extend(link_angles(&pose.rotation).iter().map(|angle| fixed(angle.to_degrees(), DEG_DECIMALS)));
        for (off_m, turned_rad) in [found.before, found.left] {
            fields.extend([fixed(mm_from_m(off_m), 6), fixed(turned_rad.to_degrees(), 6)]);
        }
        text += &(csv_record(fields.into_iter()) + "\n");
    }
    text
}
