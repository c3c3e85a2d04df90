//! ABB's RAPID.

use std::collections::BTreeMap;

use host_cal::robot_link::program::ProgramFile;

use super::machine::Speed;
use super::{Axis, Complaint, Machine, between, is_name, number, quoted, wrong};

/// Characters of a name, and of a text, of S4 controllers.
const NAME: usize = 16;
const TEXT: usize = 80;
const HEAD: &str = "%%%\r\n  VERSION:1\r\n  LANGUAGE:ENGLISH\r\n%%%\r\n\r\n";

#[derive(Default)]
struct Module<'a> {
    name: &'a str,
    targets: BTreeMap<&'a str, BTreeMap<Axis, f64>>,
    speeds: BTreeMap<&'a str, &'a str>,
    routines: BTreeMap<&'a str, Routine<'a>>,
}

#[derive(Default)]
struct Routine<'a> {
    is_local: bool,
    /// Type and name of each.
    parameters: Vec<(&'a str, &'a str)>,
    body: Vec<&'a str>,
}

fn module(file: &ProgramFile) -> Result<Module<'_>, Complaint> {
    if file.text.matches('\n').count() != file.text.matches("\r\n").count() {
        return Err("a line does not end as on an S4's disk".into());
    }
    let name = file.name.strip_suffix(".mod").filter(|name| is_name(name, 8)).ok_or("no module")?;
    let lines =
        between(&file.text, &format!("{HEAD}MODULE {name}\r\n"), "ENDMODULE\r\n").ok_or("no module of the file's name")?;
    let mut module = Module { name, ..Module::default() };
    let mut lines = lines.lines().filter(|line| !line.trim_start().starts_with("! "));
    while let Some(line) = lines.next() {
        let line = line.strip_prefix("  ").ok_or("not indented")?;
        if let Some(rest) = between(line, "LOCAL CONST jointtarget ", ";") {
            let (target, value) = rest.split_once(":=").ok_or("no value")?;
            if !is_name(target, NAME) || module.targets.insert(target, joint_target(value)?).is_some() {
                return wrong("no name, or a double one", target);
            }
        } else if let Some(rest) = between(line, "LOCAL CONST speeddata ", ";") {
            let (speed, value) = rest.split_once(":=").ok_or("no value")?;
            module.speeds.insert(speed, value);
        } else {
            let (is_local, rest) = line.strip_prefix("LOCAL ").map_or((false, line), |rest| (true, rest));
            let (head, end) = match (rest.strip_prefix("PROC "), rest.strip_prefix("FUNC bool ")) {
                (Some(head), _) => (head, "  ENDPROC"),
                (_, Some(head)) => (head, "  ENDFUNC"),
                _ => return wrong("no declaration", line),
            };
            let (routine, parameters) = head.strip_suffix(')').and_then(|head| head.split_once('(')).ok_or("no parameters")?;
            let parameters = parameters.split(',').filter(|parameter| !parameter.is_empty());
            let parameters = parameters.map(|parameter| parameter.split_once(' ').ok_or("no type")).collect::<Result<_, _>>()?;
            let mut body = Vec::new();
            loop {
                match lines.next() {
                    Some(line) if line == end => break,
                    Some(line) => body.push(line.trim_start()),
                    None => return wrong("no end of", routine),
                }
            }
            if !is_name(routine, NAME) || module.routines.insert(routine, Routine { is_local, parameters, body }).is_some() {
                return wrong("no name, or a double one", routine);
            }
        }
    }
    Ok(module)
}

/// `[[six axes],[six external ones]]`, 9E9 where there is none.
fn joint_target(text: &str) -> Result<BTreeMap<Axis, f64>, Complaint> {
    let (arm, external) = between(text, "[[", "]]").and_then(|rest| rest.split_once("],[")).ok_or("no joint target")?;
    let arm = arm.split(',').map(number).collect::<Result<Vec<f64>, _>>()?;
    let external: Vec<&str> = external.split(',').collect();
    if [arm.len(), external.len()] != [6, 6] {
        return wrong("not six axes and six", text);
    }
    let mut axes: BTreeMap<Axis, f64> = (1..).map(Axis::Arm).zip(arm).collect();
    for (index, value) in (1..).zip(external).filter(|(_, value)| *value != "9E9") {
        axes.insert(Axis::External(index), number(value)?);
    }
    Ok(axes)
}

/// Of a jointtarget, by the names of its components.
fn component(axes: &BTreeMap<Axis, f64>, name: &str) -> Result<f64, Complaint> {
    let external = ["a", "b", "c", "d", "e", "f"];
    let axis = match (name.strip_prefix("robax.rax_"), name.strip_prefix("extax.eax_")) {
        (Some(number), _) => Axis::Arm(number.parse().map_err(|_| format!("no axis: `{name}`"))?),
        (_, Some(letter)) => Axis::External(1 + external.iter().position(|other| *other == letter).ok_or("no axis")?),
        _ => return wrong("no axis", name),
    };
    axes.get(&axis).copied().ok_or(format!("there is no {name}"))
}

enum Flow {
    Return,
    Exit,
}

