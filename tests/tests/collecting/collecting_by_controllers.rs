//! A plan walked through the links to real controllers' emulations, with the simulated robot following what they do.
#![cfg(unix)]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use ballbar_tests::crew::Crew;
use ballbar_tests::peers::ur::{UrPeer, UrPeerOptions};
use ballbar_tests::peers::val::{ValPeer, ValPeerOptions};
use ballbar_tests::peers::{JointsAt, Mishap};
use ballbar_tests::simulated_cell::{SHORT_PLAN, SimulatedCell, column, plant, quick};
use host_cal::collect::{CollectError, Ended, Wish};
use host_cal::robot_link::sim::{SimClient, SimRequest};
use host_cal::robot_link::urscript::UrLink;
use host_cal::robot_link::val::{VAL_BAUD, ValLink, ValSpeeds};
use host_cal::robot_link::{Patience, RobotLink};

/// How many times faster than in the world the controllers go.
const PACE: f64 = 10.0;

/// Lets the simulated robot do what a controller's does.
struct Shadow {
    is_ended: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Shadow {
    fn start(cell: &SimulatedCell, joints: JointsAt) -> Self {
        let mut client = SimClient::connect(&cell.address).unwrap();
        let is_ended = Arc::new(AtomicBool::new(false));
        let ended = Arc::clone(&is_ended);
        let follow = move || {
            let mut latest = [0.0; 6];
            while !ended.load(Ordering::Relaxed) {
                let q = joints.joints_at(Instant::now());
                if q != latest {
                    latest = q;
                    let request = SimRequest::Move { q: q.to_vec(), revolute_rad_s: 100.0, prismatic_m_s: 10.0 };
                    client.act(&request).unwrap();
                }
                std::thread::sleep(Duration::from_millis(10));
            }
        };
        Self { is_ended, thread: Some(std::thread::spawn(follow)) }
    }
}

impl Drop for Shadow {
    fn drop(&mut self) {
        self.is_ended.store(true, Ordering::Relaxed);
        let ended = self.thread.take().map_or(Ok(()), JoinHandle::join);
        assert!(ended.is_ok() || std::thread::panicking());
    }
}

fn cell() -> SimulatedCell {
    SimulatedCell::start(plant(3), 0.0, &SHORT_PLAN)
}

/// Measures three poses.
fn measures_three(cell: &SimulatedCell, link: &mut dyn RobotLink) -> Vec<String> {
    let mut crew = Crew::wishing(cell, &[(3, Wish::Quit)]);
    let collected = cell.collect_with("session", Some(link), &mut crew, quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Quit, "{:?}", crew.told);
    assert_eq!(column(&cell.path("session"), "plan_row").len(), 3);
    collected.summary.troubles
}

#[test]
fn a_universal_robots_controller_walks_a_plan_and_gets_over_a_protective_stop() {
    let cell = cell();
    let peer = UrPeer::start(UrPeerOptions { q_rad: [0.0; 6], pace: PACE, ..UrPeerOptions::default() });
    let _shadow = Shadow::start(&cell, peer.joints());
    let mut link = UrLink::connect("127.0.0.1", peer.ports(), Patience::default()).unwrap();
    peer.next(Mishap::FaultsHalfWay);
    let troubles = measures_three(&cell, &mut link);
    assert!(troubles.is_empty() || troubles.iter().any(|words| words.contains("trying again")), "{troubles:?}");
    assert_eq!(peer.problems(), [""; 0]);
}

#[test]
fn a_universal_robots_controller_that_lies_is_found_out() {
    let cell = cell();
    let peer = UrPeer::start(UrPeerOptions { q_rad: [0.0; 6], pace: PACE, ..UrPeerOptions::default() });
    let _shadow = Shadow::start(&cell, peer.joints());
    let mut link = UrLink::connect("127.0.0.1", peer.ports(), Patience::default()).unwrap();
    peer.next(Mishap::StandsElsewhereByMrad(30));
    let mut crew = Crew::wishing(&cell, &[(3, Wish::Quit)]);
    let collected = cell.collect_with("session", Some(&mut link), &mut crew, quick());
    assert!(matches!(collected.ended, Err(CollectError::Elsewhere { joint: 1, .. })), "{:?}", collected.ended);
    assert_eq!(column(&cell.path("session"), "plan_row").len(), 0);
}

#[test]
fn a_val_controller_walks_a_plan() {
    let cell = cell();
    let peer = ValPeer::start(ValPeerOptions { q_deg: [0.0; 6], pace: PACE, ..ValPeerOptions::default() });
    let _shadow = Shadow::start(&cell, peer.joints());
    let mut link = ValLink::open(peer.port(), VAL_BAUD, ValSpeeds::default(), Patience::default()).unwrap();
    let troubles = measures_three(&cell, &mut link);
    assert_eq!(troubles, [""; 0]);
    assert!(peer.lines().iter().any(|line| line.starts_with("DO MOVE")), "{:?}", peer.lines());
}
