//! RTDE, strict about order, sizes and names.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use super::ur::Shared;

/// The fields that this controller knows, with their types.
const KNOWN: [(&str, &str); 8] = [
    ("actual_q", "VECTOR6D"),
    ("actual_qd", "VECTOR6D"),
    ("target_q", "VECTOR6D"),
    ("robot_mode", "INT32"),
    ("safety_mode", "INT32"),
    ("runtime_state", "UINT32"),
    ("speed_scaling", "DOUBLE"),
    ("target_speed_fraction", "DOUBLE"),
];
const RECIPE: u8 = 7;

pub(super) fn serve(shared: &Shared, mut stream: TcpStream) {
    let drops = shared.world().drops;
    if let Err(problem) = talk(shared, &mut stream, drops) {
        shared.problem(problem);
    }
}

/// Ends with the connection; what the client did against the protocol is the error.
fn talk(shared: &Shared, stream: &mut TcpStream, drops: u32) -> Result<(), String> {
    let is_over = || shared.is_ended() || shared.world().drops != drops;
    let Some(version) = take(stream, b'V', is_over)? else { return Ok(()) };
    if version != [0, 2] {
        return Err(format!("protocol version {version:?}"));
    }
    tell(shared, stream, b'V', &[1]);
    let Some(outputs) = take(stream, b'O', is_over)? else { return Ok(()) };
    let (rate, names) = outputs.split_at_checked(8).ok_or("outputs without a rate")?;
    let rate_hz = f64::from_be_bytes(rate.try_into().unwrap());
    if !(1.0..=shared.options.rate_max_hz).contains(&rate_hz) {
        return Err(format!("a rate of {rate_hz} Hz"));
    }
    let names: Vec<&str> = std::str::from_utf8(names).map_err(|_| "names that are no text")?.split(',').collect();
    let kind = |name: &&str| KNOWN.iter().find(|(known, _)| known == name).map_or("NOT_FOUND", |(_, kind)| kind);
    let kinds: Vec<&str> = names.iter().map(kind).collect();
    tell(shared, stream, b'O', &[&[RECIPE], kinds.join(",").as_bytes()].concat());
    if kinds.contains(&"NOT_FOUND") {
        return Err(format!("a name that is not known among {names:?}"));
    }
    let Some(start) = take(stream, b'S', is_over)? else { return Ok(()) };
    if !start.is_empty() {
        return Err("a start with a payload".into());
    }
    tell(shared, stream, b'S', &[1]);
    let mut due = Instant::now();
    while !is_over() {
        due += Duration::from_secs_f64(1.0 / rate_hz);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        let (is_silent, is_garbled, text) = {
            let mut world = shared.world();
            (world.is_silent, world.is_garbled, world.text.take())
        };
        let mut is_heard = true;
        if let Some(text) = text {
            let source = "Safety";
            let payload = [&[text.len() as u8], text.as_bytes(), &[source.len() as u8], source.as_bytes(), &[1]].concat();
            is_heard &= tell(shared, stream, b'M', &payload);
        }
        if is_garbled {
            is_heard &= stream.write_all(b"\x00\x01\xff\xfe\x00HTTP/1.1 400").is_ok();
        } else if !is_silent {
            is_heard &= tell(shared, stream, b'U', &data(shared, &names));
        }
        let mut bytes = [0; 64];
        match stream.read(&mut bytes) {
            Ok(0) => is_heard = false,
            Ok(_) => return Err("something after the start".into()),
            Err(_) => {}
        }
        if !is_heard {
            break;
        }
    }
    Ok(())
}

fn data(shared: &Shared, names: &[&str]) -> Vec<u8> {
    let now = Instant::now();
    let world = shared.world();
    let arm = *shared.arm.lock().unwrap();
    let mut claimed = arm.at(now);
    claimed[0] += world.claim_offset_rad;
    let doubles = |values: [f64; 6]| values.iter().flat_map(|value| value.to_be_bytes()).collect::<Vec<u8>>();
    let mut payload = vec![RECIPE];
    for name in names {
        payload.extend(match *name {
            "actual_qd" => doubles(arm.speed_at(now)),
            "robot_mode" => world.robot_mode.to_be_bytes().to_vec(),
            "safety_mode" => world.safety_mode.to_be_bytes().to_vec(),
            "runtime_state" => world.runtime_state().to_be_bytes().to_vec(),
            "speed_scaling" => world.limiter.to_be_bytes().to_vec(),
            "target_speed_fraction" => world.slider.to_be_bytes().to_vec(),
            _ => doubles(claimed),
        });
    }
    payload
}

/// Reads the package that has to come next; `None` when the client has gone.
fn take(stream: &mut TcpStream, kind: u8, is_over: impl Fn() -> bool) -> Result<Option<Vec<u8>>, String> {
    let Some(head) = read_exactly(stream, 3, &is_over) else { return Ok(None) };
    let size = usize::from(u16::from_be_bytes([head[0], head[1]]));
    if head[2] != kind || size < 3 {
        return Err(format!("package {} of {size} bytes where {} was due", char::from(head[2]), char::from(kind)));
    }
    Ok(read_exactly(stream, size - 3, &is_over))
}

fn read_exactly(stream: &mut TcpStream, count: usize, is_over: impl Fn() -> bool) -> Option<Vec<u8>> {
    let mut bytes = vec![0; count];
    let mut filled = 0;
    while filled < count {
        match stream.read(&mut bytes[filled..]) {
            Ok(0) => return None,
            Ok(more) => filled += more,
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) && !is_over() => {}
            Err(_) => return None,
        }
    }
    Some(bytes)
}

/// Sends a package; whether the client still takes it.
fn tell(shared: &Shared, stream: &mut TcpStream, kind: u8, payload: &[u8]) -> bool {
    let size = (3 + payload.len()) as u16;
    let package = [&size.to_be_bytes(), &[kind][..], payload].concat();
    let piece = if shared.options.is_split { 7 } else { package.len() };
    package.chunks(piece).all(|piece| stream.write_all(piece).is_ok())
}
