//! Fanuc's teach pendant programs as ASCII (.LS), which a controller with the ASCII upload option loads.
//!
//! `J P[n] … FINE` is joint-interpolated with an exact stop; a speed in `sec` is the time of the move. The first move has no
//! known way: it goes at 5 %. Positions are in joints, group 1, six axes and the extended ones E1 and E2, three decimals, which
//! is what the controller writes itself.
//!
//! A six-axis arm's controller counts J3 from the horizontal, a chain from the second link: what is written is q3 - q2, by
//! ROS-Industrial (ros-industrial/fanuc_experimental, issue 17: "J2-J3 linkage"; its drivers do the same for all such arms).
//! Robots of fewer axes, and those with a slide among the first three, have no such linkage. The first remark of the program says
//! so: jog to the first pose by hand.
//!
//! A program is split where it would exceed 999 positions: the first file then calls the others.
//!
//! Sources: Fanuc, "HandlingTool Setup and Operations Manual" (motion and wait instructions), from memory; the layout of the file
//! and of positions in joints, millimetre axes among them, after .LS files of controllers in public repositories
//! (GilbertPan97/HandEyeSync, JuniorNatalin/VASC); units of speed: aleksandarhaber.com, "Basics of Fanuc Motion Instructions".

use std::fmt::Write;
use std::ops::Range;

use ballbar::JointKind;

use super::{Limits, Program, ProgramFile, printable};

pub(super) const LIMITS: Limits = Limits {
    joints_min: 1,
    joints_max: 8,
    robot_prismatic: true,
    external_prismatic: true,
    // Old controllers have eight; two are for the number of a part.
    name_max: 6,
    name_has_underscores: true,
    // 99 parts.
    steps_max: 99 * STEPS_A_PART,
};
/// Positions that every controller holds in a program.
const STEPS_A_PART: usize = 999;
/// Characters of a remark.
const COMMENT_MAX: usize = 32;
/// A user's date; the controller writes its own when it saves the program.
const DATE: &str = "DATE 26-01-01  TIME 00:00:00";

pub(super) fn write(program: &Program) -> Vec<ProgramFile> {
    let name = program.name.to_uppercase();
    let steps = program.steps.len();
    if steps <= STEPS_A_PART {
        return vec![part(program, &name, 0..steps)];
    }
    let parts = steps.div_ceil(STEPS_A_PART);
    let part_name = |number: usize| format!("{name}{:02}", number + 1);
    let calls: Vec<String> = (0..parts).map(|number| format!("CALL {}    ;", part_name(number))).collect();
    let parts = (0..parts).map(|number| {
        let begin = number * STEPS_A_PART;
        part(program, &part_name(number), begin..(begin + STEPS_A_PART).min(steps))
    });
    std::iter::once(file(program, &name, &calls, "")).chain(parts).collect()
}

/// The file of some of the steps.
fn part(program: &Program, name: &str, steps: Range<usize>) -> ProgramFile {
    let mut lines = vec!["UFRAME_NUM=0 ;".to_owned(), "UTOOL_NUM=1 ;".to_owned()];
    if has_linkage(program) {
        lines.push("!J3 is q3-q2: check first pose ;".to_owned());
    }
    let mut positions = String::new();
    for (number, index) in (1..).zip(steps) {
        let speed = program.move_s(index).map_or_else(|| "5%".to_owned(), |move_s| format!("{:.1}sec", tenths_up(move_s)));
        lines.push(format!("!{} ;", program.heading(index, COMMENT_MAX)));
        lines.push(format!("J P[{number}] {speed} FINE    ;"));
        if program.steps[index].is_measured {
            lines.push(format!("WAIT {:.2}(sec) ;", program.stand_s));
        }
        positions += &position(program, index, number);
    }
    file(program, name, &lines, &positions)
}

/// The pendant takes tenths of a second.
fn tenths_up(move_s: f64) -> f64 {
    (move_s * 10.0 - 1e-6).ceil() / 10.0
}

/// One entry of `/POS`, three axes a line.
fn position(program: &Program, index: usize, number: usize) -> String {
    let axis = |(axis, (value, kind)): (usize, (f64, &JointKind))| {
        let unit = if *kind == JointKind::Revolute { "deg" } else { " mm" };
        let label = if axis < 6 { format!("J{}", axis + 1) } else { format!("E{}", axis - 5) };
        format!("{label}={value:10.3} {unit}")
    };
    let mut values = program.values(&program.steps[index]);
    if has_linkage(program) {
        values[2] -= values[1];
    }
    let axes: Vec<String> = values.into_iter().zip(&program.kinds).enumerate().map(axis).collect();
    let rows: Vec<String> = axes.chunks(3).map(|row| format!("\t{}", row.join(",\t"))).collect();
    format!("P[{number}]{{\n   GP1:\n\tUF : 0, UT : 1,\t\n{}\n}};\n", rows.join(",\n"))
}

/// Whether J3 is counted from the horizontal.
fn has_linkage(program: &Program) -> bool {
    program.kinds.len() >= 6 && program.kinds[..3].iter().all(|kind| *kind == JointKind::Revolute)
}

fn file(program: &Program, name: &str, lines: &[String], positions: &str) -> ProgramFile {
    let comment = printable(&program.name, 16);
    let count = lines.len();
    let mut text = format!(
        "/PROG  {name}\n/ATTR\nOWNER\t\t= MNEDITOR;\nCOMMENT\t\t= \"{comment}\";\nPROG_SIZE\t= 0;\nCREATE\t\t= {DATE};\n\
         MODIFIED\t= {DATE};\nFILE_NAME\t= ;\nVERSION\t\t= 0;\nLINE_COUNT\t= {count};\nMEMORY_SIZE\t= 0;\nPROTECT\t\t= READ_WRITE;\n\
         TCD:  STACK_SIZE\t= 0,\n      TASK_PRIORITY\t= 50,\n      TIME_SLICE\t= 0,\n      BUSY_LAMP_OFF\t= 0,\n      \
         ABORT_REQUEST\t= 0,\n      PAUSE_REQUEST\t= 0;\nDEFAULT_GROUP\t= 1,*,*,*,*;\nCONTROL_CODE\t= 00000000 00000000;\n/MN\n"
    );
    for (number, line) in (1..).zip(lines) {
        // A motion's letter follows its number without a space. Writing to a String cannot fail.
        let space = if line.starts_with("J ") { "" } else { "  " };
        let _ = writeln!(text, "{number:4}:{space}{line}");
    }
    text += &format!("/POS\n{positions}/END\n");
    ProgramFile { name: format!("{name}.LS"), text }
}
