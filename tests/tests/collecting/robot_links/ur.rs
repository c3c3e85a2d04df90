//! Universal Robots: moves, how long they may take, and what is wrong with a controller.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::time::{Duration, Instant};

use ballbar_tests::peers::Mishap;
use ballbar_tests::peers::ur::{UrPeer, UrPeerOptions};
use host_cal::robot_link::urscript::{UrLink, UrPorts};
use host_cal::robot_link::{JointSpeed, LinkError, MoveState, Patience, RobotLink};

use super::{end_of_move, joint_vector, largest, patience};

pub(super) const GOAL_RAD: [f64; 6] = [0.5, -1.2, 1.3, -1.6, -1.4, 0.3];
pub(super) const SPEED: JointSpeed = JointSpeed { revolute_rad_s: 0.1, prismatic_m_s: 0.25 };

pub(super) fn connect(peer: &UrPeer) -> UrLink {
    UrLink::connect("127.0.0.1", peer.ports(), patience()).unwrap()
}

pub(super) fn go(link: &mut UrLink, q_rad: &[f64; 6]) -> Result<MoveState, LinkError> {
    link.start_move(&joint_vector(q_rad), &SPEED)?;
    end_of_move(link)
}

#[test]
fn a_move_is_reached_where_the_arm_is() {
    for rate_max_hz in [125.0, 500.0] {
        let peer = UrPeer::start(UrPeerOptions { rate_max_hz, ..UrPeerOptions::default() });
        let mut link = connect(&peer);
        assert_eq!(link.name(), "urscript at 127.0.0.1");
        link.start_move(&joint_vector(&GOAL_RAD), &SPEED).unwrap();
        assert_eq!(link.poll().unwrap(), MoveState::Moving);
        assert_eq!(end_of_move(&mut link).unwrap(), MoveState::Reached);
        assert!(largest(&peer.joints().joints_at(Instant::now()), &GOAL_RAD) < 1e-7);
        assert!(largest(link.joints().unwrap().unwrap().as_array(), &GOAL_RAD) < 1e-7);
        assert_eq!(
            peer.programs(),
            ["def ballbar_1():\n  movej([0.50000000, -1.20000000, 1.30000000, -1.60000000, -1.40000000, 0.30000000], \
              a=1.400, v=0.100000)\nend\n"]
        );
        assert_eq!(peer.problems(), [""; 0]);
    }
}

#[test]
fn packets_in_pieces_are_put_together() {
    let peer = UrPeer::start(UrPeerOptions { is_split: true, ..UrPeerOptions::default() });
    let mut link = connect(&peer);
    assert_eq!(go(&mut link, &GOAL_RAD).unwrap(), MoveState::Reached);
    assert_eq!(peer.problems(), [""; 0]);
}

#[test]
fn where_the_arm_is_already_is_reached() {
    let peer = UrPeer::start(UrPeerOptions::default());
    let mut link = connect(&peer);
    assert_eq!(link.poll().unwrap(), MoveState::Reached);
    assert_eq!(go(&mut link, &UrPeerOptions::default().q_rad).unwrap(), MoveState::Reached);
}

#[test]
fn a_move_that_is_not_begun_is_refused_and_a_later_one_is_not() {
    let peer = UrPeer::start(UrPeerOptions::default());
    let mut link = connect(&peer);
    peer.next(Mishap::Refuses);
    let state = go(&mut link, &GOAL_RAD).unwrap();
    assert!(matches!(&state, MoveState::Refused(words) if words.contains("did not begin the move")), "{state:?}");
    assert_eq!(link.poll().unwrap(), state, "it stays as it ended");
    assert_eq!(go(&mut link, &GOAL_RAD).unwrap(), MoveState::Reached);
}

