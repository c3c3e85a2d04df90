//! Fanuc's teach pendant programs as ASCII (.LS), which a controller with the ASCII upload option loads.
//!
//! `J P[n] … FINE` is joint-interpolated with an exact stop; percent is of every axis's full speed, from wherever the move begins,
//! which a time would not be. Positions are in joints, group 1, the arm's axes J1 to J6 and the extended ones E1 to E3, three
//! decimals, which is what the controller writes itself.
//!
//! Many Fanuc arms count J3 from the horizontal, whatever J2 is, five-axis arms among them; others count it as a chain does. Which
//! it is only the robot tells, so it has to be said: the controller's J3 is q3 + k · q2, where k is -1, 0 or 1
//! (ros-industrial/fanuc has the same number, `J23_factor`, from the controller to the chain: its sign is the other one).
//!
//! A program is split where it would exceed 999 positions: the first file then calls the others. Each of them begins at the last
//! position of the one before, so that it looks at the joints like any other.
//!
//! Sources: `docs/robots.md`, list of statements. From memory, which no source at hand confirms:
//! 24 characters of a message, `(-0.5)`, `ABORT`, how many registers and positions there are.

use std::fmt::Write;
use std::ops::Range;

use ballbar::JointKind;

use super::axes::{Axis, AxisValue};
use super::words::{lines, minus};
use super::{Dialect, Limits, NOT_AT_START, Program, ProgramError, ProgramFile, ProgramStep, printable, tolerance};
use crate::units::fixed;

pub(super) const LIMITS: Limits = Limits {
    joints_min: 1,
    joints_max: 8,
    external_max: 3,
    arm_prismatic: true,
    // Old controllers have eight; two are for the number of a part.
    name_max: 6,
    name_has_underscores: true,
    // 99 parts, that begin where the one before ends.
    steps_max: 99 * (POSITIONS_A_PART - 1),
};
/// Positions that every controller holds in a program.
const POSITIONS_A_PART: usize = 999;
/// The fastest small arms' wrists.
const FULL_SPEED_DEG_S: f64 = 1000.0;
/// Characters of a remark, and of a message.
const COMMENT_MAX: usize = 32;
const MESSAGE_MAX: usize = 24;
const DECIMALS: usize = 3;
/// Where the program keeps the joints to look at them: the last of the standard number of each.
const POSITION_REGISTER: usize = 100;
const REGISTER: usize = 200;
/// Where the program goes on when the joints are elsewhere.
const AWAY: usize = 999;
/// Tool frames, and load schedules, of every controller.
const TOOL_MAX: u8 = 9;
/// A user's date; the controller writes its own when it saves the program.
const DATE: &str = "DATE 26-01-01  TIME 00:00:00";

/// A program with what its text depends on.
struct Writer<'a> {
    program: &'a Program,
    name: String,
    tool: u8,
    j23: i8,
    percent: u8,
}

pub(super) fn write(program: &Program) -> Result<Vec<ProgramFile>, ProgramError> {
    let mut percent = 100;
    for kind in &program.kinds {
        percent = percent.min(program.percent(Dialect::FanucLs, *kind, FULL_SPEED_DEG_S)?);
    }
    let name = program.name.to_uppercase();
    let writer = Writer { program, name, tool: tool(program)?, j23: j23(program)?, percent };
    let steps = program.steps.len();
    if steps <= POSITIONS_A_PART {
        let lines = [writer.before(), writer.guard(0), writer.moves(0..steps, 0), writer.after(), writer.end()].concat();
        return Ok(vec![writer.file(&writer.name, &lines, 0..steps)]);
    }
    // The positions of a part but for the one at which the part before ends.
    let new = POSITIONS_A_PART - 1;
    let parts: Vec<ProgramFile> = (0..steps.div_ceil(new))
        .map(|part| {
            let first = part * new;
            let positions = first.saturating_sub(1)..(first + new).min(steps);
            let lines =
                [writer.head(), writer.guard(positions.start), writer.moves(positions.clone(), first), writer.end()].concat();
            writer.file(&writer.part_name(part), &lines, positions)
        })
        .collect();
    let calls = (0..parts.len()).map(|part| format!("CALL {}    ;", writer.part_name(part))).collect();
    let main = writer.file(&writer.name, &[writer.before(), calls, writer.after()].concat(), 0..0);
    Ok(std::iter::once(main).chain(parts).collect())
}

