//! The scenarios of the emulated board on the virtual one, which needs no emulator; and a peer that is no board of this version.
#![cfg(unix)]

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use ballbar::wire::{BoardHello, MAX_FRAME, PROTOCOL, ProtocolVersion, ResetReason, ToHost, encode};
use ballbar_tests::at_length::at_length;
use ballbar_tests::command::host_cal_in;
use ballbar_tests::scenarios::{self, Bench};
use host_cal::virtual_board::{Pace, VirtualBoard, VirtualBoardOptions};
use serialport::{SerialPort, TTYPort};

struct Virtual(VirtualBoard);

impl Bench for Virtual {
    fn board(&self) -> &'static str {
        "virtual"
    }

    fn port(&self) -> String {
        self.0.port().to_owned()
    }
}

#[test]
fn a_board_serves_its_host() {
    let plant = scenarios::plant(1);
    let options = VirtualBoardOptions::new(plant.clone(), Pace::Free);
    let mut bench = Virtual(VirtualBoard::start(options).unwrap());
    scenarios::greets_the_host(&bench);
    scenarios::keeps_parameters_over_a_reset(&bench, &plant);
    scenarios::brings_back_the_parameters_before(&bench);
    scenarios::home_at_rest(&bench, &plant);

    let script = scenarios::script(at_length(12), 4.5, 3);
    bench.0.play_with_stream(script.clone());
    let (_, recording) = scenarios::record(&bench, script.stations.len(), &["--rate", "1000", "--pose"]);
    recording.has_every_sample(at_length(60_000));
    recording.has_true_stations(&script);
}

/// A hello of another version; in all else it is one of this version, so that nothing but the version tells.
fn hello_of(version: ProtocolVersion) -> Vec<u8> {
    let hello = BoardHello {
        version,
        firmware: "9.9.9".try_into().unwrap(),
        board: "future".try_into().unwrap(),
        unique_id: [0; 12],
        encoders: 6,
        rate_min_hz: 100,
        rate_max_hz: 5_000,
        encoder_skew_ns: 0,
        lvdt_delay_ns: 0,
        uptime_us: 0,
        reset: ResetReason::PowerOn,
        active: None,
    };
    encode(&ToHost::Hello(hello), &mut [0; MAX_FRAME]).unwrap().to_vec()
}

#[test]
fn a_board_of_another_version_is_refused_with_both_named() {
    let other = ProtocolVersion { number: PROTOCOL.number + 1, schema: [0xab; 8] };
    let (mut board_end, host_end) = TTYPort::pair().unwrap();
    let port = host_end.name().unwrap();
    // What serialport has open, it keeps from others.
    drop(host_end);
    let host = std::thread::spawn(move || host_cal_in(&std::env::temp_dir(), &["status", &port]));
    let began = Instant::now();
    let mut heard = Vec::new();
    while !host.is_finished() {
        assert!(began.elapsed() < Duration::from_secs(60), "the host has not ended");
        let mut bytes = [0; 256];
        match board_end.read(&mut bytes) {
            Ok(count) => heard.extend_from_slice(&bytes[..count]),
            // Without a host at the other end a pseudo-terminal gives errors.
            Err(error) if error.kind() == ErrorKind::TimedOut => {}
            Err(_) => std::thread::sleep(Duration::from_millis(5)),
        }
        // The zero before the hello, and the one behind it.
        if heard.iter().filter(|&&byte| byte == 0).count() >= 2 {
            heard.clear();
            let _ = board_end.write_all(&hello_of(other));
        }
    }
    let run = host.join().unwrap();
    assert_eq!(run.code, 2, "{}", run.transcript());
    let theirs = format!("{} (messages abababababababab)", other.number);
    let ours = format!("{} (messages ", PROTOCOL.number);
    // Without the wrapping of its lines.
    let message = run.stderr.split_whitespace().filter(|&word| word != "│").collect::<Vec<_>>().join(" ");
    assert!(message.contains(&theirs) && message.contains(&ours), "{}", run.transcript());
}
