//! KUKA's KRL: a module with a program and no data list.
//!
//! `PTP` is joint-interpolated and, without `C_PTP`, stops exactly; `$ADVANCE=0` keeps the interpreter from running ahead. The goal
//! is an aggregate of A1 to A6 and the external axes E1 to E6, degrees where an axis turns and millimetres where it slides;
//! components that are left out stay as they are. `$VEL_AXIS[]` is percent of an axis's full speed.
//!
//! A selected program begins with a coincidence move (BCO) to its first goal, from wherever the robot stands. So the first goal is
//! where it stands, `PTP $AXIS_ACT`, and the joints are looked at behind it.
//!
//! Sources: `docs/robots.md`, list of statements. From memory, which no source at hand confirms:
//! `$BASE=$NULLFRAME`, `DECL BOOL` in a program without a data list.

use std::fmt::Write;

use super::axes::{Axis, AxisValue};
use super::words::{lines, minus};
use super::{Dialect, Limits, NOT_AT_START, Program, ProgramError, ProgramFile, tolerance};
use crate::units::fixed;

pub(super) const LIMITS: Limits = Limits {
    joints_min: 1,
    joints_max: 8,
    external_max: 6,
    arm_prismatic: true,
    name_max: 24,
    name_has_underscores: true,
    steps_max: 9_999,
};
/// Small arms' wrists reach 600 degrees per second, most axes less.
const FULL_SPEED_DEG_S: f64 = 600.0;
/// Percent of the full acceleration.
const ACCELERATION_PERCENT: u8 = 50;
/// Of a comment, and of a message.
const TEXT_MAX: usize = 70;
const DECIMALS: usize = 5;
/// Tools of the oldest controllers.
const TOOL_MAX: u8 = 16;

pub(super) fn write(program: &Program) -> Result<Vec<ProgramFile>, ProgramError> {
    let name = &program.name;
    let tool = tool(program)?;
    let axes = program.axis_values(&program.steps[0]);
    let mut body = format!("; {}\nBAS(#INITMOV,0)\n$ADVANCE=0\n", program.title());
    body += &format!("$TOOL=TOOL_DATA[{tool}]\n$LOAD=LOAD_DATA[{tool}]\n$BASE=$NULLFRAME\n");
    // Writing to a String cannot fail.
    for AxisValue { axis, kind, .. } in &axes {
        let velocity = program.percent(Dialect::Krl, *kind, FULL_SPEED_DEG_S)?;
        let (group, number) = match axis {
            Axis::Arm(number) => ("AXIS", number),
            Axis::External(number) => ("EXTAX", number),
        };
        let _ = writeln!(body, "$VEL_{group}[{number}]={velocity}\n$ACC_{group}[{number}]={ACCELERATION_PERCENT}");
    }
    let say = |words: &str| lines(words, TEXT_MAX).iter().map(|line| format!("MsgNotify(\"{line}\")\n")).collect::<String>();
    body += "; the coincidence run goes nowhere\nPTP $AXIS_ACT\n";
    body += &say(&format!("{name}: {}, then start key", program.before));
    body += "HALT\nATSTART=TRUE\n";
    for AxisValue { axis, kind, value } in axes {
        let off = minus(value, DECIMALS);
        let _ = writeln!(body, "IF ABS($AXIS_ACT.{axis}{off})>{:.1} THEN\nATSTART=FALSE\nENDIF", tolerance(kind));
    }
    body += "IF ATSTART THEN\n";
    for (index, step) in program.steps.iter().enumerate() {
        let values = program
            .axis_values(step)
            .into_iter()
            .map(|AxisValue { axis, value, .. }| format!("{axis} {}", fixed(value, DECIMALS)));
        let values = values.collect::<Vec<_>>().join(",");
        let _ = writeln!(body, "; {}\nPTP {{{values}}}", program.heading(index, TEXT_MAX));
        if step.is_measured {
            let _ = writeln!(body, "WAIT SEC {:.2}", program.stand_s);
        }
    }
    body += &say(&format!("{name}: {}", program.after));
    body += &format!("ELSE\n{}HALT\nENDIF\n", say(&format!("{name}: {NOT_AT_START}")));
    let text = format!("&ACCESS RVP\n&REL 1\nDEF {name}( )\nDECL BOOL ATSTART\n{body}END\n").replace('\n', "\r\n");
    Ok(vec![ProgramFile { name: format!("{name}.src"), text }])
}

/// The number of the tool and of its load.
fn tool(program: &Program) -> Result<u8, ProgramError> {
    let Some(found) = &program.setup.tool else { return Ok(1) };
    let number = found.parse().ok().filter(|number| (1..=TOOL_MAX).contains(number));
    number.ok_or_else(|| ProgramError::Tool { dialect: Dialect::Krl, found: found.clone(), expected: "a number of 1 to 16" })
}
