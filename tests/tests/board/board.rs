//! The conversation with the board: hellos, numbers of requests, damage, resets.

use ballbar::Sample;
use ballbar::wire::{
    Answer, Command, HostHello, MAX_FRAME, PROTOCOL, ProtocolVersion, Refusal, Reply, Request, ResetReason, StreamSelection,
    ToBoard, ToHost, WhichSet, encode,
};
use ballbar_tests::any_message;
use ballbar_tests::fake_board::FakeBoard;
use ballbar_tests::fake_hardware::FACTS;
use ballbar_tests::parameter_sets::puma;
use ballbar_tests::power_cut::MockFlash;
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::TestRunner;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const ALL: StreamSelection = StreamSelection { samples: true, settled: true, poses: true };
const SAMPLES: StreamSelection = StreamSelection { samples: true, settled: false, poses: false };

#[test]
fn the_first_thing_that_the_board_says_is_nothing() {
    let mut board = FakeBoard::new();
    board.run(2_000);
    assert_eq!(board.receive(), []);
    assert_eq!(board.machine().link.on_the_wire, [0], "a zero, so that noise before it is no frame");
}

#[test]
fn the_answer_to_a_hello_says_what_the_board_is() {
    let mut board = FakeBoard::new();
    board.run(500);
    let hello = board.greet();
    assert_eq!((hello.version, hello.firmware.as_str()), (PROTOCOL, env!("CARGO_PKG_VERSION")));
    assert_eq!((hello.board.as_str(), hello.unique_id), (FACTS.name, FACTS.unique_id));
    assert_eq!((hello.encoders, hello.rate_min_hz, hello.rate_max_hz), (6, 100, 5_000));
    assert_eq!((hello.encoder_skew_ns, hello.lvdt_delay_ns), (FACTS.encoder_skew_ns, FACTS.lvdt_delay_ns));
    assert_eq!((hello.reset, hello.active), (ResetReason::PowerOn, None));
    assert!((490_000..=510_000).contains(&hello.uptime_us));
}

#[test]
fn before_a_hello_every_request_is_refused() {
    let mut board = FakeBoard::new();
    let mut runner = TestRunner::deterministic();
    for id in 1..300 {
        let command = any_message::command().new_tree(&mut runner).unwrap().current();
        assert_eq!(board.ask_as(id, command), Err(Refusal::HelloFirst));
    }
    assert_eq!(board.machine().rate_hz, 1_000);
}

#[test]
fn a_hello_of_another_version_closes_the_conversation() {
    let other_schema = ProtocolVersion { schema: [9; 8], ..PROTOCOL };
    let other_number = ProtocolVersion { number: PROTOCOL.number + 1, ..PROTOCOL };
    for version in [other_schema, other_number] {
        let mut board = FakeBoard::new().settle_in();
        assert!(board.ask(Command::Status).is_ok());
        board.send(&ToBoard::Hello(HostHello { version }));
        let Some(ToHost::Hello(hello)) = board.next_answer() else { panic!("the board did not say what it is") };
        assert_eq!(hello.version, PROTOCOL);
        assert_eq!(board.ask(Command::Status), Err(Refusal::HelloFirst));
        board.greet();
        assert!(board.ask(Command::Status).is_ok());
    }
}

#[test]
fn what_is_not_understood_is_refused_under_its_number() {
    let mut board = FakeBoard::new().settle_in();
    for id in [0, 1, 127, 128, 40_000, u16::MAX] {
        board.send_payload(&postcard::to_stdvec(&(1_u8, id, 200_u8, "a command of later times")).unwrap());
        assert_eq!(board.next_answer(), Some(ToHost::Reply(Reply { id, outcome: Err(Refusal::NotUnderstood) })));
    }
    for payload in [&b""[..], b"M", b"no request at all"] {
        board.send_payload(payload);
        assert_eq!(board.next_answer(), Some(ToHost::Reply(Reply { id: 0, outcome: Err(Refusal::NotUnderstood) })));
    }
    assert!(board.ask(Command::Status).is_ok());
}

