//! Unimation's VAL.

use std::io::{Read, Write};
use std::time::{Duration, Instant};

use ballbar_tests::peers::Mishap;
use ballbar_tests::peers::val::{ValPeer, ValPeerOptions};
use host_cal::robot_link::val::{VAL_BAUD, ValLink, ValSpeeds};
use host_cal::robot_link::{JointSpeed, LinkError, MoveState, RobotLink};
use serialport::{SerialPort, TTYPort};

use super::{end_of_move, joint_vector, largest, patience};

const GOAL_DEG: [f64; 6] = [40.0, -60.5, 80.125, 20.0, -30.0, 15.0];
/// Rounded to VAL's thousandths.
const RESOLUTION_RAD: f64 = 0.0006 * std::f64::consts::PI / 180.0;

fn open(peer: &ValPeer) -> ValLink {
    ValLink::open(peer.port(), VAL_BAUD, ValSpeeds::default(), patience()).unwrap()
}

fn go(link: &mut ValLink, q_deg: &[f64; 6]) -> Result<MoveState, LinkError> {
    link.start_move(&joint_vector(&q_deg.map(f64::to_radians)), &JointSpeed::default())?;
    end_of_move(link)
}

fn distance_rad(peer: &ValPeer, q_deg: &[f64; 6]) -> f64 {
    largest(&peer.joints().joints_at(Instant::now()), &q_deg.map(f64::to_radians))
}

#[test]
fn a_move_is_reached_whenever_the_prompt_comes() {
    for (prompts_at_end, prompts_busy) in [(false, false), (true, false), (false, true)] {
        let peer = ValPeer::start(ValPeerOptions { prompts_at_end, prompts_busy, ..ValPeerOptions::default() });
        let mut link = open(&peer);
        assert_eq!(go(&mut link, &GOAL_DEG).unwrap(), MoveState::Reached);
        assert!(distance_rad(&peer, &GOAL_DEG) < RESOLUTION_RAD);
        assert!(largest(link.joints().unwrap().unwrap().as_array(), &GOAL_DEG.map(f64::to_radians)) < 2.0 * RESOLUTION_RAD);
        assert_eq!(peer.lines(), ["SPEED 25", "POINT #BBAR", "40.000,-60.500,80.125,20.000,-30.000,15.000", "DO MOVE #BBAR"]);
    }
}

#[test]
fn the_question_is_understood_however_it_is_spelt() {
    for question in ["CHANGE?\r\n", "CHANGES?\r\n", "CHANGES?", "Change? "] {
        let peer = ValPeer::start(ValPeerOptions { question, ..ValPeerOptions::default() });
        assert_eq!(go(&mut open(&peer), &GOAL_DEG).unwrap(), MoveState::Reached, "{question}");
        assert!(distance_rad(&peer, &GOAL_DEG) < RESOLUTION_RAD);
    }
}

#[test]
fn a_line_as_slow_as_the_real_one_is_understood() {
    let character = Duration::from_micros(1042);
    let peer = ValPeer::start(ValPeerOptions { character, ..ValPeerOptions::default() });
    let mut link = open(&peer);
    assert_eq!(link.name(), format!("val at {}", peer.port()));
    assert_eq!(go(&mut link, &GOAL_DEG).unwrap(), MoveState::Reached);
    assert!(distance_rad(&peer, &GOAL_DEG) < RESOLUTION_RAD);
}

#[test]
fn a_start_returns_at_once() {
    let peer = ValPeer::start(ValPeerOptions { pace: 1.0, ..ValPeerOptions::default() });
    let mut link = open(&peer);
    let begun = Instant::now();
    link.start_move(&joint_vector(&GOAL_DEG.map(f64::to_radians)), &JointSpeed::default()).unwrap();
    assert!(begun.elapsed() < Duration::from_millis(50), "{:?}", begun.elapsed());
    assert_eq!(link.poll().unwrap(), MoveState::Moving);
}

