//! Fanuc's TP as ASCII.

use std::collections::{BTreeMap, BTreeSet};

use host_cal::robot_link::program::ProgramFile;

use super::machine::Speed;
use super::{Axis, Complaint, Machine, between, is_name, number, taken_away, whole, wrong};

struct Position {
    user_frame: usize,
    tool_frame: usize,
    axes: BTreeMap<Axis, f64>,
}

struct Listing<'a> {
    instructions: Vec<&'a str>,
    positions: BTreeMap<usize, Position>,
}

/// What stays from one program to the next.
#[derive(Default)]
struct State {
    user_frame: Option<usize>,
    tool_frame: Option<usize>,
    payload: Option<usize>,
    registers: BTreeMap<usize, f64>,
    position_registers: BTreeMap<usize, BTreeMap<Axis, f64>>,
}

#[derive(PartialEq)]
enum Flow {
    Return,
    Abort,
}

fn attributes(lines: usize) -> impl Fn(&str) -> String {
    move |comment| {
        let date = "DATE 26-01-01  TIME 00:00:00";
        format!(
            "OWNER\t\t= MNEDITOR;\nCOMMENT\t\t= \"{comment}\";\nPROG_SIZE\t= 0;\nCREATE\t\t= {date};\nMODIFIED\t= {date};\nFILE_NAME\t= ;\n\
             VERSION\t\t= 0;\nLINE_COUNT\t= {lines};\nMEMORY_SIZE\t= 0;\nPROTECT\t\t= READ_WRITE;\nTCD:  STACK_SIZE\t= 0,\n      \
             TASK_PRIORITY\t= 50,\n      TIME_SLICE\t= 0,\n      BUSY_LAMP_OFF\t= 0,\n      ABORT_REQUEST\t= 0,\n      \
             PAUSE_REQUEST\t= 0;\nDEFAULT_GROUP\t= 1,*,*,*,*;\nCONTROL_CODE\t= 00000000 00000000;\n"
        )
    }
}

fn listing(file: &ProgramFile) -> Result<Listing<'_>, Complaint> {
    let name = file.name.strip_suffix(".LS").filter(|name| is_name(name, 8)).ok_or("no program")?;
    let body = between(&file.text, &format!("/PROG  {name}\n/ATTR\n"), "/END\n").ok_or("no program of the file's name")?;
    let (given, rest) = body.split_once("/MN\n").ok_or("no /MN")?;
    let (lines, positions) = rest.split_once("/POS\n").ok_or("no /POS")?;
    let comment = given.split('"').nth(1).ok_or("no comment")?;
    if given != attributes(lines.lines().count())(comment) || comment.len() > 16 || !name.starts_with(&comment.to_uppercase()) {
        return wrong("other attributes", given);
    }
    let mut instructions = Vec::new();
    for (index, line) in lines.lines().enumerate() {
        let (line_number, instruction) = line.split_at_checked(5).ok_or("a short line")?;
        if line_number != format!("{:4}:", index + 1) {
            return wrong("not the line's number", line_number);
        }
        let instruction =
            if instruction.starts_with("J ") { instruction } else { instruction.strip_prefix("  ").ok_or("no space")? };
        instructions.push(instruction.strip_suffix(';').ok_or("no semicolon")?.trim_end());
    }
    if !(positions.is_empty() || positions.ends_with("};\n")) {
        return Err("a position without an end".into());
    }
    let positions = positions.split_terminator("};\n").map(position).collect::<Result<_, _>>()?;
    Ok(Listing { instructions, positions })
}

fn position(entry: &str) -> Result<(usize, Position), Complaint> {
    let (index, rest) =
        entry.strip_prefix("P[").and_then(|entry| entry.split_once("]{\n   GP1:\n\tUF : ")).ok_or("no position")?;
    let (user_frame, rest) = rest.split_once(", UT : ").ok_or("no tool frame")?;
    let (tool_frame, rest) = rest.split_once(",\t\n").ok_or("no axes")?;
    let mut axes = BTreeMap::new();
    for text in rest.strip_suffix('\n').ok_or("no end")?.split(',') {
        let (label, value) = text.trim_start().split_once('=').ok_or("no value")?;
        let axis = match (label.strip_prefix('J'), label.strip_prefix('E')) {
            (Some(number), _) => Axis::Arm(whole(number, 1, 6)?),
            (_, Some(number)) => Axis::External(whole(number, 1, 3)?),
            _ => return wrong("no axis", label),
        };
        // A rail is told in millimetres.
        let value = value.strip_suffix(" deg").or_else(|| value.strip_suffix("  mm")).ok_or("no unit")?;
        if axes.insert(axis, number(value.trim_start())?).is_some() {
            return wrong("an axis twice", label);
        }
    }
    let position = Position { user_frame: whole(user_frame, 0, 9)?, tool_frame: whole(tool_frame, 1, 9)?, axes };
    Ok((whole(index, 1, 999)?, position))
}

pub(super) fn run(files: &[ProgramFile], machine: &mut Machine) -> Result<(), Complaint> {
    let programs = files
        .iter()
        .map(|file| Ok((file.name.trim_end_matches(".LS"), listing(file)?)))
        .collect::<Result<BTreeMap<_, _>, Complaint>>()?;
    let first = files.first().ok_or("no file")?.name.trim_end_matches(".LS");
    let mut called = BTreeSet::new();
    run_program(first, &programs, &mut State::default(), &mut called, machine)?;
    Ok(())
}

