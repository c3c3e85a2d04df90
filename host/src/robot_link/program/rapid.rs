//! ABB's RAPID: a module with the joint targets and a routine.
//!
//! `MoveAbsJ` is joint-interpolated, `fine` is an exact stop, `\NoEOffs` leaves offsets of external axes out, and `\T` gives the
//! move its time in seconds instead of a speed of the tool, which would say nothing of the joints. The first move has no known
//! way: it goes at `v50`. A joint target has six robot axes in degrees, and six external ones in degrees or millimetres, 9E9
//! where there are none.
//!
//! Source: ABB, "Technical reference manual - RAPID Instructions, Functions and Data types", as others quote it: `MoveAbsJ [\Conc]
//! ToJointPos [\ID] [\NoEOffs] Speed [\V] | [\T] Zone [\Z] [\Inpos] Tool [\WObj]`; `jointtarget` as in public modules
//! (dkaynarc/tmc). `WaitTime\InPos`, names of 32 characters (16 before RobotWare 5) and comments after `!` are from memory.

use std::fmt::Write;

use super::{Limits, Program, ProgramFile};

pub(super) const LIMITS: Limits = Limits {
    joints_min: 1,
    joints_max: 8,
    robot_prismatic: false,
    external_prismatic: true,
    // With `_run`, sixteen.
    name_max: 12,
    name_has_underscores: true,
    steps_max: 9_999,
};
/// Lines stay within 80 columns but for the targets themselves.
const COMMENT_MAX: usize = 70;
/// An axis that is not there.
const NO_AXIS: &str = "9E9";

pub(super) fn write(program: &Program) -> Vec<ProgramFile> {
    let name = &program.name;
    let mut targets = String::new();
    let mut moves = String::new();
    for (index, step) in program.steps.iter().enumerate() {
        let number = index + 1;
        let values: Vec<String> = program.values(step).iter().map(|value| format!("{value:.5}")).collect();
        let (robot, external) = values.split_at(values.len().min(6));
        let (robot, external) = (axes(robot, "0"), axes(external, NO_AXIS));
        let speed = program.move_s(index).map_or_else(|| "v50".to_owned(), |move_s| format!("v1000\\T:={move_s:.2}"));
        // Writing to a String cannot fail.
        let _ = writeln!(targets, "  CONST jointtarget jbb{number}:=[[{robot}],[{external}]];");
        let _ = writeln!(moves, "    ! {}", program.heading(index, COMMENT_MAX));
        let _ = writeln!(moves, "    MoveAbsJ jbb{number}\\NoEOffs,{speed},fine,tool0;");
        if step.is_measured {
            let _ = writeln!(moves, "    WaitTime\\InPos,{:.2};", program.stand_s);
        }
    }
    let title = program.title();
    let text = format!("MODULE {name}\n  ! {title}\n{targets}  PROC {name}_run()\n{moves}  ENDPROC\nENDMODULE\n");
    vec![ProgramFile { name: format!("{name}.mod"), text }]
}

/// Six axes.
fn axes(values: &[String], missing: &str) -> String {
    let mut axes = values.to_vec();
    axes.resize(6, missing.to_owned());
    axes.join(",")
}
