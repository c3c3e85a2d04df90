//! VAL II.

use std::collections::{BTreeMap, BTreeSet};

use host_cal::robot_link::program::ProgramFile;

use super::machine::Speed;
use super::{Axis, Complaint, Machine, between, is_name, number, quoted, taken_away, whole, wrong};

/// Of a terminal.
const COLUMNS: usize = 80;
/// Characters of a name.
const NAME: usize = 6;

struct Listing<'a> {
    name: &'a str,
    /// Label, if there is one, and instruction.
    steps: Vec<(Option<usize>, &'a str)>,
}

fn listing(file: &ProgramFile) -> Result<Listing<'_>, Complaint> {
    let mut lines = file.text.lines();
    let name = lines.next().and_then(|line| between(line, ".PROGRAM ", "()")).ok_or("no .PROGRAM")?;
    if !is_name(name, NAME) || file.name != format!("{name}.PG") {
        return wrong("not the file's program", name);
    }
    let mut steps = Vec::new();
    for line in lines.by_ref().take_while(|line| *line != ".END") {
        if line.len() > COLUMNS {
            return wrong("longer than a terminal's line", line);
        }
        match line.split_at_checked(2) {
            Some((_, _)) if line.starts_with("; ") => {}
            Some(("  ", step)) => steps.push((None, step)),
            Some((label, step)) => {
                steps.push((Some(whole(label, 1, 99)?), step.strip_prefix(' ').ok_or("no space after a label")?))
            }
            None => return wrong("no line of a program", line),
        }
    }
    if !file.text.ends_with("\n.END\n") || lines.next().is_some() {
        return Err("the file does not end with the program".into());
    }
    Ok(Listing { name, steps })
}

pub(super) fn run(files: &[ProgramFile], machine: &mut Machine) -> Result<(), Complaint> {
    let [file] = files else { return Err("not one file".into()) };
    let Listing { steps, .. } = listing(file)?;
    let target = |label: &str| -> Result<usize, Complaint> {
        let label = whole(label, 1, 99)?;
        steps.iter().position(|(other, _)| *other == Some(label)).ok_or(format!("no label {label}"))
    };
    let mut percent = None;
    let mut is_fine = false;
    let mut points = BTreeMap::<&str, BTreeMap<Axis, f64>>::new();
    let mut arrays = BTreeMap::<&str, Vec<f64>>::new();
    let mut at = 0;
    while let Some((_, step)) = steps.get(at) {
        machine.tick()?;
        at += 1;
        let (word, rest) = step.split_once(' ').unwrap_or((step, ""));
        match word {
            "SPEED" => percent = Some(whole(rest.strip_suffix(" ALWAYS").ok_or("for one move only")?, 1, 100)?),
            "FINE" if rest == "ALWAYS" => is_fine = true,
            "TYPE" => machine.say(quoted(rest, COLUMNS)?),
            "PAUSE" if rest.is_empty() => machine.pause(),
            "HERE" => {
                let name = rest.strip_prefix('#').filter(|name| is_name(name, NAME)).ok_or("no precision point")?;
                points.insert(name, machine.axes.clone());
            }
            "DECOMPOSE" => {
                let (array, point) = rest.split_once("[1] = #").ok_or("no array and precision point")?;
                let point = points.get(point).ok_or("a precision point without a value")?;
                if !is_name(array, NAME) {
                    return wrong("no name of an array", array);
                }
                arrays.insert(array, point.values().copied().collect());
            }
            "IF" => {
                let (off, rest) = rest.strip_prefix("ABS(").and_then(|rest| rest.split_once(") > ")).ok_or("no condition")?;
                let (tolerance, label) = rest.split_once(" GOTO ").ok_or("no label")?;
                let (array, rest) = off.split_once('[').ok_or("no array")?;
                let (index, off) = rest.split_once(']').ok_or("no index")?;
                let value =
                    arrays.get(array).ok_or("an array without values")?.get(whole(index, 1, 6)? - 1).ok_or("no such value")?;
                let goto = target(label)?;
                if (value - taken_away(off, "")?).abs() > number(tolerance)? {
                    at = goto;
                }
            }
            "MOVE" => {
                let values = between(rest, "#PPOINT(", ")").ok_or("a goal that is a variable")?;
                let values = values.split(',').map(number).collect::<Result<Vec<f64>, _>>()?;
                let to = (1..).map(Axis::Arm).zip(values).collect();
                if steps.get(at).is_none_or(|(_, step)| *step != "BREAK") || !is_fine {
                    return Err("a move without an exact stop".into());
                }
                at += 1;
                let percent = percent.ok_or("a move at no speed")?;
                let speed = Speed::Percent(machine.axes.keys().map(|axis| (*axis, percent)).collect());
                machine.go(to, speed, "")?;
            }
            "DELAY" => machine.stand(number(rest)?),
            "GOTO" => at = target(rest)?,
            "STOP" if rest.is_empty() => return Ok(()),
            _ => return wrong("no instruction", step),
        }
    }
    Err("the program runs off its end".into())
}

/// All programs and variables are global.
pub(super) fn global_names(files: &[ProgramFile]) -> Vec<String> {
    let names = files.iter().flat_map(|file| {
        let Listing { name, steps } = listing(file).expect("a program");
        let mut names = BTreeSet::from([name.to_owned()]);
        for (_, step) in steps {
            // Words that are no keywords, numbers or texts.
            let code = step.split('"').step_by(2).collect::<String>();
            let words = code.split(|c: char| !(c.is_ascii_alphanumeric() || c == '#')).map(str::to_owned);
            let known = [
                "SPEED",
                "ALWAYS",
                "FINE",
                "TYPE",
                "PAUSE",
                "HERE",
                "DECOMPOSE",
                "IF",
                "ABS",
                "GOTO",
                "MOVE",
                "#PPOINT",
                "BREAK",
                "DELAY",
                "STOP",
            ];
            names
                .extend(words.filter(|word| word.contains(|c: char| c.is_ascii_alphabetic()) && !known.contains(&word.as_str())));
        }
        names
    });
    names.collect()
}