#[test]
fn what_the_controller_refuses_is_refused_in_its_words_and_the_next_move_goes() {
    let peer = ValPeer::start(ValPeerOptions::default());
    let mut link = open(&peer);
    let state = go(&mut link, &[200.0, -90.0, 90.0, 0.0, 0.0, 0.0]).unwrap();
    assert_eq!(state, MoveState::Refused("*Position out of range* Jt 1".into()));
    assert_eq!(link.poll().unwrap(), state, "it stays as it ended");
    peer.next(Mishap::Refuses);
    assert_eq!(go(&mut link, &GOAL_DEG).unwrap(), MoveState::Refused("*Arm power off*".into()));
    assert_eq!(go(&mut link, &GOAL_DEG).unwrap(), MoveState::Reached);
}

#[test]
fn numbers_that_are_none_are_refused() {
    let peer = ValPeer::start(ValPeerOptions::default());
    let mut link = open(&peer);
    assert!(matches!(go(&mut link, &[f64::INFINITY; 6]).unwrap(), MoveState::Refused(_)));
    assert_eq!(peer.lines(), [""; 0]);
}

#[test]
fn an_envelope_error_on_the_way_is_a_fault_that_only_a_person_gets_over() {
    for prompts_at_end in [false, true] {
        // Slow enough that a WHERE sees it move.
        let peer = ValPeer::start(ValPeerOptions { pace: 4.0, prompts_at_end, ..ValPeerOptions::default() });
        let mut link = open(&peer);
        peer.next(Mishap::FaultsHalfWay);
        assert_eq!(go(&mut link, &GOAL_DEG).unwrap(), MoveState::Fault("*Envelope error* Jt 2".into()));
        assert!(distance_rad(&peer, &GOAL_DEG) > 0.1);
        let typed = peer.lines().len();
        link.recover().unwrap();
        assert_eq!(link.intervention().unwrap().unwrap().what, "*Envelope error* Jt 2");
        assert_eq!(peer.lines().len(), typed, "nothing is typed to get over it: {:?}", peer.lines());
        link.release().unwrap();
        assert_eq!(peer.lines().len(), typed, "not even then: {:?}", peer.lines());
        assert_eq!(link.intervention().unwrap(), None);
        // Nobody has switched the power on.
        assert_eq!(go(&mut link, &GOAL_DEG).unwrap(), MoveState::Refused("*Arm power off*".into()));
        assert_eq!(link.intervention().unwrap().unwrap().what, "*Arm power off*");
        peer.switch_power_on();
        link.release().unwrap();
        assert_eq!(go(&mut link, &GOAL_DEG).unwrap(), MoveState::Reached);
        assert_eq!(link.intervention().unwrap(), None);
    }
}

#[test]
fn a_robot_that_stands_elsewhere_is_a_fault_without_words() {
    let peer = ValPeer::start(ValPeerOptions { pace: 4.0, ..ValPeerOptions::default() });
    let mut link = open(&peer);
    peer.next(Mishap::EndsHalfWay);
    let state = go(&mut link, &GOAL_DEG).unwrap();
    assert!(matches!(&state, MoveState::Fault(words) if words.contains("stands before it is there")), "{state:?}");
}

#[test]
fn stop_halts_the_arm() {
    for prompts_at_end in [false, true] {
        let peer = ValPeer::start(ValPeerOptions { pace: 1.0, prompts_at_end, ..ValPeerOptions::default() });
        let mut link = open(&peer);
        link.start_move(&joint_vector(&GOAL_DEG.map(f64::to_radians)), &JointSpeed::default()).unwrap();
        while distance_rad(&peer, &ValPeerOptions::default().q_deg) < 0.02 {
            assert_eq!(link.poll().unwrap(), MoveState::Moving);
        }
        link.stop().unwrap();
        let state = end_of_move(&mut link).unwrap();
        assert_eq!(state, MoveState::Fault("stopped as asked".into()));
        assert!(distance_rad(&peer, &GOAL_DEG) > 0.1);
        assert_eq!(peer.lines().last().unwrap(), "ABORT");
    }
}

