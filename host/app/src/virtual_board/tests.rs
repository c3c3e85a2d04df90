//! A virtual board as the host sees it: through its port.

use std::io::{Read, Write};
use std::time::Instant;

use ballbar::Kinematics;
use ballbar::wire::{
    Answer, BoardHello, Command, Event, FrameReader, HostHello, MAX_FRAME, PROTOCOL, Refusal, Request, ResetReason, SlotState,
    StreamSelection, ToBoard, ToHost, WhichSet, decode, encode,
};
use ballbar_calib::model::Robot;
use ballbar_calib::simulate::Shells;
use serialport::SerialPort;

use super::*;
use crate::board::{joint_encoders, parameter_set};
use crate::files::{open_rig, open_robot};
use crate::robot_link::JointSpeed;

/// Far longer than anything here takes.
const PATIENCE: Duration = Duration::from_secs(30);
const REPEAT_HELLO: Duration = Duration::from_millis(300);

/// The least that a host needs: frames out, messages in.
struct Host {
    port: Box<dyn SerialPort>,
    frames: FrameReader,
    last_id: u16,
}

impl Host {
    fn open(board: &VirtualBoard) -> Self {
        let port = serialport::new(board.port(), 921_600).timeout(Duration::from_millis(20)).open().unwrap();
        Self { port, frames: FrameReader::new(), last_id: 0 }
    }

    fn send(&mut self, message: &ToBoard) {
        self.port.write_all(encode(message, &mut [0; MAX_FRAME]).unwrap()).unwrap();
    }

    fn messages(&mut self) -> Vec<ToHost> {
        let mut bytes = [0; 4_096];
        let count = self.port.read(&mut bytes).unwrap_or(0);
        let mut messages = Vec::new();
        for &byte in &bytes[..count] {
            if let Some(Ok(payload)) = self.frames.push(byte) {
                messages.extend(decode::<ToHost>(payload));
            }
        }
        messages
    }

    fn wait_for<T>(&mut self, pick: impl FnMut(ToHost) -> Option<T>) -> T {
        self.wait_at_most(PATIENCE, pick).expect("nothing came")
    }

    fn wait_at_most<T>(&mut self, patience: Duration, mut pick: impl FnMut(ToHost) -> Option<T>) -> Option<T> {
        let began = Instant::now();
        while began.elapsed() < patience {
            if let Some(picked) = self.messages().into_iter().find_map(&mut pick) {
                return Some(picked);
            }
        }
        None
    }

    /// Says hello until it is answered: a board that is just being reset hears nothing.
    fn hello(&mut self) -> BoardHello {
        for _ in 0..PATIENCE.as_millis() / REPEAT_HELLO.as_millis() {
            self.send(&ToBoard::Hello(HostHello { version: PROTOCOL }));
            let answer = |message| if let ToHost::Hello(hello) = message { Some(hello) } else { None };
            if let Some(hello) = self.wait_at_most(REPEAT_HELLO, answer) {
                return hello;
            }
        }
        panic!("no hello");
    }

    fn ask(&mut self, command: Command) -> Result<Answer, Refusal> {
        self.last_id += 1;
        let id = self.last_id;
        self.send(&ToBoard::Request(Request { id, command }));
        self.wait_for(|message| match message {
            ToHost::Reply(reply) if reply.id == id => Some(reply.outcome),
            _ => None,
        })
    }
}

fn truth() -> Robot {
    open_robot("puma560-optimised").unwrap()
}

fn options(pace: Pace) -> VirtualBoardOptions {
    VirtualBoardOptions::new(Plant::new(&truth(), 0.075, 7).unwrap(), pace)
}

fn ready(pace: Pace) -> VirtualBoardOptions {
    let options = options(pace);
    let set = parameter_set(&open_robot("puma560").unwrap(), options.plant.lvdt()).unwrap();
    VirtualBoardOptions { parameters: Some(set), is_homed: true, ..options }
}

