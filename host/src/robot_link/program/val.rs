//! Unimation VAL II: a program and its precision points in one file, as `LOAD` reads it.
//!
//! `MOVE` is joint-interpolated, `BREAK` waits for its end, `FINE` for the servos to be within their narrow tolerance, `DELAY` stands.
//! A precision point is `#` and a name, six joint angles in degrees. Speeds are percent; the full speed is assumed as the link does.
//!
//! Sources: the layout of a program as VAL II's successor writes it, Adept, "V+ Language User's Guide", format of programs
//! (`.PROGRAM name()`, `.END`, `;` for comments). The instructions and `.LOCATIONS` are from memory of VAL II and V+.

use std::fmt::Write;

use super::{Limits, Program, ProgramFile};
use crate::robot_link::val::ValSpeeds;

pub(super) const LIMITS: Limits = Limits {
    joints_min: 1,
    joints_max: 6,
    robot_prismatic: false,
    external_prismatic: false,
    // Of the older VAL; VAL II has more.
    name_max: 6,
    name_has_underscores: false,
    // So that `P9999` stays within six characters with its sign.
    steps_max: 9_999,
};
/// Within the 80 columns of a terminal line.
const COMMENT_MAX: usize = 60;

pub(super) fn write(program: &Program) -> Vec<ProgramFile> {
    let name = program.name.to_uppercase();
    let percent = ValSpeeds::default().percent(program.speed.revolute_rad_s);
    let mut text = format!(".PROGRAM {name}()\n; {}\n  SPEED {percent} ALWAYS\n  FINE ALWAYS\n", program.title());
    let mut points = String::new();
    for (index, step) in program.steps.iter().enumerate() {
        let number = index + 1;
        // Writing to a String cannot fail.
        let _ = writeln!(text, "; {}\n  MOVE #P{number}\n  BREAK", program.heading(index, COMMENT_MAX));
        if step.is_measured {
            let _ = writeln!(text, "  DELAY {:.2}", program.stand_s);
        }
        let values = program.values(step).iter().map(|value| format!("{value:.3}")).collect::<Vec<_>>().join(" ");
        let _ = writeln!(points, "#P{number} {values}");
    }
    text += &format!(".END\n.LOCATIONS\n{points}.END\n");
    vec![ProgramFile { name: format!("{name}.LC"), text }]
}