#[test]
fn a_silent_controller_times_out() {
    let peer = ValPeer::start(ValPeerOptions::default());
    let mut link = open(&peer);
    peer.next(Mishap::GoesSilent);
    let state = go(&mut link, &GOAL_DEG).unwrap();
    assert!(matches!(state, MoveState::TimedOut(_)), "{state:?}");
    assert_eq!(link.joints().unwrap(), None);
    link.recover().unwrap();
    let state = go(&mut link, &GOAL_DEG).unwrap();
    assert!(matches!(state, MoveState::TimedOut(_)), "{state:?}");
}

#[test]
fn a_lost_line_is_an_error() {
    let peer = ValPeer::start(ValPeerOptions { pace: 4.0, ..ValPeerOptions::default() });
    let mut link = open(&peer);
    peer.next(Mishap::DropsTheLine);
    let error = go(&mut link, &GOAL_DEG).unwrap_err();
    assert!(matches!(error, LinkError::Lost { .. }), "{error}");
}

#[test]
fn garbage_is_an_error_that_shows_it() {
    let peer = ValPeer::start(ValPeerOptions { pace: 4.0, ..ValPeerOptions::default() });
    let mut link = open(&peer);
    peer.next(Mishap::TalksGarbage);
    let error = go(&mut link, &GOAL_DEG).unwrap_err();
    assert!(matches!(&error, LinkError::Unexpected { found, .. } if found.contains("???")), "{error}");
}

#[test]
fn a_controller_that_lies_is_believed_and_found_out_by_the_encoders() {
    let peer = ValPeer::start(ValPeerOptions::default());
    let mut link = open(&peer);
    peer.next(Mishap::StandsElsewhereByMrad(40));
    assert_eq!(go(&mut link, &GOAL_DEG).unwrap(), MoveState::Reached);
    assert!((distance_rad(&peer, &GOAL_DEG) - 0.04).abs() < RESOLUTION_RAD);
}

#[test]
fn a_link_opened_within_a_question_finds_the_prompt() {
    let peer = ValPeer::start(ValPeerOptions::default());
    let mut terminal = serialport::new(peer.port(), VAL_BAUD).timeout(Duration::from_millis(200)).open().unwrap();
    terminal.write_all(b"POINT #A\r").unwrap();
    std::thread::sleep(Duration::from_millis(50));
    drop(terminal);
    std::thread::sleep(Duration::from_millis(50));
    assert_eq!(go(&mut open(&peer), &GOAL_DEG).unwrap(), MoveState::Reached);
}

#[test]
fn what_is_no_val_is_found_out_at_once() {
    let (mut other, host_end) = TTYPort::pair().unwrap();
    let port = host_end.name().unwrap();
    drop(host_end);
    let open = |port: &str| ValLink::open(port, VAL_BAUD, ValSpeeds::default(), patience()).err().unwrap();
    let silent = open(&port);
    assert!(matches!(&silent, LinkError::Unreachable { reason, .. } if reason.contains("9600 baud")), "{silent}");

    let server = std::thread::spawn(move || {
        let mut bytes = [0; 16];
        other.set_timeout(Duration::from_secs(2)).unwrap();
        while !matches!(other.read(&mut bytes), Ok(count) if count > 0) {}
        other.write_all(b"\r\nUbuntu login: ").unwrap();
        std::thread::sleep(Duration::from_secs(1));
    });
    let error = open(&port);
    assert!(matches!(&error, LinkError::Unexpected { found, .. } if found == "Ubuntu login:"), "{error}");
    server.join().unwrap();
    let absent = open("/dev/no-such-port");
    assert!(matches!(absent, LinkError::Unreachable { .. }), "{absent}");
}

#[test]
fn percents_are_never_faster_than_asked_but_for_the_slowest() {
    let speeds = ValSpeeds::default();
    for (deg_s, percent) in [(60.0_f64, 25), (61.0, 25), (240.0, 100), (1e9, 100), (0.1, 1)] {
        assert_eq!(speeds.percent(deg_s.to_radians()), percent, "{deg_s}");
    }
}
