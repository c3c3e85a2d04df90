//! KUKA's KRL.

use std::collections::BTreeMap;

use host_cal::robot_link::program::ProgramFile;

use super::machine::Speed;
use super::{Axis, Complaint, Machine, between, is_name, number, quoted, taken_away, whole, wrong};

/// Of a message.
const MESSAGE: usize = 80;

fn module(file: &ProgramFile) -> Result<(&str, Vec<&str>), Complaint> {
    if file.text.matches('\n').count() != file.text.matches("\r\n").count() {
        return Err("a line does not end as Windows has it".into());
    }
    let name = file.name.strip_suffix(".src").filter(|name| is_name(name, 24)).ok_or("no module")?;
    let head = format!("&ACCESS RVP\r\n&REL 1\r\nDEF {name}( )\r\n");
    let lines = between(&file.text, &head, "END\r\n").ok_or("no program of the file's name")?;
    Ok((name, lines.lines().filter(|line| !line.starts_with("; ")).collect()))
}

fn axis(text: &str) -> Result<Axis, Complaint> {
    match (text.strip_prefix('A'), text.strip_prefix('E')) {
        (Some(number), _) => Ok(Axis::Arm(whole(number, 1, 6)?)),
        (_, Some(number)) => Ok(Axis::External(whole(number, 1, 6)?)),
        _ => wrong("no axis", text),
    }
}

/// What moves depend on.
#[derive(Default)]
struct State<'a> {
    variables: BTreeMap<&'a str, Option<bool>>,
    /// As they were assigned.
    settings: BTreeMap<&'a str, &'a str>,
    velocities: BTreeMap<Axis, usize>,
    has_coincided: bool,
}

pub(super) fn run(files: &[ProgramFile], machine: &mut Machine) -> Result<(), Complaint> {
    let [file] = files else { return Err("not one file".into()) };
    let (_, lines) = module(file)?;
    let mut state = State::default();
    // For each IF that is open, whether what stands there is carried out.
    let mut branches: Vec<bool> = Vec::new();
    for line in lines {
        machine.tick()?;
        let is_on = branches.iter().all(|is_on| *is_on);
        match line {
            "ENDIF" => drop(branches.pop().ok_or("ENDIF without IF")?),
            "ELSE" => {
                let branch = branches.last_mut().ok_or("ELSE without IF")?;
                *branch = !*branch;
            }
            line if line.starts_with("IF ") => {
                let condition = between(line, "IF ", " THEN").ok_or("no THEN")?;
                branches.push(is_on && holds(condition, &state, machine)?);
            }
            line if is_on => carry_out(line, &mut state, machine)?,
            _ => {}
        }
    }
    if branches.is_empty() { Ok(()) } else { Err("IF without ENDIF".into()) }
}

fn holds(condition: &str, state: &State<'_>, machine: &Machine) -> Result<bool, Complaint> {
    if let Some(value) = state.variables.get(condition) {
        return value.ok_or(format!("{condition} has no value"));
    }
    let (off, tolerance) =
        condition.strip_prefix("ABS($AXIS_ACT.").and_then(|rest| rest.split_once(")>")).ok_or("no condition")?;
    let (name, off) = off.split_at(2);
    Ok((machine.value(axis(name)?)? - taken_away(off, "")?).abs() > number(tolerance)?)
}

fn carry_out<'a>(line: &'a str, state: &mut State<'a>, machine: &mut Machine) -> Result<(), Complaint> {
    if let Some(name) = line.strip_prefix("DECL BOOL ") {
        state.variables.insert(name, None);
    } else if line == "BAS(#INITMOV,0)" {
        state.settings.insert("init", "");
    } else if line == "HALT" {
        machine.pause();
    } else if line == "PTP $AXIS_ACT" {
        state.has_coincided = true;
    } else if let Some(goal) = between(line, "PTP {", "}") {
        if !state.has_coincided {
            return Err("the coincidence run goes somewhere".into());
        }
        let mut to = BTreeMap::new();
        for component in goal.split(',') {
            let (name, value) = component.split_once(' ').ok_or("no value")?;
            if to.insert(axis(name)?, number(value)?).is_some() {
                return wrong("twice", component);
            }
        }
        let setup = format!("{:?}", state.settings);
        machine.go(to, Speed::Percent(state.velocities.clone()), setup)?;
    } else if let Some(seconds) = line.strip_prefix("WAIT SEC ") {
        machine.stand(number(seconds)?);
    } else if let Some(words) = between(line, "MsgNotify(", ")") {
        machine.say(quoted(words, MESSAGE)?);
    } else if let Some((name, value)) = line.split_once('=') {
        let group = |kind: &str| Some((between(name, &format!("${kind}["), "]")?, kind.ends_with("EXTAX")));
        if let Some(variable) = state.variables.get_mut(name) {
            *variable = Some(match value {
                "TRUE" => true,
                "FALSE" => false,
                _ => return wrong("no truth", value),
            });
        } else if let Some((number, is_external)) = group("VEL_AXIS").or_else(|| group("VEL_EXTAX")) {
            let number = whole(number, 1, 6)?;
            let axis = if is_external { Axis::External(number) } else { Axis::Arm(number) };
            state.velocities.insert(axis, whole(value, 1, 100)?);
        } else if let Some((number, _)) = group("ACC_AXIS").or_else(|| group("ACC_EXTAX")) {
            whole(number, 1, 6)?;
            whole(value, 1, 100)?;
            state.settings.insert(name, value);
        } else if ["$ADVANCE", "$TOOL", "$LOAD", "$BASE"].contains(&name) {
            state.settings.insert(name, value);
        } else {
            return wrong("no variable", name);
        }
    } else {
        return wrong("no statement", line);
    }
    Ok(())
}

/// Without a data list that is PUBLIC, a module has one name.
pub(super) fn global_names(files: &[ProgramFile]) -> Vec<String> {
    let name = |file| {
        let (name, lines) = module(file).expect("a module");
        assert!(lines.iter().all(|line| !line.contains("GLOBAL")));
        name.to_owned()
    };
    files.iter().map(name).collect()
}
