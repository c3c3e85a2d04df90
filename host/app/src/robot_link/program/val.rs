//! Unimation VAL II: a program without a location of its own, as `LOAD` reads it.
//!
//! `MOVE` is joint-interpolated, `BREAK` waits for its end, `FINE` for the servos to be within their narrow tolerance, `DELAY` stands.
//! Every program and every variable of VAL II is global, so goals stand in the instructions, `#PPOINT(…)`, six joint angles in
//! degrees. The two variables that the program needs to look at the joints have its name in theirs.
//!
//! Speeds are percent; the full speed is assumed as the link does.
//!
//! Sources: `docs/robots.md`, list of statements. From memory, which no source at hand confirms:
//! that VAL II has no local variables, `HERE`, `DECOMPOSE`, `BREAK`, `FINE ALWAYS`, `DELAY`, `TYPE`, `PAUSE`, `STOP`,
//! `IF … GOTO`, `ABS`.

use std::fmt::Write;

use ballbar::JointKind;

use super::words::{lines, minus};
use super::{Dialect, Limits, NOT_AT_START, Program, ProgramError, ProgramFile, START_TOLERANCE_DEG};
use crate::robot_link::val::ValSpeeds;
use crate::units::fixed;

pub(super) const LIMITS: Limits = Limits {
    joints_min: 1,
    joints_max: 6,
    external_max: 0,
    arm_prismatic: false,
    // Six of the older VAL, less the letter before it in the names of variables.
    name_max: 5,
    name_has_underscores: false,
    steps_max: 9_999,
};
/// Within the 80 columns of a terminal line.
const TEXT_MAX: usize = 60;
const DECIMALS: usize = 3;

pub(super) fn write(program: &Program) -> Result<Vec<ProgramFile>, ProgramError> {
    if let Some(found) = program.setup.tool.clone() {
        return Err(ProgramError::Tool { dialect: Dialect::Val, found, expected: "none: VAL has no load" });
    }
    let name = program.name.to_uppercase();
    let full_deg_s = ValSpeeds::default().fastest_rad_s.to_degrees();
    let percent = program.percent(Dialect::Val, JointKind::Revolute, full_deg_s)?;
    let mut text = format!(".PROGRAM {name}()\n; {}\n  SPEED {percent} ALWAYS\n  FINE ALWAYS\n", program.title());
    let say = |words: &str| lines(words, TEXT_MAX).iter().map(|line| format!("  TYPE \"{line}\"\n")).collect::<String>();
    text += &say(&format!("{name}: {}, then PROCEED", program.before));
    text += &format!("  PAUSE\n  HERE #P{name}\n  DECOMPOSE Q{name}[1] = #P{name}\n");
    // Writing to a String cannot fail.
    for (number, value) in (1..).zip(program.values(&program.steps[0])) {
        let off = minus(value, DECIMALS);
        let _ = writeln!(text, "  IF ABS(Q{name}[{number}]{off}) > {START_TOLERANCE_DEG} GOTO 10");
    }
    for (index, step) in program.steps.iter().enumerate() {
        let values = program.values(step).iter().map(|value| fixed(*value, DECIMALS)).collect::<Vec<_>>().join(",");
        let _ = writeln!(text, "; {}\n  MOVE #PPOINT({values})\n  BREAK", program.heading(index, TEXT_MAX));
        if step.is_measured {
            let _ = writeln!(text, "  DELAY {:.2}", program.stand_s);
        }
    }
    text += &say(&format!("{name}: {}", program.after));
    // A label takes the place of the line's first space.
    text += &format!("  GOTO 20\n10{}20 STOP\n.END\n", &say(&format!("{name}: {NOT_AT_START}"))[1..]);
    Ok(vec![ProgramFile { name: format!("{name}.PG"), text }])
}
