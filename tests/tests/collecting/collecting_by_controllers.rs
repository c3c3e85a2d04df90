//! A plan walked through the links to real controllers' emulations, with the simulated robot following what they do.
#![cfg(unix)]

use std::cell::Cell;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use ballbar::JointVector;
use ballbar_tests::command::host_cal_command;
use ballbar_tests::crew::Crew;
use ballbar_tests::peers::ur::{UrPeer, UrPeerOptions};
use ballbar_tests::peers::val::{ValPeer, ValPeerOptions};
use ballbar_tests::peers::{JointsAt, Mishap};
use ballbar_tests::simulated_cell::{DESIGN, RIG, SHORT_PLAN, SimulatedCell, column, plant, quick};
use ballbar_tests::terminal::AtTerminal;
use host_cal::collect::{CollectError, Ended, Event, Operator, Wish};
use host_cal::robot_link::sim::{SimClient, SimRequest};
use host_cal::robot_link::urscript::UrLink;
use host_cal::robot_link::val::{VAL_BAUD, ValLink, ValSpeeds};
use host_cal::robot_link::{Intervention, JointSpeed, LinkError, MoveState, Patience, RobotLink};

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

/// A controller whose arm stands where the simulated robot does.
fn ur() -> UrPeer {
    UrPeer::start(UrPeerOptions { q_rad: [0.0; 6], pace: PACE, ..UrPeerOptions::default() })
}

#[test]
fn a_universal_robots_controller_walks_a_plan() {
    let (cell, peer) = (cell(), ur());
    let _shadow = Shadow::start(&cell, peer.joints());
    let mut link = UrLink::connect("127.0.0.1", peer.ports(), Patience::default()).unwrap();
    assert_eq!(measures_three(&cell, &mut link), [""; 0]);
    assert_eq!(peer.problems(), [""; 0]);
}

/// Looks at a robot for a while before it confirms, and does something meanwhile.
struct Looks<'a> {
    crew: Crew,
    peer: &'a UrPeer,
    /// What is done at the controller before it is confirmed.
    remedy: fn(&UrPeer),
    /// How often it was asked to look, and in which words.
    asked: Vec<String>,
    confirms_at: Option<Instant>,
    /// What the dashboard had been asked until it was confirmed.
    before_key: Vec<String>,
}

impl<'a> Looks<'a> {
    fn new(cell: &SimulatedCell, peer: &'a UrPeer, remedy: fn(&UrPeer)) -> Self {
        let crew = Crew::wishing(cell, &[(3, Wish::Quit)]);
        Self { crew, peer, remedy, asked: Vec::new(), confirms_at: None, before_key: Vec::new() }
    }
}

impl Operator for Looks<'_> {
    fn tell(&mut self, event: &Event<'_>) -> Result<(), LinkError> {
        if let Event::Inspect { place, needed } = event {
            self.asked.push(format!("{place}: {}", needed.what));
            self.confirms_at = Some(Instant::now() + Duration::from_secs(1));
        }
        self.crew.tell(event)
    }

    fn is_present(&self) -> bool {
        true
    }

    fn wish(&mut self) -> Option<Wish> {
        let Some(at) = self.confirms_at else { return self.crew.wish() };
        if Instant::now() < at {
            return None;
        }
        self.confirms_at = None;
        self.before_key.extend(self.peer.asked());
        (self.remedy)(self.peer);
        Some(Wish::Confirm)
    }
}