pub(super) fn run(files: &[ProgramFile], machine: &mut Machine) -> Result<(), Complaint> {
    let [file] = files else { return Err("not one file".into()) };
    let module = module(file)?;
    let main = format!("{}_run", module.name);
    let main = module.routines.get(main.as_str()).filter(|routine| !routine.is_local).ok_or("no routine to run")?;
    // An arm of fewer axes is not asked for those it has not.
    let has = |target: &BTreeMap<Axis, f64>| {
        target.iter().filter(|(axis, _)| machine.axes.contains_key(axis)).map(|(axis, value)| (*axis, *value)).collect()
    };
    let targets: BTreeMap<&str, BTreeMap<Axis, f64>> = module.targets.iter().map(|(name, target)| (*name, has(target))).collect();
    if let Some((name, target)) = module
        .targets
        .iter()
        .find(|(_, target)| target.keys().any(|axis| matches!(axis, Axis::External(_)) && !machine.axes.contains_key(axis)))
    {
        return Err(format!("{name} moves an axis that is not there: {target:?}"));
    }
    for line in &main.body {
        machine.tick()?;
        if let Some(words) = between(line, "TPWrite ", ";") {
            machine.say(quoted(words, TEXT)?);
        } else if *line == "Stop;" {
            machine.pause();
        } else if let Some(seconds) = between(line, "WaitTime\\InPos,", ";") {
            machine.stand(number(seconds)?);
        } else if let Some((routine, arguments)) = line.strip_suffix(';').and_then(|call| call.split_once(' ')) {
            let routine = module.routines.get(routine).ok_or_else(|| format!("no routine: `{line}`"))?;
            let [before, goal, seconds] = arguments.split(',').collect::<Vec<_>>()[..] else {
                return wrong("not three arguments", line);
            };
            let target = |name: &str| targets.get(name).ok_or(format!("no target {name}"));
            let types: Vec<&str> = routine.parameters.iter().map(|(kind, _)| *kind).collect();
            if types != ["jointtarget", "jointtarget", "num"] {
                return wrong("other parameters", line);
            }
            let places = BTreeMap::from([(routine.parameters[0].1, target(before)?), (routine.parameters[1].1, target(goal)?)]);
            let numbers = BTreeMap::from([(routine.parameters[2].1, number(seconds)?)]);
            if matches!(go(&module, routine, &places, &numbers, machine)?, Flow::Exit) {
                return Ok(());
            }
        } else {
            return wrong("no statement", line);
        }
    }
    Ok(())
}

/// The routine that moves.
fn go(
    module: &Module<'_>,
    routine: &Routine<'_>,
    places: &BTreeMap<&str, &BTreeMap<Axis, f64>>,
    numbers: &BTreeMap<&str, f64>,
    machine: &mut Machine,
) -> Result<Flow, Complaint> {
    let mut is_off = false;
    let mut is_open = false;
    for line in &routine.body {
        machine.tick()?;
        if let Some(call) = between(line, "IF NOT ", ") THEN") {
            let (function, place) = call.split_once('(').ok_or("no call")?;
            let function = module.routines.get(function).ok_or("no function")?;
            is_off = is_near(function, places.get(place).ok_or("no place")?, machine)?;
            is_open = true;
        } else if *line == "ENDIF" {
            if !is_open {
                return Err("ENDIF without IF".into());
            }
            (is_off, is_open) = (false, false);
        } else if is_off {
        } else if let Some(words) = between(line, "TPWrite ", ";") {
            machine.say(quoted(words, TEXT)?);
        } else if *line == "EXIT;" {
            return Ok(Flow::Exit);
        } else if let Some(arguments) = between(line, "MoveAbsJ ", ";") {
            let [goal, speed, "fine", tool] = arguments.split(',').collect::<Vec<_>>()[..] else {
                return wrong("no exact stop", line);
            };
            let goal = goal.strip_suffix("\\NoEOffs").and_then(|goal| places.get(goal)).ok_or("no goal")?;
            let (speed, seconds) = speed.split_once("\\T:=").ok_or("no time")?;
            let speed = module.speeds.get(speed).ok_or("no speed")?;
            let seconds = numbers.get(seconds).ok_or("no seconds")?;
            machine.go((*goal).clone(), Speed::Seconds(*seconds), format!("{tool} {speed}"))?;
        } else {
            return wrong("no statement", line);
        }
    }
    if is_open { Err("IF without ENDIF".into()) } else { Ok(Flow::Return) }
}

fn is_near(function: &Routine<'_>, place: &BTreeMap<Axis, f64>, machine: &mut Machine) -> Result<bool, Complaint> {
    let [("jointtarget", place_name)] = function.parameters[..] else { return Err("other parameters".into()) };
    let mut now: Option<(&str, BTreeMap<Axis, f64>)> = None;
    let mut declared = None;
    for line in &function.body {
        machine.tick()?;
        if let Some(name) = between(line, "VAR jointtarget ", ";") {
            declared = Some(name);
        } else if let Some(name) = line.strip_suffix(":=CJointT();") {
            if declared != Some(name) {
                return wrong("not declared", name);
            }
            now = Some((name, machine.axes.clone()));
        } else if let Some(comparison) = between(line, "IF ABS(", " RETURN FALSE;") {
            let (now_name, now) = now.as_ref().ok_or("joints are not looked at before they are compared")?;
            let (difference, tolerance) = comparison.split_once(")>").ok_or("no comparison")?;
            let (a, b) = difference.split_once('-').ok_or("no difference")?;
            let a = a.strip_prefix(&format!("{now_name}.")).ok_or("not of now")?;
            let b = b.strip_prefix(&format!("{place_name}.")).ok_or("not of the place")?;
            if (component(now, a)? - component(place, b)?).abs() > number(tolerance)? {
                return Ok(false);
            }
        } else if *line == "RETURN TRUE;" {
            return Ok(true);
        } else {
            return wrong("no statement", line);
        }
    }
    Err("the function returns nothing".into())
}

/// The module and what is not LOCAL in it.
pub(super) fn global_names(files: &[ProgramFile]) -> Vec<String> {
    let names = files.iter().flat_map(|file| {
        let module = module(file).expect("a module");
        let routines = module.routines.iter().filter(|(_, routine)| !routine.is_local).map(|(name, _)| (*name).to_owned());
        std::iter::once(module.name.to_owned()).chain(routines).collect::<Vec<_>>()
    });
    names.collect()
}
