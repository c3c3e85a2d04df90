//! `targets.csv`: where a tool is to go, as joint vectors of a controller, with or without a pose beside them.

use ballbar::{JointVector, Pose, Vector3};

use super::csv_rows::CsvRows;
use super::numbers::Range as Of;
use super::poses::{csv_record, joint_column};
use super::rig::Rig;
use super::robot::Robot;
use super::solids::Solids;
use super::source::{InputError, Source};
use crate::kinematics::{Compensation, from_link, link_angles};
use crate::units::{ScreenUnit, m_from_mm, mm_from_m};

/// A row of a file of targets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Joints that the controller would go to, radians or metres.
    pub q: JointVector<f64>,
    /// Pose of the tool in the base frame, where the file gives one.
    pub base_from_tool: Option<Pose<f64>>,
    /// Line in the file, from 1.
    pub line: usize,
}

const POSE: [&str; 6] = ["x_mm", "y_mm", "z_mm", "alpha_deg", "beta_deg", "gamma_deg"];

/// Reads a file of targets: the robot's joint columns, and for poses all six of `x_mm,y_mm,z_mm,alpha_deg,beta_deg,gamma_deg`.
///
/// # Errors
/// [`InputError`] naming the line and the column that is wrong.
pub fn read_targets(source: &Source, robot: &Robot) -> Result<Vec<Target>, InputError> {
    const HEADER: &str =
        "q1_deg,…,qJ_deg (qi_mm for a prismatic joint), and for poses x_mm,y_mm,z_mm,alpha_deg,beta_deg,gamma_deg";
    // Targets have to do with no chuck and no sphere.
    let rig = Rig { chucks: Vec::new(), spheres: Vec::new(), bar: None, solids: Solids::default() };
    let rows = CsvRows::split(source, robot, &rig, &[], &POSE, HEADER)?;
    let joints = rows.joints()?;
    let has_pose = POSE.iter().any(|name| rows.optional(name).is_some());
    let pose_columns =
        if has_pose { POSE.iter().map(|name| rows.required(name)).collect::<Result<Vec<_>, _>>()? } else { Vec::new() };
    let mut targets = Vec::new();
    for record in rows.records() {
        let numbers: Vec<f64> =
            pose_columns.iter().map(|&column| rows.number(record, column, Of::Plausible)).collect::<Result<_, _>>()?;
        let base_from_tool = match numbers[..] {
            [x, y, z, alpha, beta, gamma] => {
                Some(from_link(Vector3::new(x, y, z).map(m_from_mm), [alpha, beta, gamma].map(f64::to_radians)))
            }
            _ => None,
        };
        targets.push(Target { q: rows.joint_vector(record, &joints)?, base_from_tool, line: rows.line(record) });
    }
    Ok(targets)
}

/// Commands as a file: joints to command, the pose that the controller believes to reach by them, and the predicted errors.
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
        fields
            .extend(kinds.iter().zip(found.q.as_array()).map(|(&kind, &q)| format!("{:.9}", ScreenUnit::from(kind).from_si(q))));
        fields.extend(pose.translation_m.iter().map(|&m| format!("{:.6}", mm_from_m(m))));
        fields.extend(link_angles(&pose.rotation).iter().map(|angle| format!("{:.6}", angle.to_degrees())));
        for (off_m, turned_rad) in [found.before, found.left] {
            fields.extend([format!("{:.6}", mm_from_m(off_m)), format!("{:.6}", turned_rad.to_degrees())]);
        }
        text += &(csv_record(fields.into_iter()) + "\n");
    }
    text
}
