//! ABB's RAPID: a module with the joint targets and a routine.
//!
//! `MoveAbsJ` is joint-interpolated, `fine` is an exact stop, `\NoEOffs` leaves offsets of external axes out, and `\T` gives the
//! move its time in seconds: speeds of the tool and of its turning (`v50` allows 500 degrees per second of the latter) say nothing of
//! the joints. A time is only safe from the place that it was computed for, and a program pointer can be put anywhere: so the joints
//! are compared with the step before at every move, and not at the first one only.
//!
//! A joint target has six robot axes in degrees, and six external ones in degrees or millimetres, 9E9 where there are none. All
//! names but those of the module and of its routine are LOCAL. The head is that of S4 controllers, and lines end as on their disks;
//! newer controllers still read both.
//!
//! Sources: `docs/robots.md`, list of statements. From memory, which no source at hand confirms:
//! that S4 controllers want the head, `TPWrite`, `Stop`, `EXIT`, `WaitTime\InPos`, names of 16 characters.

use std::fmt::Write;

use super::axes::{ARM_AXES, Axis, AxisValue};
use super::words::lines;
use super::{Dialect, Limits, NOT_AT_START, Program, ProgramError, ProgramFile, tolerance};
use crate::units::fixed;

pub(super) const LIMITS: Limits = Limits {
    joints_min: 1,
    joints_max: 8,
    external_max: 6,
    arm_prismatic: false,
    // As a file on an S4's disk.
    name_max: 8,
    name_has_underscores: true,
    steps_max: 9_999,
};
const HEAD: &str = "%%%\n  VERSION:1\n  LANGUAGE:ENGLISH\n%%%\n\n";
/// Lines stay within 80 columns but for the targets themselves.
const COMMENT_MAX: usize = 70;
/// What the pendant shows in a line.
const MESSAGE_MAX: usize = 40;
const DECIMALS: usize = 5;
/// An axis that is not there.
const NO_AXIS: &str = "9E9";
/// Characters of a name, of S4 controllers.
const TOOL_MAX: usize = 16;

pub(super) fn write(program: &Program) -> Result<Vec<ProgramFile>, ProgramError> {
    let name = &program.name;
    let tool = tool(program)?;
    let say = |words: &str| lines(words, MESSAGE_MAX).iter().map(|line| format!("    TPWrite \"{line}\";\n")).collect::<String>();
    let mut targets = String::new();
    let mut moves = format!("{}    Stop;\n", say(&format!("{name}: {}, then start", program.before)));
    for (index, step) in program.steps.iter().enumerate() {
        let (before, number) = (index.max(1), index + 1);
        let (arm, external) = by_group(program.axis_values(step));
        // Writing to a String cannot fail.
        let _ =
            writeln!(targets, "  LOCAL CONST jointtarget jbb{number}:=[[{}],[{}]];", axes(&arm, "0"), axes(&external, NO_AXIS));
        let _ = writeln!(moves, "    ! {}", program.heading(index, COMMENT_MAX));
        let _ = writeln!(moves, "    bbgo jbb{before},jbb{number},{:.2};", program.move_s(index));
        if step.is_measured {
            let _ = writeln!(moves, "    WaitTime\\InPos,{:.2};", program.stand_s);
        }
    }
    moves += &say(&format!("{name}: {}", program.after));
    let title = program.title();
    let refusal = say(&format!("{name}: {NOT_AT_START}")).replace("    TPWrite", "      TPWrite");
    let checks: String = program.axis_values(&program.steps[0]).iter().map(check).collect();
    let text = format!(
        "{HEAD}MODULE {name}\n  ! {title}\n  LOCAL CONST speeddata vbb:=[50,5,50,5];\n{targets}  PROC {name}_run()\n{moves}  ENDPROC\n\
         \x20 LOCAL PROC bbgo(jointtarget before,jointtarget goal,num seconds)\n    IF NOT bbnear(before) THEN\n{refusal}      EXIT;\n    \
         ENDIF\n    MoveAbsJ goal\\NoEOffs,vbb\\T:=seconds,fine,{tool};\n  ENDPROC\n  LOCAL FUNC bool bbnear(jointtarget place)\n    VAR \
         jointtarget now;\n    now:=CJointT();\n{checks}    RETURN TRUE;\n  ENDFUNC\nENDMODULE\n"
    );
    Ok(vec![ProgramFile { name: format!("{name}.mod"), text: text.replace('\n', "\r\n") }])
}

/// That one axis is where it should be.
fn check(AxisValue { axis, kind, .. }: &AxisValue) -> String {
    let axis = match axis {
        Axis::Arm(number) => format!("robax.rax_{number}"),
        Axis::External(number) => format!("extax.eax_{}", ["a", "b", "c", "d", "e", "f"][(number - 1).min(5)]),
    };
    format!("    IF ABS(now.{axis}-place.{axis})>{:.1} RETURN FALSE;\n", tolerance(*kind))
}

/// Values of the arm's axes, and of the external ones.
fn by_group(values: Vec<AxisValue>) -> (Vec<String>, Vec<String>) {
    let (arm, external): (Vec<_>, Vec<_>) = values.into_iter().partition(|value| matches!(value.axis, Axis::Arm(_)));
    let text = |values: Vec<AxisValue>| values.iter().map(|value| fixed(value.value, DECIMALS)).collect();
    (text(arm), text(external))
}

/// Six axes.
fn axes(values: &[String], missing: &str) -> String {
    let mut axes = values.to_vec();
    axes.resize(ARM_AXES, missing.to_owned());
    axes.join(",")
}

/// The name of the tool's data.
fn tool(program: &Program) -> Result<&str, ProgramError> {
    let Some(found) = &program.setup.tool else { return Ok("tool0") };
    let is_letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let is_name = found.starts_with(|c: char| c.is_ascii_alphabetic()) && found.chars().all(is_letter) && found.len() <= TOOL_MAX;
    if is_name {
        return Ok(found);
    }
    let expected = "the name of its tooldata, a letter, then letters, digits and underscores, 16 characters in all";
    Err(ProgramError::Tool { dialect: Dialect::Rapid, found: found.clone(), expected })
}
