//! Universal Robots: what comes while somebody or something else is waited for is known before anything is concluded from it.

use std::time::Duration;

use ballbar_tests::peers::ur::{UrPeer, UrPeerOptions};
use host_cal::robot_link::{MoveState, RobotLink};

use super::ur::{GOAL_RAD, SPEED, connect};
use super::{joint_vector, patience};

const NORMAL: i32 = 1;
const PROTECTIVE_STOP: i32 = 3;
const RUNNING: i32 = 7;

/// Until what the controller does is in a package.
const SOON: Duration = Duration::from_millis(50);

#[test]
fn what_came_during_a_long_wait_is_known_at_its_end() {
    let [tripped, asked, cleared] = [(); 3].map(|()| UrPeer::start(UrPeerOptions::default()));
    let [mut start, mut ask, mut release] = [&tripped, &asked, &cleared].map(connect);
    cleared.set_modes(RUNNING, PROTECTIVE_STOP);
    std::thread::sleep(SOON);
    assert!(release.intervention().unwrap().unwrap().what.contains("PROTECTIVE_STOP"));

    // Nobody listens for 700 packages, and things change with the last hundred.
    std::thread::sleep(Duration::from_millis(4800));
    tripped.set_modes(RUNNING, PROTECTIVE_STOP);
    asked.set_modes(RUNNING, PROTECTIVE_STOP);
    cleared.set_modes(RUNNING, NORMAL);
    std::thread::sleep(Duration::from_millis(800));

    start.start_move(&joint_vector(&GOAL_RAD), &SPEED).unwrap();
    let state = start.poll().unwrap();
    assert!(matches!(&state, MoveState::Refused(words) if words.contains("PROTECTIVE_STOP")), "{state:?}");
    assert_eq!(tripped.programs(), [""; 0], "nothing was sent");
    assert!(ask.intervention().unwrap().unwrap().what.contains("PROTECTIVE_STOP"));
    release.release().unwrap();
    assert_eq!(cleared.asked(), [""; 0], "a stop that is cleared is not released");
    assert_eq!(release.intervention().unwrap(), None);
}

#[test]
fn a_stop_that_came_after_the_one_that_was_told_is_not_released() {
    let peer = UrPeer::start(UrPeerOptions::default());
    let mut link = connect(&peer);
    peer.set_modes(RUNNING, PROTECTIVE_STOP);
    std::thread::sleep(SOON);
    assert!(link.intervention().unwrap().is_some());
    // Somebody releases it at the teach pendant, and the robot stops again, before the key is pressed.
    peer.set_modes(RUNNING, NORMAL);
    std::thread::sleep(SOON);
    peer.set_modes(RUNNING, PROTECTIVE_STOP);
    std::thread::sleep(SOON);
    link.release().unwrap();
    assert_eq!(peer.asked(), [""; 0], "nobody has looked at this one");
    assert!(link.intervention().unwrap().unwrap().what.contains("PROTECTIVE_STOP"));
    link.release().unwrap();
    assert_eq!(peer.asked().last().unwrap(), "unlock protective stop");
    assert_eq!(link.intervention().unwrap(), None);
}

#[test]
fn what_a_controller_said_before_it_fell_silent_is_not_of_now() {
    let peer = UrPeer::start(UrPeerOptions::default());
    let mut link = connect(&peer);
    std::thread::sleep(SOON);
    peer.set_silent(true);
    std::thread::sleep(patience().answer);
    // What is read now for the first time was said before.
    let needed = link.intervention().unwrap().unwrap();
    assert!(needed.what.contains("nothing heard"), "{needed:?}");
    assert_eq!(link.joints().unwrap(), None);
    link.start_move(&joint_vector(&GOAL_RAD), &SPEED).unwrap();
    assert!(matches!(link.poll().unwrap(), MoveState::Refused(words) if words.contains("nothing heard")));
    peer.set_silent(false);
    assert_eq!(link.intervention().unwrap(), None);
    assert!(link.joints().unwrap().is_some());
}
