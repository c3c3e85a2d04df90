//! Universal Robots: what only a person may see to, a protective stop before all, and local control.

use std::time::{Duration, Instant};

use ballbar_tests::peers::Mishap;
use ballbar_tests::peers::ur::{UrPeer, UrPeerOptions};
use host_cal::robot_link::urscript::UrLink;
use host_cal::robot_link::{JointSpeed, MoveState, Patience, RobotLink};

use super::ur::{GOAL_RAD, SPEED, connect, go};
use super::{end_of_move, joint_vector, largest, patience};

#[test]
fn a_protective_stop_is_a_fault_and_recovery_leaves_it_as_it_is() {
    let peer = UrPeer::start(UrPeerOptions::default());
    let mut link = connect(&peer);
    peer.next(Mishap::FaultsHalfWay);
    let state = go(&mut link, &GOAL_RAD).unwrap();
    assert!(
        matches!(&state, MoveState::Fault(words) if words.contains("PROTECTIVE_STOP") && words.contains("C153A2")),
        "{state:?}"
    );
    let halted_rad = peer.joints().joints_at(Instant::now());
    assert!(largest(&halted_rad, &GOAL_RAD) > 0.1);
    for _ in 0..2 {
        link.recover().unwrap();
        let refused = go(&mut link, &GOAL_RAD).unwrap();
        assert!(matches!(&refused, MoveState::Refused(words) if words.contains("PROTECTIVE_STOP")), "{refused:?}");
    }
    link.stop().unwrap();
    assert_eq!(peer.asked(), [""; 0], "no safety is reset by itself");
    assert_eq!(peer.joints().joints_at(Instant::now()), halted_rad);
    assert_eq!(peer.problems(), [""; 0]);
}

#[test]
fn a_protective_stop_is_released_when_a_person_has_confirmed() {
    let peer = UrPeer::start(UrPeerOptions::default());
    let mut link = connect(&peer);
    assert_eq!(link.intervention().unwrap(), None);
    peer.next(Mishap::FaultsHalfWay);
    assert!(matches!(go(&mut link, &GOAL_RAD).unwrap(), MoveState::Fault(_)));
    let needed = link.intervention().unwrap().unwrap();
    assert!(needed.what.contains("PROTECTIVE_STOP") && needed.what.contains("C153A2"), "{needed:?}");
    assert!(needed.remedy.contains("released when you confirm"), "{needed:?}");
    let halted_rad = peer.joints().joints_at(Instant::now());
    link.release().unwrap();
    assert_eq!(peer.asked()[..2], ["close safety popup", "unlock protective stop"]);
    assert_eq!(link.intervention().unwrap(), None);
    std::thread::sleep(Duration::from_millis(50));
    assert_eq!(peer.joints().joints_at(Instant::now()), halted_rad, "the program that was paused does not go on");
    assert_eq!(peer.programs().last().unwrap(), "stopj(4.0)\n");
    assert_eq!(go(&mut link, &GOAL_RAD).unwrap(), MoveState::Reached);
    assert_eq!(peer.problems(), [""; 0]);
}

#[test]
fn what_the_dashboard_refuses_is_told_to_whoever_is_asked_next() {
    let peer = UrPeer::start(UrPeerOptions { pace: 1.0, ..UrPeerOptions::default() });
    let mut link = UrLink::connect("127.0.0.1", peer.ports(), Patience { recover: Duration::ZERO, ..patience() }).unwrap();
    peer.next(Mishap::FaultsHalfWay);
    link.start_move(&joint_vector(&GOAL_RAD), &JointSpeed { revolute_rad_s: 2.0, ..SPEED }).unwrap();
    assert!(matches!(end_of_move(&mut link).unwrap(), MoveState::Fault(_)));
    assert!(link.intervention().unwrap().is_some());
    link.release().unwrap();
    let needed = link.intervention().unwrap().unwrap();
    assert!(needed.what.contains("inspect cause"), "{needed:?}");
}

#[test]
fn no_other_stop_is_released_from_afar() {
    let peer = UrPeer::start(UrPeerOptions::default());
    let mut link = connect(&peer);
    for (robot_mode, safety_mode, named) in
        [(7, 5, "SAFEGUARD_STOP"), (7, 7, "ROBOT_EMERGENCY_STOP"), (7, 9, "FAULT"), (3, 1, "POWER_OFF")]
    {
        peer.set_modes(robot_mode, safety_mode);
        std::thread::sleep(Duration::from_millis(50));
        let needed = link.intervention().unwrap().unwrap();
        assert!(needed.what.contains(named) && needed.remedy.contains("at the controller"), "{needed:?}");
        link.release().unwrap();
        assert_eq!(link.intervention().unwrap().unwrap(), needed);
    }
    assert_eq!(peer.asked(), [""; 0]);
    // Somebody has released a protective stop at the pendant, and then confirms.
    peer.set_modes(7, 3);
    std::thread::sleep(Duration::from_millis(50));
    assert!(link.intervention().unwrap().is_some());
    peer.set_modes(7, 1);
    std::thread::sleep(Duration::from_millis(50));
    link.release().unwrap();
    assert_eq!(peer.asked(), [""; 0]);
}