#[test]
fn a_protective_stop_is_released_by_the_operator_s_key_and_by_nothing_else() {
    let (cell, peer) = (cell(), ur());
    let _shadow = Shadow::start(&cell, peer.joints());
    let mut link = UrLink::connect("127.0.0.1", peer.ports(), Patience::default()).unwrap();
    peer.next(Mishap::FaultsHalfWay);
    let mut looks = Looks::new(&cell, &peer, |_| ());
    let collected = cell.collect_with("session", Some(&mut link), &mut looks, quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Quit, "{:?}", looks.crew.told);
    assert_eq!(column(&cell.path("session"), "plan_row").len(), 3);
    assert_eq!(looks.before_key, [""; 0], "nothing is reset before the key");
    let [asked] = &looks.asked[..] else { panic!("asked once: {:?}", looks.asked) };
    for words in ["on the way to line ", "PROTECTIVE_STOP", "C153A2: position deviates from path"] {
        assert!(asked.contains(words), "{asked}");
    }
    assert!(peer.asked().contains(&"unlock protective stop".to_owned()));
    let troubles = &collected.summary.troubles;
    for words in ["the robot stood on the way", "the operator has confirmed", "trying again"] {
        assert!(troubles.iter().any(|trouble| trouble.contains(words)), "{troubles:?}");
    }
    assert_eq!(peer.problems(), [""; 0]);
}

#[test]
fn a_run_goes_on_when_the_controller_is_back_in_remote_control_or_has_been_seen_to() {
    type Act = fn(&UrPeer);
    let cases: [(&str, Act, Act); 2] = [
        ("local control", |peer| peer.set_remote(false), |peer| peer.set_remote(true)),
        ("ROBOT_EMERGENCY_STOP", |peer| peer.set_modes(7, 7), |peer| peer.set_modes(7, 1)),
    ];
    for (what, spoil, remedy) in cases {
        let (cell, peer) = (cell(), ur());
        let _shadow = Shadow::start(&cell, peer.joints());
        let mut link = UrLink::connect("127.0.0.1", peer.ports(), Patience::default()).unwrap();
        spoil(&peer);
        let mut looks = Looks::new(&cell, &peer, remedy);
        let collected = cell.collect_with("session", Some(&mut link), &mut looks, quick());
        assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Quit, "{what}: {:?}", looks.crew.told);
        assert!(looks.asked.len() == 1 && looks.asked[0].contains(what), "{:?}", looks.asked);
        assert_eq!(column(&cell.path("session"), "plan_row").len(), 3, "{what}");
        assert_eq!(peer.asked(), [""; 0], "{what}");
    }
}

#[test]
fn with_nobody_there_a_protective_stop_ends_the_run_and_stays() {
    let (cell, peer) = (cell(), ur());
    let _shadow = Shadow::start(&cell, peer.joints());
    let mut link = UrLink::connect("127.0.0.1", peer.ports(), Patience::default()).unwrap();

    /// Trips the robot when three poses are measured; is not there.
    struct Absent<'a> {
        crew: Crew,
        peer: &'a UrPeer,
    }
    impl Operator for Absent<'_> {
        fn tell(&mut self, event: &Event<'_>) -> Result<(), LinkError> {
            self.crew.tell(event)?;
            if matches!(event, Event::Measured(_)) && self.crew.measured == 3 {
                self.peer.next(Mishap::FaultsHalfWay);
            }
            Ok(())
        }
        fn wish(&mut self) -> Option<Wish> {
            self.crew.wish()
        }
    }
    let mut absent = Absent { crew: Crew::new(&cell), peer: &peer };
    let collected = cell.collect_with("session", Some(&mut link), &mut absent, quick());
    let error = collected.ended.unwrap_err();
    assert!(matches!(&error, CollectError::NobodyToLook { what, .. } if what.contains("PROTECTIVE_STOP")), "{error}");
    assert!(error.to_string().contains("on the way to line "), "{error}");
    assert_eq!(column(&cell.path("session"), "plan_row").len(), 3, "all that was measured is kept");
    assert_eq!(peer.asked(), [""; 0], "the stop is left as it is");
}

