//! Universal Robots' URScript.

use host_cal::robot_link::program::ProgramFile;

use super::machine::Speed;
use super::{Axis, Complaint, Machine, between, is_name, number, quoted, taken_away, whole, wrong};

fn body(file: &ProgramFile) -> Result<(&str, Vec<&str>), Complaint> {
    let (head, rest) = file.text.split_once('\n').ok_or("one line")?;
    let name = between(head, "def ", "():").ok_or("no function")?;
    if !is_name(name, 40) || file.name != format!("{name}.script") {
        return wrong("not the file's program", name);
    }
    Ok((name, rest.strip_suffix("\nend\n").ok_or("no end")?.lines().collect()))
}

pub(super) fn run(files: &[ProgramFile], machine: &mut Machine) -> Result<(), Complaint> {
    let [file] = files else { return Err("not one file".into()) };
    let (name, lines) = body(file)?;
    let mut q: Option<Vec<f64>> = None;
    let mut lines = lines.into_iter();
    while let Some(line) = lines.next() {
        machine.tick()?;
        let line = line.strip_prefix("  ").ok_or_else(|| format!("not indented: `{line}`"))?;
        if line.starts_with("# ") {
        } else if line.starts_with("popup(") {
            popup(line, name, "", machine)?;
        } else if line == "local q = get_actual_joint_positions()" {
            q = Some(machine.axes.values().map(|value| value.to_radians()).collect());
        } else if let Some(condition) = between(line, "if ", ":") {
            let q = q.as_ref().ok_or("joints are not looked at before they are compared")?;
            let mut holds = false;
            for part in condition.split(" or ") {
                let (off, tolerance) =
                    part.strip_prefix("norm(q[").and_then(|rest| rest.split_once(") > ")).ok_or("no comparison")?;
                let (index, off) = off.split_once(']').ok_or("no index")?;
                let q_rad = q.get(whole(index, 0, 5)?).ok_or("no such joint")?;
                holds |= (q_rad - taken_away(off, "")?).abs() > number(tolerance)?;
            }
            let (mut block, mut is_over) = (Vec::new(), false);
            for line in lines.by_ref() {
                match line.strip_prefix("    ") {
                    Some(line) => block.push(line),
                    None if line == "  end" => {
                        is_over = true;
                        break;
                    }
                    None => return wrong("neither in the block nor its end", line),
                }
            }
            let ([shown, "halt"], true) = (&block[..], is_over) else { return Err("no block that halts".into()) };
            if holds {
                popup(shown, name, "error=True, ", machine)?;
                return Ok(());
            }
        } else if let Some(arguments) = between(line, "movej([", ")") {
            let (joints, rest) = arguments.split_once("], a=").ok_or("no joints and acceleration")?;
            let (a, v) = rest.split_once(", v=").ok_or("no speed, or a blend")?;
            let values =
                joints.split(", ").map(|value| Ok(number(value)?.to_degrees())).collect::<Result<Vec<f64>, Complaint>>()?;
            let to = (1..).map(Axis::Arm).zip(values).collect();
            machine.go(to, Speed::Leading { rad_s: number(v)?, rad_s2: number(a)? }, "")?;
        } else if let Some(seconds) = between(line, "sleep(", ")") {
            machine.stand(number(seconds)?);
        } else {
            return wrong("no statement", line);
        }
    }
    Ok(())
}

/// A popup that waits.
fn popup(line: &str, name: &str, kind: &str, machine: &mut Machine) -> Result<(), Complaint> {
    let end = format!(", title=\"{name}\", {kind}blocking=True)");
    let words = between(line, "popup(", &end).ok_or_else(|| format!("no popup that waits: `{line}`"))?;
    machine.say(quoted(words, 500)?);
    machine.pause();
    Ok(())
}

/// What is inside of the function is local to it.
pub(super) fn global_names(files: &[ProgramFile]) -> Vec<String> {
    let is_local = |line: &str| !line.contains("global ");
    let name = |file| {
        let (name, lines) = body(file).expect("a program");
        assert!(lines.iter().all(|line| is_local(line)));
        name.to_owned()
    };
    files.iter().map(name).collect()
}