/// Polls for so long; the latest state.
fn watch_for(link: &mut UrLink, time: Duration) -> MoveState {
    let until = Instant::now() + time;
    loop {
        let state = link.poll().unwrap();
        if Instant::now() >= until {
            return state;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// So short beyond what a move takes that a slow one would not end in time.
const HASTY: Patience = Patience {
    answer: Duration::from_millis(800),
    begin: Duration::from_millis(600),
    stand: Duration::from_millis(250),
    margin: Duration::from_millis(200),
    recover: Duration::from_secs(3),
};
/// A second's way, for which 2.2 seconds are allowed at full speed.
const SECOND: JointSpeed = JointSpeed { revolute_rad_s: 0.5, prismatic_m_s: 0.25 };

#[test]
fn a_move_may_take_as_long_as_the_speed_slider_makes_it() {
    // Slider and limiter multiply; either may be what slows the robot down.
    for (slider, limiter) in [(0.3, 1.0), (0.6, 0.5)] {
        let peer = UrPeer::start(UrPeerOptions { pace: 1.0, ..UrPeerOptions::default() });
        peer.set_speed(slider, limiter);
        let mut link = UrLink::connect("127.0.0.1", peer.ports(), HASTY).unwrap();
        let began = Instant::now();
        link.start_move(&joint_vector(&GOAL_RAD), &SECOND).unwrap();
        assert_eq!(end_of_move(&mut link).unwrap(), MoveState::Reached);
        assert!(began.elapsed() > Duration::from_secs(3), "the slider is obeyed: {:?}", began.elapsed());
    }
}

#[test]
fn a_slider_at_zero_and_a_paused_program_are_waited_for() {
    type Act = fn(&UrPeer);
    let cases: [(&str, Act, Act); 2] = [
        ("speed slider", |peer| peer.set_speed(0.0, 1.0), |peer| peer.set_speed(0.5, 1.0)),
        ("paused", |peer| peer.set_paused(true), |peer| peer.set_paused(false)),
    ];
    for (what, hold, let_go) in cases {
        let peer = UrPeer::start(UrPeerOptions { pace: 1.0, ..UrPeerOptions::default() });
        let mut link = UrLink::connect("127.0.0.1", peer.ports(), HASTY).unwrap();
        link.start_move(&joint_vector(&GOAL_RAD), &SECOND).unwrap();
        watch_for(&mut link, Duration::from_millis(300));
        hold(&peer);
        let held = watch_for(&mut link, Duration::from_secs(3));
        assert!(format!("{held:?}").contains(what), "said while it is held: {held:?}");
        assert!(largest(&peer.joints().joints_at(Instant::now()), &GOAL_RAD) > 0.1);
        let_go(&peer);
        assert_eq!(watch_for(&mut link, Duration::from_millis(100)), MoveState::Moving);
        assert_eq!(end_of_move(&mut link).unwrap(), MoveState::Reached);
    }
}

#[test]
fn a_controller_that_falls_silent_times_out_wherever_its_slider_is() {
    let peer = UrPeer::start(UrPeerOptions { pace: 1.0, ..UrPeerOptions::default() });
    peer.set_speed(0.5, 1.0);
    let mut link = UrLink::connect("127.0.0.1", peer.ports(), HASTY).unwrap();
    peer.next(Mishap::GoesSilent);
    link.start_move(&joint_vector(&GOAL_RAD), &SECOND).unwrap();
    watch_for(&mut link, Duration::from_millis(1500));
    peer.set_speed(0.0, 1.0);
    let state = end_of_move(&mut link).unwrap();
    assert!(matches!(state, MoveState::TimedOut(_)), "{state:?}");
}

#[test]
fn a_robot_that_cannot_move_is_refused_with_its_mode() {
    let peer = UrPeer::start(UrPeerOptions::default());
    let mut link = connect(&peer);
    for (robot_mode, safety_mode, named) in [
        (3, 1, "POWER_OFF"),
        (-1, 1, "NO_CONTROLLER"),
        (7, 7, "ROBOT_EMERGENCY_STOP"),
        (7, 22, "SAFETY_API_SAFEGUARD_STOP"),
        (7, 99, "number 99"),
    ] {
        peer.set_modes(robot_mode, safety_mode);
        std::thread::sleep(std::time::Duration::from_millis(50));
        let state = go(&mut link, &GOAL_RAD).unwrap();
        assert!(matches!(&state, MoveState::Refused(words) if words.contains(named)), "{state:?}");
    }
    assert_eq!(peer.programs(), [""; 0], "nothing was sent");
}

#[test]
fn numbers_that_are_none_are_refused() {
    let peer = UrPeer::start(UrPeerOptions::default());
    let mut link = connect(&peer);
    let state = go(&mut link, &[f64::NAN; 6]).unwrap();
    assert!(matches!(state, MoveState::Refused(_)), "{state:?}");
    let standstill = JointSpeed { revolute_rad_s: 0.0, prismatic_m_s: 0.0 };
    link.start_move(&joint_vector(&GOAL_RAD), &standstill).unwrap();
    assert!(matches!(link.poll().unwrap(), MoveState::Refused(_)));
    assert_eq!(peer.programs(), [""; 0]);
}

#[test]
fn a_program_that_ends_before_its_time_is_a_fault() {
    let peer = UrPeer::start(UrPeerOptions::default());
    let mut link = connect(&peer);
    peer.next(Mishap::EndsHalfWay);
    let state = go(&mut link, &GOAL_RAD).unwrap();
    assert!(matches!(&state, MoveState::Fault(words) if words.contains("ended before")), "{state:?}");
    link.recover().unwrap();
    assert_eq!(go(&mut link, &GOAL_RAD).unwrap(), MoveState::Reached);
}

#[test]
fn stop_halts_the_arm() {
    let peer = UrPeer::start(UrPeerOptions { pace: 1.0, ..UrPeerOptions::default() });
    let mut link = connect(&peer);
    link.start_move(&joint_vector(&GOAL_RAD), &SPEED).unwrap();
    while largest(&peer.joints().joints_at(Instant::now()), &UrPeerOptions::default().q_rad) < 0.01 {
        assert_eq!(link.poll().unwrap(), MoveState::Moving);
    }
    link.stop().unwrap();
    let state = end_of_move(&mut link).unwrap();
    assert!(matches!(&state, MoveState::Fault(words) if words.contains("stopped as asked")), "{state:?}");
    assert!(largest(&peer.joints().joints_at(Instant::now()), &GOAL_RAD) > 0.3);
    assert_eq!(peer.programs().last().unwrap(), "stopj(4.0)\n");
}

#[test]
fn a_silent_controller_times_out() {
    let peer = UrPeer::start(UrPeerOptions { pace: 200.0, ..UrPeerOptions::default() });
    let quick = JointSpeed { revolute_rad_s: 3.0, ..SPEED };
    let mut link = connect(&peer);
    peer.next(Mishap::GoesSilent);
    link.start_move(&joint_vector(&GOAL_RAD), &quick).unwrap();
    let state = end_of_move(&mut link).unwrap();
    assert!(matches!(state, MoveState::TimedOut(after) if after > patience().margin), "{state:?}");
    assert_eq!(link.joints().unwrap(), None);
    // A robot of which nothing is heard is not moved.
    link.start_move(&joint_vector(&GOAL_RAD), &quick).unwrap();
    assert!(matches!(link.poll().unwrap(), MoveState::Refused(words) if words.contains("nothing heard")));
}

#[test]
fn a_lost_connection_is_an_error_and_a_new_one_goes_on() {
    let peer = UrPeer::start(UrPeerOptions::default());
    let mut link = connect(&peer);
    peer.next(Mishap::DropsTheLine);
    let error = go(&mut link, &GOAL_RAD).unwrap_err();
    assert!(matches!(error, LinkError::Lost { .. }), "{error}");
    let mut link = connect(&peer);
    assert_eq!(go(&mut link, &GOAL_RAD).unwrap(), MoveState::Reached);
}

#[test]
fn garbage_is_an_error_that_shows_it() {
    let peer = UrPeer::start(UrPeerOptions::default());
    let mut link = connect(&peer);
    peer.next(Mishap::TalksGarbage);
    let error = go(&mut link, &GOAL_RAD).unwrap_err();
    assert!(matches!(&error, LinkError::Unexpected { found, .. } if found.contains("1 bytes")), "{error}");
}

#[test]
fn a_controller_that_lies_is_believed_and_found_out_by_the_encoders() {
    let peer = UrPeer::start(UrPeerOptions::default());
    let mut link = connect(&peer);
    peer.next(Mishap::StandsElsewhereByMrad(40));
    assert_eq!(go(&mut link, &GOAL_RAD).unwrap(), MoveState::Reached);
    let true_rad = peer.joints().joints_at(Instant::now());
    assert!((GOAL_RAD[0] - true_rad[0] - 0.04).abs() < 1e-6, "{true_rad:?}");
}

#[test]
fn what_is_no_ur_is_found_out_at_once() {
    let nobody = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let ports = UrPorts { script: nobody, rtde: nobody, dashboard: nobody };
    let refused = UrLink::connect("127.0.0.1", ports, patience()).err().unwrap();
    assert!(matches!(refused, LinkError::Unreachable { .. }), "{refused}");

    for reply in [&b"HTTP/1.1 400 Bad Request\r\n"[..], b"", b"\x00\x04V\x00", b"\x00\x04V\x01\x00\x0dO\x01NOT_FOUND", &[0; 3000]]
    {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let server = std::thread::spawn(move || {
            let (_script, _) = listener.accept().unwrap();
            let (mut rtde, _) = listener.accept().unwrap();
            let _ = rtde.write_all(reply);
            let mut rest = Vec::new();
            let _ = rtde.read_to_end(&mut rest);
        });
        let ports = UrPorts { script: port, rtde: port, dashboard: port };
        let error = UrLink::connect("127.0.0.1", ports, patience()).err().unwrap();
        assert!(matches!(error, LinkError::Unexpected { .. }), "{reply:?}: {error}");
        server.join().unwrap();
    }
}