impl Writer<'_> {
    fn part_name(&self, part: usize) -> String {
        format!("{}{:02}", self.name, part + 1)
    }

    /// Frame, tool and load.
    fn head(&self) -> Vec<String> {
        let tool = self.tool;
        let j3 = match self.j23 {
            1 => "!J3 is q3+q2 ;",
            -1 => "!J3 is q3-q2 ;",
            _ => "!J3 is q3 ;",
        };
        vec!["UFRAME_NUM=0 ;".into(), format!("UTOOL_NUM={tool} ;"), format!("PAYLOAD[{tool}] ;"), j3.into()]
    }

    fn message(&self, words: &str) -> Vec<String> {
        let words = lines(&format!("{}: {words}", self.name), MESSAGE_MAX);
        words.iter().map(|line| format!("MESSAGE[{line}] ;")).collect()
    }

    fn before(&self) -> Vec<String> {
        let mut lines = self.head();
        lines.extend(self.message(&format!("{}, then start", self.program.before)));
        lines.push("PAUSE ;".into());
        lines
    }

    /// Compares the joints with a step's.
    fn guard(&self, index: usize) -> Vec<String> {
        let mut lines = vec![format!("PR[{POSITION_REGISTER}]=JPOS    ;")];
        for AxisValue { axis, kind, value } in self.values(&self.program.steps[index]) {
            let element = match axis {
                Axis::Arm(number) => number,
                Axis::External(number) => 6 + number,
            };
            let off = minus(value, DECIMALS);
            let tolerance = tolerance(kind);
            lines.push(format!("R[{REGISTER}]=PR[{POSITION_REGISTER},{element}]{off}    ;"));
            lines.push(format!("IF R[{REGISTER}]>{tolerance:.1},JMP LBL[{AWAY}] ;"));
            lines.push(format!("IF R[{REGISTER}]<(-{tolerance:.1}),JMP LBL[{AWAY}] ;"));
        }
        lines
    }

    /// Moves through positions; a part has been at those before `first`.
    fn moves(&self, positions: Range<usize>, first: usize) -> Vec<String> {
        let mut lines = Vec::new();
        for (number, index) in (1..).zip(positions) {
            lines.push(format!("!{} ;", self.program.heading(index, COMMENT_MAX)));
            lines.push(format!("J P[{number}] {}% FINE    ;", self.percent));
            if self.program.steps[index].is_measured && index >= first {
                lines.push(format!("WAIT {:.2}(sec) ;", self.program.stand_s));
            }
        }
        lines
    }

    fn after(&self) -> Vec<String> {
        self.message(&self.program.after)
    }

    /// Where a program with moves ends, and where it ends without them.
    fn end(&self) -> Vec<String> {
        let mut lines = vec!["END ;".to_owned(), format!("LBL[{AWAY}] ;")];
        lines.extend(self.message(NOT_AT_START));
        lines.push("ABORT ;".into());
        lines
    }

    /// A step's values as the controller counts them.
    fn values(&self, step: &ProgramStep) -> Vec<AxisValue> {
        let mut values = self.program.axis_values(step);
        let value_of = |number| values.iter().find(|value| value.axis == Axis::Arm(number)).map(|value| value.value);
        let (Some(q2), j23) = (value_of(2), f64::from(self.j23)) else { return values };
        if let Some(j3) = values.iter_mut().find(|value| value.axis == Axis::Arm(3)) {
            j3.value += j23 * q2;
        }
        values
    }

    /// One entry of `/POS`, three axes a line.
    fn position(&self, number: usize, step: &ProgramStep) -> String {
        let axis = |AxisValue { axis, kind, value }: AxisValue| {
            let unit = if kind == JointKind::Revolute { "deg" } else { " mm" };
            let label = match axis {
                Axis::Arm(number) => format!("J{number}"),
                Axis::External(number) => format!("E{number}"),
            };
            format!("{label}={:>10} {unit}", fixed(value, DECIMALS))
        };
        let axes: Vec<String> = self.values(step).into_iter().map(axis).collect();
        let rows: Vec<String> = axes.chunks(3).map(|row| format!("\t{}", row.join(",\t"))).collect();
        format!("P[{number}]{{\n   GP1:\n\tUF : 0, UT : {},\t\n{}\n}};\n", self.tool, rows.join(",\n"))
    }

    fn file(&self, name: &str, lines: &[String], positions: Range<usize>) -> ProgramFile {
        let comment = printable(&self.program.name, 16);
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
        text += "/POS\n";
        for (number, step) in (1..).zip(&self.program.steps[positions]) {
            text += &self.position(number, step);
        }
        text += "/END\n";
        ProgramFile { name: format!("{name}.LS"), text }
    }
}

/// How the controller's J3 is counted; 0 where the arm's second and third axes do not both turn.
fn j23(program: &Program) -> Result<i8, ProgramError> {
    let values = program.axis_values(&program.steps[0]);
    let turns = |number| values.iter().any(|value| value.axis == Axis::Arm(number) && value.kind == JointKind::Revolute);
    match program.setup.j23 {
        Some(found) if !(-1..=1).contains(&found) => Err(ProgramError::J23Value { found }),
        Some(found) if found != 0 && !(turns(2) && turns(3)) => Err(ProgramError::J23Needless { found }),
        Some(found) => Ok(found),
        None if turns(2) && turns(3) => Err(ProgramError::J23Missing),
        None => Ok(0),
    }
}

/// The number of the tool frame and of its load schedule.
fn tool(program: &Program) -> Result<u8, ProgramError> {
    let Some(found) = &program.setup.tool else { return Ok(1) };
    let number = found.parse().ok().filter(|number| (1..=TOOL_MAX).contains(number));
    number.ok_or_else(|| ProgramError::Tool { dialect: Dialect::FanucLs, found: found.clone(), expected: "a number of 1 to 9" })
}
