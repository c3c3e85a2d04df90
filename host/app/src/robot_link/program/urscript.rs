//! Universal Robots' URScript: a function that the controller runs when it is sent to port 30002.
//!
//! `movej` with joint angles is joint-interpolated, `v` is the leading joint's speed, and without `r` it stops at its end. A popup
//! that blocks waits until somebody at the pendant has the program go on.
//!
//! Sources: `docs/robots.md`, list of statements. From memory, which no source at hand confirms:
//! that `norm` of one number is its absolute value.

use std::fmt::Write;

use super::words::{lines, minus};
use super::{Dialect, Limits, NOT_AT_START, Program, ProgramError, ProgramFile, START_TOLERANCE_DEG};
use crate::robot_link::urscript::ACCELERATION_RAD_S2;
use crate::units::fixed;

pub(super) const LIMITS: Limits = Limits {
    joints_min: 6,
    joints_max: 6,
    external_max: 0,
    arm_prismatic: false,
    name_max: 40,
    name_has_underscores: true,
    steps_max: 9_999,
};
const TEXT_MAX: usize = 100;
/// Of radians.
const DECIMALS: usize = 8;

pub(super) fn write(program: &Program) -> Result<Vec<ProgramFile>, ProgramError> {
    if let Some(found) = program.setup.tool.clone() {
        return Err(ProgramError::Tool { dialect: Dialect::UrScript, found, expected: "none: the installation's load counts" });
    }
    let name = &program.name;
    let popup = |words: &str, kind: &str| {
        let words = lines(words, usize::MAX).join(" ");
        format!("popup(\"{words}\", title=\"{name}\", {kind}blocking=True)\n")
    };
    let joints = |index: usize| program.steps[index].q.as_array()[..6].iter().copied();
    let mut text = format!("def {name}():\n  # {}\n  ", program.title());
    text += &popup(&format!("{}, then Continue", program.before), "");
    text += "  local q = get_actual_joint_positions()\n";
    let tolerance_rad = START_TOLERANCE_DEG.to_radians();
    let off = |(number, q_rad)| format!("norm(q[{number}]{}) > {tolerance_rad:.8}", minus(q_rad, DECIMALS));
    let off = joints(0).enumerate().map(off).collect::<Vec<_>>().join(" or ");
    text += &format!("  if {off}:\n    {}    halt\n  end\n", popup(NOT_AT_START, "error=True, "));
    for (index, step) in program.steps.iter().enumerate() {
        let joints = joints(index).map(|q_rad| fixed(q_rad, DECIMALS)).collect::<Vec<_>>().join(", ");
        let v_rad_s = program.speed.revolute_rad_s;
        // Writing to a String cannot fail.
        let _ = writeln!(text, "  # {}", program.heading(index, TEXT_MAX));
        let _ = writeln!(text, "  movej([{joints}], a={ACCELERATION_RAD_S2:.3}, v={v_rad_s:.6})");
        if step.is_measured {
            let _ = writeln!(text, "  sleep({:.3})", program.stand_s);
        }
    }
    text += &format!("  {}end\n", popup(&program.after, ""));
    Ok(vec![ProgramFile { name: format!("{name}.script"), text }])
}