#[test]
fn a_request_that_is_repeated_acts_once_and_is_answered_again() {
    let mut board = FakeBoard::new().settle_in();
    let preset = || Command::PresetEncoder { joint: 2, counts: 1_000 };
    assert_eq!(board.ask_as(50, preset()), Ok(Answer::Done));
    // The arm goes on while the answer is lost and the host asks again.
    board.encoders().positions[2] += 300;
    for _ in 0..5 {
        assert_eq!(board.ask_as(50, preset()), Ok(Answer::Done));
    }
    assert_eq!(board.status().encoders[2].counts, 1_300);
    assert_eq!(board.ask(preset()), Ok(Answer::Done));
    assert_eq!(board.status().encoders[2].counts, 1_000, "a new number is a new preset");
}

/// Numbers come round again after 65,536 requests, so that only the last one can be repeated.
#[test]
fn a_number_that_comes_round_again_is_a_new_request() {
    let mut board = FakeBoard::new().settle_in();
    let preset = || Command::PresetEncoder { joint: 0, counts: 0 };
    assert_eq!(board.ask_as(50, preset()), Ok(Answer::Done));
    board.encoders().positions[0] += 77;
    assert!(board.ask_as(49, Command::Status).is_ok());
    assert_eq!(board.ask_as(50, preset()), Ok(Answer::Done));
    assert_eq!(board.status().encoders[0].counts, 0);
}

#[test]
fn a_refusal_is_repeated_as_it_was() {
    let mut board = FakeBoard::new().settle_in();
    let commit = Command::Commit { crc: 1 };
    assert_eq!(board.ask_as(9, commit.clone()), Err(Refusal::NoParameters));
    assert_eq!(board.ask_as(9, commit), Err(Refusal::NoParameters));
}

#[test]
fn a_hello_begins_the_numbers_anew() {
    let mut board = FakeBoard::new().settle_in();
    assert_eq!(board.ask_as(1, Command::SetRate { rate_hz: 200 }), Ok(Answer::Done));
    board.greet();
    assert_eq!(board.ask_as(1, Command::SetRate { rate_hz: 400 }), Ok(Answer::Done));
    assert_eq!(board.machine().rate_hz, 400);
}

#[test]
fn requests_that_are_missing_between_two_are_counted() {
    let mut board = FakeBoard::new().settle_in();
    for id in [1, 2, 2, 5, 65_535, 0, 4] {
        assert!(board.ask_as(id, Command::Status).is_ok());
    }
    // 3 and 4; from 5 back to 65,535 nothing; then 1, 2 and 3.
    assert_eq!(board.status().link.missing, 5);
}

#[test]
fn a_request_that_was_not_understood_is_not_missing() {
    let mut board = FakeBoard::new().settle_in();
    assert!(board.ask_as(1, Command::Status).is_ok());
    board.send_payload(&[1, 2, 200]);
    assert!(board.next_answer().is_some());
    assert!(board.ask_as(3, Command::Status).is_ok());
    assert_eq!(board.status().link.missing, 0);
}

#[test]
fn damaged_frames_are_counted_by_their_kind_and_answered_by_nothing() {
    let mut board = FakeBoard::new().settle_in();
    let before = board.status().link;
    let mut buffer = [0; MAX_FRAME];
    let request = ToBoard::Request(Request { id: 1, command: Command::StopStream });
    let mut frame = encode(&request, &mut buffer).unwrap().to_vec();
    frame[3] ^= 0x10;
    let link = &mut board.machine().link;
    link.to_board.extend(&frame);
    link.to_board.extend([200, 1, 2, 0]);
    link.to_board.extend([b'x'; MAX_FRAME + 1]);
    link.to_board.extend([0]);
    board.run(20);
    assert_eq!(board.receive(), []);
    let after = board.status().link;
    assert_eq!((after.crc - before.crc, after.malformed - before.malformed, after.good - before.good), (1, 2, 1));
}

#[test]
fn noise_on_the_link_neither_stops_sampling_nor_the_conversation() {
    let mut board = FakeBoard::new().settle_in();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..2_000 {
        let mut noise = [0; 92];
        rng.fill_bytes(&mut noise);
        board.machine().link.to_board.extend(noise);
        board.run(1);
    }
    board.machine().link.to_board.push_back(0);
    board.run(100);
    board.receive();
    board.greet();
    let fed = board.fed.len();
    let status = board.status();
    assert!(status.overruns == 0 && status.samples as usize >= fed);
}

