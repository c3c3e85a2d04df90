//! The dashboard server: a line for a line.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;

use super::ur::Shared;

const TOO_EARLY: &str =
    "Cannot unlock protective stop until 5s after occurrence. Always inspect cause of protective stop before unlocking";

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
            let reply = match line.trim_end() {
                "close safety popup" => "closing safety popup",
                "unlock protective stop" if shared.unlock() => "Protective stop releasing",
                "unlock protective stop" => TOO_EARLY,
                other => {
                    shared.problem(format!("the dashboard does not know `{other}`"));
                    "could not understand"
                }
            };
            let _ = stream.write_all(format!("{reply}\n").as_bytes());
        }
    }
}
