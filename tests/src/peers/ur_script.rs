//! The secondary interface: takes programs, and sends the robot's state ten times a second. A connection that was made in local
//! control ignores programs as long as it lasts; one that was made in remote control ends with it.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use super::JOINTS;
use super::ur::{Command, Shared};

pub(super) fn serve(shared: &Shared, mut stream: TcpStream) {
    let (drops, is_deaf) = {
        let world = shared.world();
        (world.drops, !world.is_remote)
    };
    let (mut heard, mut told) = (String::new(), Instant::now());
    while !shared.is_ended() && shared.world().drops == drops {
        if !is_deaf && !shared.world().is_remote {
            return;
        }
        if told.elapsed() > Duration::from_millis(100) {
            told = Instant::now();
            // A robot state message without sub-packages: its size and its type.
            if stream.write_all(&[0, 0, 0, 5, 16]).is_err() {
                return;
            }
        }
        let mut bytes = [0; 512];
        match stream.read(&mut bytes) {
            Ok(0) => return,
            Ok(count) => heard.push_str(&String::from_utf8_lossy(&bytes[..count])),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(_) => return,
        }
        while let Some(program) = whole_program(&mut heard) {
            if is_deaf {
                continue;
            }
            match parse(&program) {
                Ok(command) => shared.run(&program, command),
                Err(problem) => shared.problem(format!("{problem} in `{program}`")),
            }
        }
    }
}

/// Cuts off the first program: a `def` up to its `end`, or a line.
fn whole_program(heard: &mut String) -> Option<String> {
    let end = if heard.starts_with("def ") { heard.find("\nend\n")? + "\nend\n".len() } else { heard.find('\n')? + 1 };
    Some(heard.drain(..end).collect())
}

/// Understands exactly what URScript's manual allows of the few functions that a link needs.
pub(super) fn parse(program: &str) -> Result<Command, &'static str> {
    if let Some(arguments) = call(program.trim_end_matches('\n'), "stopj") {
        let a: f64 = arguments.parse().map_err(|_| "no deceleration")?;
        return if a > 0.0 { Ok(Command::StopJ) } else { Err("no deceleration above zero") };
    }
    let lines: Vec<&str> = program.lines().collect();
    let [head, body, "end"] = lines[..] else { return Err("no `def`, one line, `end`") };
    let name = head.strip_prefix("def ").and_then(|rest| rest.strip_suffix("():")).ok_or("no `def name():`")?;
    let is_name = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if !is_name {
        return Err("no name");
    }
    let arguments = call(body.trim_start(), "movej").ok_or("no `movej(…)`")?;
    let (joints, rest) =
        arguments.strip_prefix('[').and_then(|rest| rest.split_once(']')).ok_or("no list of joints in brackets")?;
    let values: Vec<f64> =
        joints.split(',').map(|value| value.trim().parse()).collect::<Result<_, _>>().map_err(|_| "no number")?;
    let q_rad: [f64; JOINTS] = values.try_into().map_err(|_| "not six joints")?;
    let [a, v] = rest.strip_prefix(", a=").and_then(|rest| rest.split_once(", v=")).map(|(a, v)| [a, v]).ok_or("no a=, v=")?;
    let number = |text: &str| text.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or("no number");
    Ok(Command::MoveJ { q_rad, a_rad_s2: number(a)?, v_rad_s: number(v)? })
}

fn call<'a>(line: &'a str, function: &str) -> Option<&'a str> {
    line.strip_prefix(function)?.strip_prefix('(')?.strip_suffix(')')
}