#[test]
fn a_link_that_fails_at_every_call_and_recovers_loses_no_more_than_its_messages() {
    let mut board = FakeBoard::new().settle_in();
    assert_eq!(board.ask(Command::StartStream(SAMPLES)), Ok(Answer::Done));
    board.machine().link.is_broken = true;
    board.run(5_000);
    board.machine().link.is_broken = false;
    assert_eq!(board.ask(Command::StopStream), Ok(Answer::Done));
    let fed = board.fed.len();
    let status = board.status();
    assert!(status.overruns == 0 && status.samples as usize >= fed);
    assert!(status.dropped > 100);
}

#[test]
fn the_watchdog_is_fed_by_samples_and_not_by_the_main_loop_alone() {
    let mut board = FakeBoard::new();
    board.run(100);
    let before = board.machine().feedings;
    assert_eq!(before, 99, "the latest sample still waits for its scan");
    for _ in 0..1_000 {
        board.poll();
    }
    assert_eq!(board.machine().feedings, before);
}

#[test]
fn the_lamp_shines_while_streaming_and_blinks_otherwise() {
    let mut board = FakeBoard::new().settle_in();
    let on_of = |board: &mut FakeBoard<_>| {
        let ticks = (0..1_000).filter(|_| {
            board.run(1);
            board.machine().lamp.is_on
        });
        ticks.count()
    };
    assert_eq!(on_of(&mut board), 400, "no parameters: four short blinks a second");
    board.commit(&puma()).unwrap();
    assert_eq!(on_of(&mut board), 100);
    board.ask(Command::StartStream(SAMPLES)).unwrap();
    assert_eq!(on_of(&mut board), 1_000);
}

#[test]
fn a_reset_comes_after_its_answer_has_left() {
    let mut board = FakeBoard::new().settle_in();
    let before = board.fed.len();
    assert_eq!(board.ask(Command::Reset), Ok(Answer::Done));
    board.run(200);
    assert_eq!(board.machine().resets.len(), 1, "one reset, and it comes");
    assert!(board.fed.len() - before >= 50);
}

/// Whether the answer to a reset leaves before the reset, when the stream has filled all buffers of a slow link.
fn reset_on_a_slow_link(bytes_per_s: u32) {
    let mut board = FakeBoard::new().settle_in();
    board.commit(&puma()).unwrap();
    board.ask(Command::StartStream(ALL)).unwrap();
    board.machine().link.bytes_per_s = bytes_per_s;
    board.run(3_000);
    board.receive();
    board.send(&ToBoard::Request(Request { id: 999, command: Command::Reset }));
    board.run(5_000);
    let Some(&left) = board.machine().resets.first() else { panic!("no reset within five seconds") };
    board.machine().link.on_the_wire.truncate(left);
    let answer = ToHost::Reply(Reply { id: 999, outcome: Ok(Answer::Done) });
    assert!(board.receive().contains(&answer), "reset before the answer had left");
}

#[test]
fn a_reset_comes_also_while_a_stream_fills_a_slow_link() {
    reset_on_a_slow_link(10_000);
}

#[test]
fn a_reset_comes_also_while_a_stream_runs_on_a_fast_link() {
    reset_on_a_slow_link(92_160);
}

#[test]
fn parameters_survive_a_reset() {
    let mut board = FakeBoard::on(MockFlash::<4>::new(0)).settle_in();
    board.commit(&puma()).unwrap();
    let flash = board.machine().flash.clone();
    let mut board = FakeBoard::on(flash);
    let active = board.greet().active.expect("no parameters after the reset");
    assert_eq!((active.name.as_str(), active.joints, active.sequence, active.is_calibrated), ("PUMA 560", 6, 0, false));
    assert_eq!(board.ask(Command::ReadParameters(WhichSet::Active)), Ok(Answer::Parameters(puma())));
}

#[test]
fn every_sample_is_streamed_from_the_one_after_the_start_to_the_one_before_the_stop() {
    let mut board = FakeBoard::new().settle_in();
    board.ask(Command::StartStream(SAMPLES)).unwrap();
    board.run(1_000);
    board.ask(Command::StopStream).unwrap();
    board.run(1_000);
    let samples: Vec<Sample> = board
        .take_streamed()
        .into_iter()
        .flat_map(|stream| match stream.event {
            ballbar::wire::Event::Samples(batch) => batch.samples().collect::<Vec<_>>(),
            other => panic!("nobody asked for {other:?}"),
        })
        .collect();
    assert!((1_000..1_010).contains(&samples.len()), "{}", samples.len());
    let first = samples[0].index as usize;
    assert_eq!(samples, board.fed[first..first + samples.len()]);
}