fn script(per_pairing: usize, dwell_s: f64) -> Script {
    let (planned_with, truth, rig) = (open_robot("puma560").unwrap(), truth(), open_rig("triangles").unwrap());
    let pairings = rig.all_pairings();
    let shells = Shells {
        planned_with: &planned_with,
        truth: &truth,
        rig: &rig,
        pairings: &pairings,
        bar_m: 0.46,
        per_pairing,
        sigma_m: 0.084e-3,
        seed: 7,
    };
    Script::from_shells(&shells, dwell_s, JointSpeed::default(), || ()).unwrap()
}

const SETTLED: StreamSelection = StreamSelection { samples: false, settled: true, poses: false };

#[test]
fn every_station_settles_at_its_pose_and_length() {
    let options = ready(Pace::Free);
    let (curve, truth) = (options.plant.lvdt(), truth());
    let (encoders, kinematics) = (joint_encoders(&truth).unwrap(), Kinematics::new(&truth.chain));
    let mut board = VirtualBoard::start(options).unwrap();
    let mut host = Host::open(&board);
    assert_eq!(host.hello().active.unwrap().name, "PUMA 560");
    host.ask(Command::StartStream(SETTLED)).unwrap();
    let script = script(4, 0.7);
    board.play(script.clone());

    let mut settled = Vec::new();
    host.wait_for(|message| {
        let ToHost::Stream(stream) = message else { return None };
        assert_eq!((stream.dropped, stream.overruns, stream.homed), (0, 0, 0b11_1111));
        if let Event::Settled(pose) = stream.event {
            settled.push(pose);
        }
        (settled.len() == script.stations.len()).then_some(())
    });
    for (pose, station) in settled.iter().zip(&script.stations) {
        for (mean, expected) in pose.counts_mean.iter().zip(encoders.counts(&station.q)) {
            assert!((mean - expected).abs() < 1.0, "{mean} for {expected}");
        }
        let held = encoders.counts(&station.q).map(f64::round);
        let bar = station.bar.unwrap();
        let length_m = kinematics.length(&encoders.q(held), &bar.pairing) + station.length_error_m;
        let expected = lvdt::code_at(&curve, length_m - bar.mid_m).unwrap();
        assert!((pose.code_mean - expected).abs() < 3.0, "{} for {expected}", pose.code_mean);
    }
    let began = Instant::now();
    while !board.is_done() {
        assert!(began.elapsed() < PATIENCE);
    }
    std::thread::sleep(Duration::from_millis(100));
    assert!(!host.messages().iter().any(|message| matches!(message, ToHost::Stream(_))), "a pose settled twice");
}

#[test]
fn a_slow_host_loses_nothing_at_free_pace() {
    let mut board = VirtualBoard::start(options(Pace::Free)).unwrap();
    let mut host = Host::open(&board);
    host.hello();
    host.ask(Command::SetRate { rate_hz: 5_000 }).unwrap();
    host.ask(Command::StartStream(StreamSelection { samples: true, ..SETTLED })).unwrap();
    board.play(script(1, 0.5));
    let (mut next, mut samples) = (None, 0);
    host.wait_for(|message| {
        if let ToHost::Stream(stream) = message {
            assert_eq!((stream.dropped, stream.overruns), (0, 0));
            if let Event::Samples(batch) = stream.event {
                assert!(next.is_none_or(|next| next == batch.first.index));
                next = Some(batch.first.index + batch.len() as u32);
                samples += batch.len();
                std::thread::sleep(Duration::from_micros(200));
            }
        }
        (samples > 60_000).then_some(())
    });
}

#[test]
fn a_board_from_the_shelf_is_neither_homed_nor_calibrated() {
    let board = VirtualBoard::start(options(Pace::Real)).unwrap();
    let mut host = Host::open(&board);
    assert_eq!(host.ask(Command::Status), Err(Refusal::HelloFirst));
    let hello = host.hello();
    assert_eq!((hello.active, hello.reset), (None, ResetReason::PowerOn));
    let Ok(Answer::Status(status)) = host.ask(Command::Status) else { panic!() };
    assert!(status.encoders.iter().all(|encoder| !encoder.is_homed));
    assert!(status.lvdt.saturated, "no bar is attached yet");
    assert_eq!(status.slots, [SlotState::Empty; 2]);
}

