//! Denavit-Hartenberg tables as CSV, millimetres and degrees.

use std::fmt::Write;

use ballbar::{JointKind, Pose, Vector3};
use ballbar_calib::kinematics::{Convention, DhRow, DhTable, from_link, link_angles};
use ballbar_calib::model::Robot;

use super::{Exported, origin};
use crate::units::{ScreenUnit, m_from_mm, mm_from_m, without_noise};

/// The table, how far it is from the robot, and where and why its values run away.
pub(super) fn exported(robot: &Robot, convention: Convention) -> Exported {
    let table = as_written(DhTable::new(&robot.chain, convention));
    let difference = table.largest_difference(&robot.chain, &robot.limits);
    let remarks = table.nearly_parallel.iter().map(|pair| {
        let (first, second) = (pair.joint, pair.joint + 1);
        let largest_m = [first, second].iter().filter_map(|&i| table.rows.get(i - 1)).fold(0.0_f64, |d_m, row| d_m.max(row.d_m.abs()));
        format!(
            "axes {first} and {second} are {} degrees from parallel, so their common normal is far away and d{first} and d{second} are \
             large (up to {:.1} mm). That is no fault of the calibration but of Denavit-Hartenberg tables: a URDF has no such values",
            angle_text(pair.angle_rad.to_degrees()),
            mm_from_m(largest_m)
        )
    });
    let remarks: Vec<String> = remarks.collect();
    let text = text(robot, &table, difference, &remarks);
    Exported { text, remarks, largest_difference: Some(difference), nearly_parallel: table.nearly_parallel }
}

/// Four decimals, or as many as show the number.
fn angle_text(deg: f64) -> String {
    /// What four decimals show as zero.
    const LEAST_DEG: f64 = 5e-5;
    if deg < LEAST_DEG { format!("{deg:.1e}") } else { format!("{deg:.4}") }
}

/// What a reader of the text gets: the difference to the robot is that of the file.
fn as_written(mut table: DhTable) -> DhTable {
    let by = |unit: ScreenUnit, value: f64| unit.to_si(without_noise(unit.from_si(value)));
    let (mm, deg) = (|m: f64| by(ScreenUnit::Millimetre, m), |rad: f64| by(ScreenUnit::Degree, rad));
    for row in &mut table.rows {
        let (theta_rad, alpha_rad) = (deg(row.theta_rad), deg(row.alpha_rad));
        *row = DhRow { theta_rad, alpha_rad, d_m: mm(row.d_m), a_m: mm(row.a_m), ..*row };
    }
    for pose in [&mut table.base_from_first, &mut table.last_from_tool] {
        let (translation_mm, angles_deg) = screen(pose);
        *pose = from_link(Vector3::from(translation_mm).map(m_from_mm), angles_deg.map(f64::to_radians));
    }
    table
}

/// Translation in millimetres, and alpha, beta, gamma in degrees.
fn screen(pose: &Pose<f64>) -> ([f64; 3], [f64; 3]) {
    let translation_mm = pose.translation_m.map(|m| without_noise(mm_from_m(m)));
    (translation_mm.into(), link_angles(&pose.rotation).map(|angle| without_noise(angle.to_degrees())))
}

fn text(robot: &Robot, table: &DhTable, (off_m, turned_rad): (f64, f64), remarks: &[String]) -> String {
    let (rows_are, columns) = match table.convention {
        Convention::Standard => {
            ("Rz(theta) Trans_z(d) Trans_x(a) Rx(alpha), a and alpha of the same row", "theta_deg,d_mm,a_mm,alpha_deg")
        }
        Convention::Modified => (
            "Rx(alpha) Trans_x(a) Rz(theta) Trans_z(d), a and alpha of the row before in Craig's numbering",
            "alpha_deg,a_mm,theta_deg,d_mm",
        ),
    };
    let mut text = format!("# {}\n# tool in base = base * row 1 * ... * row J * tool; a row is {rows_are}.\n", origin(robot));
    text += "# scale * encoder output is added to theta (revolute) or d (prismatic).\n";
    let (off_mm, turned_deg) = (mm_from_m(off_m), turned_rad.to_degrees());
    let _ = writeln!(text, "# Largest difference to the robot over random joint vectors: {off_mm:.1e} mm, {turned_deg:.1e} deg.");
    remarks.iter().for_each(|remark| text += &format!("# Note: {remark}.\n"));
    text += &transform_line("base", &table.base_from_first);
    text += &transform_line("tool", &table.last_from_tool);
    let _ = writeln!(text, "joint,type,{columns},scale");
    for (i, row) in table.rows.iter().enumerate() {
        let kind = match row.kind {
            JointKind::Revolute => "revolute",
            JointKind::Prismatic => "prismatic",
        };
        let [theta, alpha] = [row.theta_rad, row.alpha_rad].map(|angle| without_noise(angle.to_degrees()));
        let [d, a] = [row.d_m, row.a_m].map(|m| without_noise(mm_from_m(m)));
        let [first, second, third, fourth] = match table.convention {
            Convention::Standard => [theta, d, a, alpha],
            Convention::Modified => [alpha, a, theta, d],
        };
        let _ = writeln!(text, "{},{kind},{first:?},{second:?},{third:?},{fourth:?},{:?}", i + 1, row.scale);
    }
    text
}

fn transform_line(name: &str, pose: &Pose<f64>) -> String {
    let ([x, y, z], [alpha, beta, gamma]) = screen(pose);
    format!("# {name}: Trans({x:?}, {y:?}, {z:?}) mm * Rz({alpha:?}) Ry({beta:?}) Rx({gamma:?}) deg\n")
}