#[test]
fn local_control_is_for_a_person_to_end() {
    let peer = UrPeer::start(UrPeerOptions::default());
    let mut link = connect(&peer);
    peer.set_remote(false);
    let needed = link.intervention().unwrap().unwrap();
    assert!(needed.what.contains("local control") && needed.remedy.contains("remote control"), "{needed:?}");
    peer.set_remote(true);
    // What comes between the question and the key was not looked at.
    peer.set_modes(7, 3);
    std::thread::sleep(Duration::from_millis(50));
    link.release().unwrap();
    assert_eq!(peer.asked(), [""; 0]);
    assert!(link.intervention().unwrap().unwrap().what.contains("PROTECTIVE_STOP"));
    peer.set_modes(7, 1);
    std::thread::sleep(Duration::from_millis(50));
    assert_eq!(link.intervention().unwrap(), None);
    assert_eq!(go(&mut link, &GOAL_RAD).unwrap(), MoveState::Reached);
}

#[test]
fn from_local_to_remote_control_the_link_connects_anew() {
    let peer = UrPeer::start(UrPeerOptions::default());
    peer.set_remote(false);
    let mut link = connect(&peer);
    let state = go(&mut link, &GOAL_RAD).unwrap();
    assert!(matches!(&state, MoveState::Refused(words) if words.contains("local control")), "{state:?}");
    // The connection stays, and nothing tells that it is deaf but how it was made.
    peer.set_remote(true);
    assert_eq!(go(&mut link, &GOAL_RAD).unwrap(), MoveState::Reached);
    assert_eq!(peer.programs().len(), 1);
}

#[test]
fn a_connection_that_local_control_closed_is_made_anew() {
    let peer = UrPeer::start(UrPeerOptions::default());
    let mut link = connect(&peer);
    assert_eq!(go(&mut link, &GOAL_RAD).unwrap(), MoveState::Reached);
    peer.set_remote(false);
    std::thread::sleep(Duration::from_millis(50));
    let state = go(&mut link, &[0.0; 6]).unwrap();
    assert!(matches!(&state, MoveState::Refused(words) if words.contains("local control")), "{state:?}");
    link.stop().unwrap();
    peer.set_remote(true);
    assert_eq!(go(&mut link, &[0.0; 6]).unwrap(), MoveState::Reached);
    // There and back between two moves.
    peer.set_remote(false);
    std::thread::sleep(Duration::from_millis(50));
    peer.set_remote(true);
    assert_eq!(go(&mut link, &GOAL_RAD).unwrap(), MoveState::Reached);
}

/// Waits until a controller has taken what was sent.
fn wait_for_program(peer: &UrPeer, program: &str) {
    let deadline = Instant::now() + Duration::from_secs(2);
    while peer.programs().last().is_none_or(|last| last != program) {
        assert!(Instant::now() < deadline, "`{program}` does not come: {:?}", peer.programs());
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn what_stops_the_robot_is_not_lost_over_a_connection_of_local_control() {
    // Whether or not the dashboard was asked while the controller was in local control.
    for is_asked in [false, true] {
        let peer = UrPeer::start(UrPeerOptions { pace: 1.0, ..UrPeerOptions::default() });
        let mut link = connect(&peer);
        link.start_move(&joint_vector(&GOAL_RAD), &SPEED).unwrap();
        let until = Instant::now() + Duration::from_millis(200);
        while Instant::now() < until {
            assert_eq!(link.poll().unwrap(), MoveState::Moving);
        }
        peer.set_paused(true);
        peer.set_remote(false);
        std::thread::sleep(Duration::from_millis(50));
        link.poll().unwrap();
        // The connection is closed; the one that is made for this is deaf.
        link.stop().unwrap();
        std::thread::sleep(Duration::from_millis(50));
        assert_eq!(peer.programs().len(), 1);
        if is_asked {
            assert!(link.intervention().unwrap().unwrap().what.contains("local control"));
        }
        peer.set_remote(true);
        link.recover().unwrap();
        wait_for_program(&peer, "stopj(4.0)\n");
        let paused_rad = peer.joints().joints_at(Instant::now());
        peer.set_paused(false);
        std::thread::sleep(Duration::from_millis(100));
        assert_eq!(peer.joints().joints_at(Instant::now()), paused_rad, "the program that was paused does not go on");
        assert_eq!(go(&mut link, &paused_rad).unwrap(), MoveState::Reached);
    }
    // Connected in local control.
    let peer = UrPeer::start(UrPeerOptions::default());
    peer.set_remote(false);
    let mut link = connect(&peer);
    peer.set_remote(true);
    link.stop().unwrap();
    wait_for_program(&peer, "stopj(4.0)\n");
}

#[test]
fn a_controller_that_knows_no_remote_control_is_moved_all_the_same() {
    let peer = UrPeer::start(UrPeerOptions { tells_control: false, ..UrPeerOptions::default() });
    let mut link = connect(&peer);
    assert_eq!(go(&mut link, &GOAL_RAD).unwrap(), MoveState::Reached);
}
