//! KUKA's KRL: a module of a program (.src) and its axis positions (.dat).
//!
//! `PTP` is joint-interpolated and, without `C_PTP`, stops exactly; `$ADVANCE=0` keeps the interpreter from running ahead.
//! `E6AXIS` has A1 to A6 and the external axes E1 to E6, degrees where an axis turns and millimetres where it slides; components
//! that are left out stay as they are. `$VEL_AXIS[]` is percent of an axis's full speed, which the controller knows and this
//! program does not.
//!
//! Sources: KUKA, "KR C2/KR C3 Expert Programming" and "KSS 8.x Operating and Programming Instructions for System Integrators",
//! from memory; `BAS(#INITMOV,0)`, `$VEL_AXIS[I]` and the head lines as in public post processors (visose/Robots).

use std::fmt::Write;

use ballbar::JointKind;

use super::{Limits, Program, ProgramFile};
use crate::robot_link::speed::percent;

pub(super) const LIMITS: Limits = Limits {
    joints_min: 1,
    joints_max: 8,
    robot_prismatic: true,
    external_prismatic: true,
    name_max: 24,
    name_has_underscores: true,
    steps_max: 9_999,
};
/// Assumed full speed of an axis that turns: small arms' wrists reach 600 degrees per second, most axes less.
const FULL_SPEED_DEG_S: f64 = 600.0;
/// Assumed full speed of an axis that slides.
const FULL_SPEED_M_S: f64 = 2.5;
/// Percent of the full acceleration.
const ACCELERATION_PERCENT: u8 = 50;
const HEAD: &str = "&ACCESS RVP\n&REL 1\n";
const COMMENT_MAX: usize = 70;

pub(super) fn write(program: &Program) -> Vec<ProgramFile> {
    let name = &program.name;
    let mut source = format!("{HEAD}DEF {name}( )\n; {}\nBAS(#INITMOV,0)\n$ADVANCE=0\n", program.title());
    // Writing to a String cannot fail.
    for (index, kind) in program.kinds.iter().enumerate() {
        let velocity = match kind {
            JointKind::Revolute => percent(program.speed.revolute_rad_s.to_degrees(), FULL_SPEED_DEG_S),
            JointKind::Prismatic => percent(program.speed.prismatic_m_s, FULL_SPEED_M_S),
        };
        let (group, number) = if index < 6 { ("AXIS", index + 1) } else { ("EXTAX", index - 5) };
        let _ = writeln!(source, "$VEL_{group}[{number}]={velocity}\n$ACC_{group}[{number}]={ACCELERATION_PERCENT}");
    }
    let mut data = format!("{HEAD}DEFDAT {name}\n");
    for (index, step) in program.steps.iter().enumerate() {
        let number = index + 1;
        let _ = writeln!(source, "; {}\nPTP BB{number}", program.heading(index, COMMENT_MAX));
        if step.is_measured {
            let _ = writeln!(source, "WAIT SEC {:.2}", program.stand_s);
        }
        let axis = |index: usize| if index < 6 { format!("A{}", index + 1) } else { format!("E{}", index - 5) };
        let values = program.values(step);
        let axes = values.iter().enumerate().map(|(index, value)| format!("{} {value:.5}", axis(index)));
        let _ = writeln!(data, "DECL E6AXIS BB{number}={{{}}}", axes.collect::<Vec<_>>().join(","));
    }
    source += "END\n";
    data += "ENDDAT\n";
    vec![ProgramFile { name: format!("{name}.src"), text: source }, ProgramFile { name: format!("{name}.dat"), text: data }]
}
