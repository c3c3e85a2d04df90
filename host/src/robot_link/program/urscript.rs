//! Universal Robots' URScript: a function that the controller runs when it is sent to port 30002.
//!
//! `movej` with joint angles is joint-interpolated, `v` is the leading joint's speed, and without `r` it stops at its end.
//!
//! Source: Universal Robots, "The URScript Programming Language", from memory.

use std::fmt::Write;

use super::{Limits, Program, ProgramFile};
use crate::robot_link::urscript::ACCELERATION_RAD_S2;

pub(super) const LIMITS: Limits = Limits {
    joints_min: 6,
    joints_max: 6,
    robot_prismatic: false,
    external_prismatic: false,
    name_max: 40,
    name_has_underscores: true,
    steps_max: 9_999,
};
const COMMENT_MAX: usize = 100;

pub(super) fn write(program: &Program) -> Vec<ProgramFile> {
    let name = &program.name;
    let mut text = format!("def {name}():\n  # {}\n", program.title());
    for (index, step) in program.steps.iter().enumerate() {
        let joints = step.q.as_array()[..6].iter().map(|q| format!("{q:.8}")).collect::<Vec<_>>().join(", ");
        let v_rad_s = program.speed.revolute_rad_s;
        // Writing to a String cannot fail.
        let _ = writeln!(text, "  # {}", program.heading(index, COMMENT_MAX));
        let _ = writeln!(text, "  movej([{joints}], a={ACCELERATION_RAD_S2:.3}, v={v_rad_s:.6})");
        if step.is_measured {
            let _ = writeln!(text, "  sleep({:.3})", program.stand_s);
        }
    }
    text += "end\n";
    vec![ProgramFile { name: format!("{name}.script"), text }]
}