#[test]
fn a_speed_slider_at_zero_is_said_and_waited_for() {
    let (cell, peer) = (cell(), ur());
    let _shadow = Shadow::start(&cell, peer.joints());
    let mut link = UrLink::connect("127.0.0.1", peer.ports(), Patience::default()).unwrap();
    peer.set_speed(0.0, 1.0);

    /// Moves the slider when the robot is said to wait.
    struct Slides<'a> {
        crew: Crew,
        peer: &'a UrPeer,
    }
    impl Operator for Slides<'_> {
        fn tell(&mut self, event: &Event<'_>) -> Result<(), LinkError> {
            if matches!(event, Event::Trouble(words) if words.contains("the robot waits: the speed slider is at 0")) {
                self.peer.set_speed(0.5, 1.0);
            }
            self.crew.tell(event)
        }
        fn wish(&mut self) -> Option<Wish> {
            self.crew.wish()
        }
    }
    let mut slides = Slides { crew: Crew::wishing(&cell, &[(3, Wish::Quit)]), peer: &peer };
    let collected = cell.collect_with("session", Some(&mut link), &mut slides, quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Quit, "{:?}", slides.crew.told);
    assert!(slides.crew.told.iter().any(|words| words.contains("the robot goes on")), "{:?}", slides.crew.told);
    assert_eq!(column(&cell.path("session"), "plan_row").len(), 3);
}

/// A link that notes when it was listened to.
struct Noted {
    link: UrLink,
    heard_at: Rc<Cell<Instant>>,
}

impl RobotLink for Noted {
    fn name(&self) -> String {
        self.link.name()
    }
    fn start_move(&mut self, q: &JointVector<f64>, speed: &JointSpeed) -> Result<(), LinkError> {
        self.link.start_move(q, speed)
    }
    fn poll(&mut self) -> Result<MoveState, LinkError> {
        self.link.poll()
    }
    fn joints(&mut self) -> Result<Option<JointVector<f64>>, LinkError> {
        self.link.joints()
    }
    fn stop(&mut self) -> Result<(), LinkError> {
        self.link.stop()
    }
    fn recover(&mut self) -> Result<(), LinkError> {
        self.link.recover()
    }
    fn intervention(&mut self) -> Result<Option<Intervention>, LinkError> {
        self.link.intervention()
    }
    fn release(&mut self) -> Result<(), LinkError> {
        self.link.release()
    }
    fn listen(&mut self) -> Result<(), LinkError> {
        self.heard_at.set(Instant::now());
        self.link.listen()
    }
}

/// Takes a second for everything, and looks whether the controller is heard meanwhile.
struct TakesItsTime {
    crew: Crew,
    heard_at: Rc<Cell<Instant>>,
    next: Option<(Instant, Wish)>,
    /// Wishes that came after the controller was heard, and those before which it was not.
    heard: Vec<Wish>,
    unheard: Vec<Wish>,
}

impl Operator for TakesItsTime {
    fn tell(&mut self, event: &Event<'_>) -> Result<(), LinkError> {
        self.crew.tell(event)
    }

    fn is_present(&self) -> bool {
        true
    }

    fn wish(&mut self) -> Option<Wish> {
        let now = Instant::now();
        let Some((due, wish)) = self.next.take() else {
            self.next = self.crew.wish().map(|wish| (now + Duration::from_secs(1), wish));
            return None;
        };
        if now < due {
            self.next = Some((due, wish));
            return None;
        }
        let is_heard = self.heard_at.get().elapsed() < Duration::from_millis(400);
        if is_heard {
            self.heard.push(wish)
        } else {
            self.unheard.push(wish)
        }
        Some(wish)
    }
}

#[test]
fn the_controller_is_heard_while_a_person_is_waited_for() {
    let (cell, peer) = (cell(), ur());
    let _shadow = Shadow::start(&cell, peer.joints());
    let link = UrLink::connect("127.0.0.1", peer.ports(), Patience::default()).unwrap();
    let heard_at = Rc::new(Cell::new(Instant::now()));
    let mut link = Noted { link, heard_at: Rc::clone(&heard_at) };
    peer.next(Mishap::FaultsHalfWay);
    let crew = Crew::wishing(&cell, &[(1, Wish::Pause), (1, Wish::Resume), (2, Wish::Quit)]).looking();
    let mut operator = TakesItsTime { crew, heard_at, next: None, heard: Vec::new(), unheard: Vec::new() };
    let collected = cell.collect_with("session", Some(&mut link), &mut operator, quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Quit, "{:?}", operator.crew.told);
    assert_eq!(operator.unheard, [], "after {:?}", operator.heard);
    for wish in [Wish::Confirm, Wish::Pause, Wish::Resume, Wish::Quit] {
        assert!(operator.heard.contains(&wish), "{wish:?}: {:?}", operator.heard);
    }
    for told in ["Detach", "Inspect", "Attach"] {
        assert!(operator.crew.told.iter().any(|words| words.starts_with(told)), "{told}: {:?}", operator.crew.told);
    }
    assert_eq!(peer.problems(), [""; 0]);
}