fn run_program<'a>(
    name: &'a str,
    programs: &BTreeMap<&'a str, Listing<'a>>,
    state: &mut State,
    called: &mut BTreeSet<&'a str>,
    machine: &mut Machine,
) -> Result<Flow, Complaint> {
    let Listing { instructions, positions } = programs.get(name).ok_or(format!("no program {name}"))?;
    let mut used = BTreeSet::new();
    let label =
        |label: &str| instructions.iter().position(|line| *line == format!("LBL[{label}]")).ok_or(format!("no label {label}"));
    let mut at = 0;
    while let Some(line) = instructions.get(at) {
        machine.tick()?;
        at += 1;
        if let Some(remark) = line.strip_prefix('!') {
            if remark.len() > 32 {
                return wrong("a long remark", remark);
            }
        } else if let Some(frame) = line.strip_prefix("UFRAME_NUM=") {
            state.user_frame = Some(whole(frame, 0, 9)?);
        } else if let Some(frame) = line.strip_prefix("UTOOL_NUM=") {
            state.tool_frame = Some(whole(frame, 1, 9)?);
        } else if let Some(schedule) = between(line, "PAYLOAD[", "]") {
            state.payload = Some(whole(schedule, 1, 9)?);
        } else if let Some(words) = between(line, "MESSAGE[", "]") {
            if words.is_empty() || words.len() > 24 {
                return wrong("a message that is not shown whole", words);
            }
            machine.say(words);
        } else if *line == "PAUSE" {
            machine.pause();
        } else if let Some(register) = between(line, "PR[", "]=JPOS") {
            state.position_registers.insert(whole(register, 1, 100)?, machine.axes.clone());
        } else if let Some((register, value)) = line.strip_prefix("R[").and_then(|rest| rest.split_once("]=PR[")) {
            let (index, value) = value.split_once(',').ok_or("no element")?;
            let (element, off) = value.split_once(']').ok_or("no element")?;
            let axis = match whole(element, 1, 9)? {
                arm @ 1..=6 => Axis::Arm(arm),
                external => Axis::External(external - 6),
            };
            let joints = state.position_registers.get(&whole(index, 1, 100)?).ok_or("a position register without a value")?;
            let value = joints.get(&axis).ok_or("a position register without this axis")?;
            state.registers.insert(whole(register, 1, 200)?, value - taken_away(off, "")?);
        } else if let Some(rest) = line.strip_prefix("IF R[") {
            let (condition, target) = rest.strip_suffix(']').and_then(|rest| rest.split_once(",JMP LBL[")).ok_or("no jump")?;
            let goto = label(target)?;
            let (register, comparison) = condition.split_once(']').ok_or("no register")?;
            let value = *state.registers.get(&whole(register, 1, 200)?).ok_or("a register without a value")?;
            let is_true = match (comparison.strip_prefix('>'), between(comparison, "<(-", ")")) {
                (Some(most), _) => value > number(most)?,
                (_, Some(least)) => value < -number(least)?,
                _ => return wrong("no comparison", comparison),
            };
            if is_true {
                at = goto;
            }
        } else if let Some((index, speed)) = line.strip_prefix("J P[").and_then(|rest| rest.split_once("] ")) {
            let percent = whole(between(speed, "", "% FINE").ok_or("no percent, or no exact stop")?, 1, 100)?;
            let index = whole(index, 1, 999)?;
            let position = positions.get(&index).ok_or(format!("no P[{index}]"))?;
            if state.user_frame != Some(position.user_frame) || state.tool_frame != Some(position.tool_frame) {
                return wrong("a position of other frames", line);
            }
            if !used.insert(index) {
                return wrong("a position for two moves", line);
            }
            let setup = format!("frame {}, tool {}, load {:?}", position.user_frame, position.tool_frame, state.payload);
            let speed = Speed::Percent(machine.axes.keys().map(|axis| (*axis, percent)).collect());
            machine.go(position.axes.clone(), speed, setup)?;
        } else if let Some(seconds) = between(line, "WAIT ", "(sec)") {
            machine.stand(number(seconds)?);
        } else if let Some(program) = line.strip_prefix("CALL ") {
            let (program, _) = programs.get_key_value(program).ok_or(format!("no program {program}"))?;
            if !called.insert(program) {
                return wrong("called twice", program);
            }
            if run_program(program, programs, state, called, machine)? == Flow::Abort {
                return Ok(Flow::Abort);
            }
        } else if line.starts_with("LBL[") {
        } else if *line == "END" {
            if used.len() != positions.len() {
                return Err("a position that no move goes to".into());
            }
            return Ok(Flow::Return);
        } else if *line == "ABORT" {
            return Ok(Flow::Abort);
        } else {
            return wrong("no instruction", line);
        }
    }
    // A program ends with its last line, too; one that moves must not run into its message.
    if positions.is_empty() { Ok(Flow::Return) } else { Err("the program runs off its end".into()) }
}

/// Programs. Registers have numbers, not names.
pub(super) fn global_names(files: &[ProgramFile]) -> Vec<String> {
    let name = |file: &ProgramFile| {
        listing(file).expect("a program");
        file.name.trim_end_matches(".LS").to_owned()
    };
    files.iter().map(name).collect()
}