#[test]
fn a_ready_board_still_waits_for_its_first_hello() {
    let board = VirtualBoard::start(ready(Pace::Real)).unwrap();
    let mut host = Host::open(&board);
    assert_eq!(host.ask(Command::Status), Err(Refusal::HelloFirst));
    host.hello();
    let Ok(Answer::CurrentPose(pose)) = host.ask(Command::CurrentPose) else { panic!() };
    assert_eq!(pose.homed, 0b11_1111);
    assert!(pose.q.iter().all(|q| q.abs() < 1e-3), "{:?}", pose.q);
}

#[test]
fn a_reset_loses_the_homing_and_keeps_the_flash() {
    let board = VirtualBoard::start(ready(Pace::Real)).unwrap();
    let mut host = Host::open(&board);
    let before = host.hello();
    host.ask(Command::Reset).unwrap();
    let began = Instant::now();
    let after = loop {
        assert!(began.elapsed() < PATIENCE);
        let hello = host.hello();
        if hello.reset == ResetReason::Software {
            break hello;
        }
    };
    assert!(after.active.is_some());
    assert_eq!(after.active, before.active);
    let Ok(Answer::Status(status)) = host.ask(Command::Status) else { panic!() };
    assert!(status.encoders.iter().all(|encoder| !encoder.is_homed && encoder.counts == 0));
}

#[test]
fn parameters_outlive_the_program_in_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let flash_file = Some(folder.path().join("flash.bin"));
    let board = VirtualBoard::start(VirtualBoardOptions { flash_file: flash_file.clone(), ..options(Pace::Real) }).unwrap();
    let set = parameter_set(&truth(), lvdt_curve(0.075)).unwrap();
    let mut host = Host::open(&board);
    host.hello();
    let Ok(Answer::Staged { crc }) = host.ask(Command::WriteParameters(set.clone())) else { panic!() };
    host.ask(Command::Commit { crc }).unwrap();
    drop(board);

    // A ready board's own parameters do not take the place of those that somebody stored.
    let board = VirtualBoard::start(VirtualBoardOptions { flash_file, ..ready(Pace::Real) }).unwrap();
    let mut host = Host::open(&board);
    host.hello();
    assert_eq!(host.ask(Command::ReadParameters(WhichSet::Active)), Ok(Answer::Parameters(set)));
}

#[test]
fn flipped_bits_are_counted_and_cost_frames() {
    let bit_errors = NonZeroU64::new(500);
    let mut board = VirtualBoard::start(VirtualBoardOptions { bit_errors, ..options(Pace::Free) }).unwrap();
    let mut host = Host::open(&board);
    host.send(&ToBoard::Hello(HostHello { version: PROTOCOL }));
    let selection = StreamSelection { samples: true, ..SETTLED };
    host.send(&ToBoard::Request(Request { id: 1, command: Command::StartStream(selection) }));
    board.play_with_stream(script(1, 0.5));
    let mut messages = 0;
    host.wait_for(|message| {
        messages += u32::from(matches!(message, ToHost::Stream(_)));
        (messages > 200).then_some(())
    });
    assert!(board.bit_flips() > 20, "{}", board.bit_flips());
    assert!(host.frames.counts().thrown_away() > 10);
}

#[test]
fn a_named_port_is_a_link_that_goes_with_the_board() {
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join("board");
    let board = VirtualBoard::start(VirtualBoardOptions { port_name: Some(name.clone()), ..options(Pace::Real) }).unwrap();
    assert_eq!(board.port(), name.display().to_string());
    Host::open(&board).hello();
    drop(board);
    assert!(!name.is_symlink());

    std::fs::write(&name, "a file").unwrap();
    let refused = VirtualBoard::start(VirtualBoardOptions { port_name: Some(name.clone()), ..options(Pace::Real) });
    assert!(matches!(refused, Err(VirtualBoardError::Port(_))));
    assert_eq!(std::fs::read_to_string(&name).unwrap(), "a file");
}

#[test]
fn a_host_may_close_the_port_and_open_it_again() {
    let board = VirtualBoard::start(options(Pace::Real)).unwrap();
    for _ in 0..3 {
        Host::open(&board).hello();
        std::thread::sleep(Duration::from_millis(150));
    }
}