/// Arguments of `host-cal collect` by a controller.
fn collect_args(peer: &UrPeer) -> Vec<String> {
    let ports = peer.ports();
    let ports = format!("{},{},{}", ports.script, ports.rtde, ports.dashboard);
    let words = ["collect", "port", "--session", "session", "--plan", "plan.csv", "--robot", DESIGN, "--rig", RIG];
    let link = ["--robot-link", "urscript", "--robot-address", "127.0.0.1", "--robot-ports", &ports, "--rate", "200"];
    [&words[..], &link].concat().into_iter().map(str::to_owned).collect()
}

#[test]
fn the_command_with_yes_ends_at_a_protective_stop_and_says_so() {
    let (cell, peer) = (cell(), ur());
    let _shadow = Shadow::start(&cell, peer.joints());
    peer.next(Mishap::FaultsHalfWay);
    let args = collect_args(&peer);
    let args: Vec<&str> = args.iter().map(String::as_str).chain(["--yes"]).collect();
    let run = cell.host_cal(&args);
    assert_eq!(run.code, 2, "{}", run.transcript());
    for words in ["PROTECTIVE_STOP", "C153A2", "nothing was released", "Look at the robot", "without --yes"] {
        assert!(run.stderr.contains(words), "{words}: {}", run.transcript());
    }
    assert!(run.stdout.contains("The same command goes on."), "{}", run.transcript());
    assert_eq!(peer.asked(), [""; 0]);
}

#[test]
fn the_command_asks_at_the_terminal_and_releases_at_the_key() {
    let (cell, peer) = (cell(), ur());
    let _shadow = Shadow::start(&cell, peer.joints());
    peer.next(Mishap::FaultsHalfWay);
    let args = collect_args(&peer);
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let mut run = AtTerminal::start(cell.folder.path(), &args, (120, 50));
    run.wait_for("then press Enter");
    run.press("\r");
    run.wait_for("THE ROBOT STANDS on the way to line ");
    run.wait_for("it is released when you confirm, then press Enter");
    assert!(run.text().contains("C153A2"), "{}", run.text());
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(peer.asked(), [""; 0]);
    run.press("\r");
    run.wait_for("the operator has confirmed");
    assert_eq!(peer.asked().last().unwrap(), "unlock protective stop");
    run.wait_for("Attach the bar");
    run.press("q");
    let (code, text) = run.finish();
    assert_eq!(code, 1, "{text}");
}

#[test]
fn what_was_typed_before_the_stop_does_not_release_it() {
    let (cell, peer) = (cell(), ur());
    let _shadow = Shadow::start(&cell, peer.joints());
    peer.next(Mishap::FaultsHalfWay);
    let args = collect_args(&peer);
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    // Ten times Enter, and then nobody any more.
    let mut command = host_cal_command(cell.folder.path(), &args);
    let mut child = command
        .stdin(std::process::Stdio::piped())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    std::io::Write::write_all(&mut child.stdin.take().unwrap(), &[b'\n'; 10]).unwrap();
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("THE ROBOT STANDS"), "{said}");
    assert!(!said.contains("the operator has confirmed"), "{said}");
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert_eq!(peer.asked(), [""; 0]);
}

#[test]
fn a_universal_robots_controller_that_lies_is_found_out() {
    let (cell, peer) = (cell(), ur());
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
