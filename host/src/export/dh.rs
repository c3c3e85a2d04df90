//! Denavit-Hartenberg tables as CSV, millimetres and degrees.

use std::fmt::Write;

use ballbar::{JointKind, Pose};

use super::{Exported, origin};
use crate::files::Robot;
use crate::kinematics::{Convention, DhTable, link_angles};
use crate::units::mm_from_m;

/// The table, how far it is from the robot, and where and why its values run away.
pub(super) fn exported(robot: &Robot, convention: Convention) -> Exported {
    let table = DhTable::new(&robot.chain, convention);
    let difference = table.largest_difference(&robot.chain, &robot.limits);
    let remarks = table.nearly_parallel.iter().map(|pair| {
        let (first, second) = (pair.joint, pair.joint + 1);
        let largest_m = [first, second].iter().filter_map(|&i| table.rows.get(i - 1)).fold(0.0_f64, |d_m, row| d_m.max(row.d_m.abs()));
        format!(
            "axes {first} and {second} are {:.4} degrees from parallel, so their common normal is far away and d{first} and d{second} are \
             large (up to {:.1} mm). That is no fault of the calibration but of Denavit-Hartenberg tables: a URDF has no such values",
            pair.angle_rad.to_degrees(),
            mm_from_m(largest_m)
        )
    });
    Exported { text: text(robot, &table, difference), remarks: remarks.collect(), largest_difference: Some(difference) }
}

fn text(robot: &Robot, table: &DhTable, (off_m, turned_rad): (f64, f64)) -> String {
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
    text += &transform_line("base", &table.base_from_first);
    text += &transform_line("tool", &table.last_from_tool);
    let _ = writeln!(text, "joint,type,{columns},scale");
    for (i, row) in table.rows.iter().enumerate() {
        let kind = match row.kind {
            JointKind::Revolute => "revolute",
            JointKind::Prismatic => "prismatic",
        };
        let (theta, d, a, alpha) =
            (row.theta_rad.to_degrees(), mm_from_m(row.d_m), mm_from_m(row.a_m), row.alpha_rad.to_degrees());
        let [first, second, third, fourth] = match table.convention {
            Convention::Standard => [theta, d, a, alpha],
            Convention::Modified => [alpha, a, theta, d],
        };
        let _ = writeln!(text, "{},{kind},{first:?},{second:?},{third:?},{fourth:?},{:?}", i + 1, row.scale);
    }
    text
}

fn transform_line(name: &str, pose: &Pose<f64>) -> String {
    let [x, y, z]: [f64; 3] = pose.translation_m.map(mm_from_m).into();
    let [alpha, beta, gamma] = link_angles(&pose.rotation).map(f64::to_degrees);
    format!("# {name}: Trans({x:?}, {y:?}, {z:?}) mm * Rz({alpha:?}) Ry({beta:?}) Rx({gamma:?}) deg\n")
}
