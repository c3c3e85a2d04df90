//! The dashboard server: a line for a line.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;

use super::ur::Shared;

const TOO_EARLY: &str =
    "Cannot unlock protective stop until 5s after occurrence. Always inspect cause of protective stop before unlocking";
const NOT_REMOTE: &str =
    "Command is not allowed due to safety reasons, please switch robot to Remote Control mode and reconnect to port 29999";

pub(super) fn serve(shared: &Shared, mut stream: TcpStream) {
    let drops = shared.world().drops;
    let _ = stream.write_all(b"Connected: Universal Robots Dashboard Server\n");
    let mut heard = String::new();
    while !shared.is_ended() && shared.world().drops == drops {
        let mut bytes = [0; 128];
        match stream.read(&mut bytes) {
            Ok(0) => return,
            Ok(count) => heard.push_str(&String::from_utf8_lossy(&bytes[..count])),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(_) => return,
        }
        while let Some(end) = heard.find('\n') {
            let line: String = heard.drain(..=end).collect();
            let reply = answer(shared, line.trim_end());
            let _ = stream.write_all(format!("{reply}\n").as_bytes());
        }
    }
}

/// Questions are answered always, orders obeyed in remote control only.
fn answer(shared: &Shared, line: &str) -> String {
    shared.note_asked(line);
    let is_remote = shared.world().is_remote;
    match line {
        "is in remote control" if shared.options.tells_control => is_remote.to_string(),
        "is in remote control" => format!("could not understand: '{line}'"),
        _ if !is_remote => NOT_REMOTE.to_owned(),
        "close safety popup" => "closing safety popup".to_owned(),
        "unlock protective stop" if shared.unlock() => "Protective stop releasing".to_owned(),
        "unlock protective stop" => TOO_EARLY.to_owned(),
        other => {
            shared.problem(format!("the dashboard does not know `{other}`"));
            format!("could not understand: '{other}'")
        }
    }
}
