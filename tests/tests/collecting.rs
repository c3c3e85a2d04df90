//! `host-cal collect` over a virtual board and a simulated robot, with robots, bars and people that do not what they should.
#![cfg(unix)]

use std::collections::VecDeque;
use std::process::Stdio;
use std::time::{Duration, Instant};

use ballbar::JointVector;
use ballbar_tests::command::host_cal_command;
use ballbar_tests::simulated_cell::{SHORT_PLAN, SimulatedCell, column, plant, quick};
use host_cal::collect::{CollectError, Ended, Event, Operator, RowState, Wish};
use host_cal::robot_link::sim::{SimClient, SimHand, SimLink, SimRequest};
use host_cal::robot_link::{JointSpeed, LinkError, MoveState, RobotLink};
use host_cal::session::Connection;
use host_cal::virtual_board::{Order, driver};

const SIGMA_M: f64 = 7e-5;

fn cell() -> SimulatedCell {
    SimulatedCell::start(plant(3), SIGMA_M, &SHORT_PLAN)
}

/// The simulation's hand, with wishes that come when so many poses were measured, and a grip that may be wrong.
struct Crew {
    hand: SimHand,
    is_done: bool,
    measured: usize,
    wishes: VecDeque<(usize, Wish)>,
    /// How often the bar is attached to the wrong sphere before it is attached as asked for.
    wrong: usize,
    /// How often it is left on when it should come off.
    left_on: usize,
    told: Vec<String>,
}

impl Crew {
    fn new(cell: &SimulatedCell) -> Self {
        let (wishes, told) = (VecDeque::new(), Vec::new());
        Self { hand: cell.hand(), is_done: false, measured: 0, wishes, wrong: 0, left_on: 0, told }
    }

    fn wishing(cell: &SimulatedCell, wishes: &[(usize, Wish)]) -> Self {
        Self { wishes: wishes.iter().copied().collect(), ..Self::new(cell) }
    }

    fn attach(&mut self, bar: &Connection) -> Result<(), LinkError> {
        let is_wrong = self.wrong > 0;
        self.wrong = self.wrong.saturating_sub(1);
        let chuck = if is_wrong { "B".to_owned() } else { bar.chuck.clone() };
        self.hand.act(&SimRequest::Attach { chuck, sphere: bar.sphere.clone(), mid_m: bar.bar_m })
    }
}

impl Operator for Crew {
    fn tell(&mut self, event: &Event<'_>) -> Result<(), LinkError> {
        match event {
            Event::Attach(bar) => {
                self.attach(bar)?;
                self.is_done = true;
            }
            Event::Detach(_) => {
                if self.left_on > 0 {
                    self.left_on -= 1;
                } else {
                    self.hand.act(&SimRequest::Detach)?;
                }
                self.is_done = true;
            }
            Event::Measured(_) => self.measured += 1,
            Event::Now(_) => return Ok(()),
            _ => {}
        }
        self.told.push(format!("{event:?}"));
        Ok(())
    }

    fn wish(&mut self) -> Option<Wish> {
        if std::mem::take(&mut self.is_done) {
            return Some(Wish::Confirm);
        }
        let is_due = self.wishes.front().is_some_and(|(measured, _)| self.measured >= *measured);
        if is_due { self.wishes.pop_front().map(|(_, wish)| wish) } else { None }
    }
}

/// A controller that does as it should but at one move, counted from the first.
struct Flawed {
    link: SimLink,
    client: SimClient,
    flaw: Flaw,
    at: usize,
    /// How many moves from there on it is flawed at.
    times: usize,
    moves: usize,
    began: Instant,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Flaw {
    /// Says that it has arrived and has not moved.
    Lies,
    /// Will not.
    Refuses,
    /// Stops half way.
    Faults,
    /// Goes where it was not sent.
    Strays,
    /// Loses the bar half way.
    DropsBar,
    /// Says nothing any more.
    IsGone,
}

impl Flawed {
    fn new(cell: &SimulatedCell, flaw: Flaw, at: usize, times: usize) -> Self {
        let client = SimClient::connect(&cell.address).unwrap();
        Self { link: cell.link(), client, flaw, at, times, moves: 0, began: Instant::now() }
    }

    fn is_flawed(&self) -> bool {
        (self.at..self.at + self.times).contains(&self.moves)
    }
}

impl RobotLink for Flawed {
    fn name(&self) -> String {
        "flawed".into()
    }

    fn start_move(&mut self, q: &JointVector<f64>, speed: &JointSpeed) -> Result<(), LinkError> {
        self.moves += 1;
        self.began = Instant::now();
        if !self.is_flawed() {
            return self.link.start_move(q, speed);
        }
        match self.flaw {
            Flaw::Lies | Flaw::Refuses => Ok(()),
            // Slow enough to be caught on the way; the pace is free, so that the wall's time says little.
            Flaw::Faults | Flaw::DropsBar => {
                self.link.start_move(q, &JointSpeed { revolute_rad_s: speed.revolute_rad_s / 3000.0, ..*speed })
            }
            Flaw::Strays => {
                let mut astray = *q;
                astray.as_array_mut()[0] += 0.3;
                self.link.start_move(&astray, &JointSpeed { revolute_rad_s: speed.revolute_rad_s / 3000.0, ..*speed })
            }
            Flaw::IsGone => Err(LinkError::Lost { address: "here".into(), reason: "unplugged".into() }),
        }
    }

    fn poll(&mut self) -> Result<MoveState, LinkError> {
        if !self.is_flawed() {
            return self.link.poll();
        }
        let is_under_way = self.began.elapsed() > Duration::from_millis(20);
        match self.flaw {
            Flaw::Lies => Ok(MoveState::Reached),
            Flaw::Refuses => Ok(MoveState::Refused("*Out of range*".into())),
            Flaw::Faults if is_under_way => {
                self.link.stop()?;
                Ok(MoveState::Fault("*Envelope error*".into()))
            }
            Flaw::DropsBar if is_under_way => {
                self.client.act(&SimRequest::Detach)?;
                self.link.poll()
            }
            _ => self.link.poll(),
        }
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
}

fn measured_lines(cell: &SimulatedCell, session: &str) -> Vec<String> {
    column(&cell.path(session), "plan_row")
}

#[test]
fn a_plan_is_walked_to_its_end_without_a_hand_on_it() {
    let cell = cell();
    let run = cell.collect("session", &["--json", "--temperature-c", "21.5"]);
    assert_eq!(run.code, 0, "{}", run.transcript());
    let report = run.json();
    assert_eq!((&report["status"], &report["measured"], &report["left"]), (&"done".into(), &24.into(), &0.into()));
    assert_eq!(report["losses"]["missing"], 0);
    assert!(report["repeats"].as_array().unwrap().iter().all(|repeat| repeat["difference_mm"].as_f64().unwrap().abs() < 1.0));
    cell.assert_all_measured("session");
    for name in ["plan.csv", "robot.toml", "rig.toml", "stream.bbl", "session.toml"] {
        assert!(cell.path("session").join(name).is_file(), "{name}");
    }
    let description = std::fs::read_to_string(cell.path("session/session.toml")).unwrap();
    assert!(description.contains("robot_link = \"sim at ") && description.contains("temperature_c = 21.5"), "{description}");

    // The session alone is enough for the others.
    let rank = cell.host_cal(&["rank", "session", "--json"]);
    assert_eq!(rank.json()["rank"], 24, "{}", rank.transcript());
    assert_eq!(column(&cell.path("session"), "bar_mm"), vec!["460"; 24]);

    // There is nothing left to do.
    let run = cell.collect("session", &["--json"]);
    assert_eq!((run.code, &run.json()["poses_written"]), (0, &0.into()), "{}", run.transcript());
    cell.assert_all_measured("session");
}

#[test]
fn a_killed_collection_goes_on_where_it_was_and_measures_nothing_twice() {
    let cell = cell();
    let mut kills = 0;
    loop {
        let args = cell.collect_args("session");
        let args: Vec<&str> = args.iter().map(String::as_str).collect();
        let mut child = host_cal_command(cell.folder.path(), &args)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let before = if kills == 0 { 0 } else { measured_lines(&cell, "session").len() };
        let ended = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break Some(status);
            }
            let has_poses = cell.path("session/poses.csv").is_file();
            if has_poses && measured_lines(&cell, "session").len() >= before + 5 {
                child.kill().unwrap();
                child.wait().unwrap();
                break None;
            }
            std::thread::sleep(Duration::from_millis(1));
        };
        if let Some(status) = ended {
            assert!(status.success());
            break;
        }
        kills += 1;
    }
    assert!(kills >= 2, "killed {kills} times");
    cell.assert_all_measured("session");
    let check = cell.host_cal(&["log", "check", "session"]);
    assert_eq!(check.code, 0, "{}", check.transcript());
}

#[test]
fn a_controller_that_claims_to_be_there_is_not_believed() {
    let cell = cell();
    let mut crew = Crew::new(&cell);
    let mut link = Flawed::new(&cell, Flaw::Lies, 6, 1);
    let collected = cell.collect_with("session", Some(&mut link), &mut crew, quick());
    assert!(matches!(collected.ended, Err(CollectError::Elsewhere { .. })), "{:?}", collected.ended);
    let before = collected.count(&RowState::Measured);
    assert_eq!(measured_lines(&cell, "session").len(), before);

    let collected = cell.collect_with("session", Some(&mut cell.link()), &mut crew, quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Done);
    cell.assert_all_measured("session");
}

#[test]
fn a_robot_that_strays_is_stopped() {
    let cell = cell();
    let mut crew = Crew::new(&cell);
    let mut link = Flawed::new(&cell, Flaw::Strays, 5, 1);
    let collected = cell.collect_with("session", Some(&mut link), &mut crew, quick());
    assert!(matches!(collected.ended, Err(CollectError::OffTheWay { joint: 1, .. })), "{:?}", collected.ended);
    let stands = |link: &mut Flawed| link.joints().unwrap().unwrap();
    let stopped = stands(&mut link);
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!(stands(&mut link), stopped);
}

#[test]
fn a_move_that_faults_is_tried_again() {
    let cell = cell();
    let mut crew = Crew::new(&cell);
    let mut link = Flawed::new(&cell, Flaw::Faults, 6, 2);
    let collected = cell.collect_with("session", Some(&mut link), &mut crew, quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Done, "{:?}", crew.told);
    assert_eq!(collected.summary.troubles.len(), 2, "{:?}", collected.summary.troubles);
    assert!(collected.summary.troubles[0].contains("*Envelope error*"));
    cell.assert_all_measured("session");
}

#[test]
fn a_row_that_the_controller_refuses_is_gone_around() {
    let cell = cell();
    let mut crew = Crew::new(&cell);
    let mut link = Flawed::new(&cell, Flaw::Refuses, 4, 1);
    let collected = cell.collect_with("session", Some(&mut link), &mut crew, quick());
    match collected.ended {
        Ok(ended) => {
            assert_eq!(ended, Ended::Done);
            assert_eq!(collected.count(&RowState::Todo), 0);
            let missed = collected.states.iter().filter(|state| matches!(state, RowState::Missed(_))).count();
            assert_eq!(missed + collected.count(&RowState::Measured), 24);
            assert!(missed <= 4, "{missed} rows were missed for one refusal");
        }
        // No clear way past that row: said so, and nothing lost.
        Err(CollectError::Blocked { .. }) => {}
        Err(error) => panic!("{error}"),
    }
    let collected = cell.collect_with("session", Some(&mut cell.link()), &mut crew, quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Done);
    cell.assert_all_measured("session");
}

#[test]
fn a_controller_that_is_gone_ends_the_run_and_another_goes_on() {
    let cell = cell();
    let mut crew = Crew::new(&cell);
    let mut link = Flawed::new(&cell, Flaw::IsGone, 9, 1);
    let collected = cell.collect_with("session", Some(&mut link), &mut crew, quick());
    assert!(matches!(collected.ended, Err(CollectError::Robot(LinkError::Lost { .. }))), "{:?}", collected.ended);
    let collected = cell.collect_with("session", Some(&mut cell.link()), &mut crew, quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Done);
    cell.assert_all_measured("session");
}

#[test]
fn a_bar_that_comes_off_stops_the_robot_and_is_attached_again() {
    let cell = cell();
    let mut crew = Crew::new(&cell);
    let mut link = Flawed::new(&cell, Flaw::DropsBar, 7, 1);
    let collected = cell.collect_with("session", Some(&mut link), &mut crew, quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Done, "{:?}", crew.told);
    assert!(collected.summary.troubles.iter().any(|words| words.contains("the bar came off")));
    cell.assert_all_measured("session");

    let mut link = Flawed::new(&cell, Flaw::DropsBar, 7, 1000);
    let collected = cell.collect_with("other", Some(&mut link), &mut crew, quick());
    assert!(matches!(collected.ended, Err(CollectError::BarOff { .. })), "{:?}", collected.ended);
}

#[test]
fn a_bar_that_is_attached_elsewhere_is_noticed() {
    let cell = cell();
    let mut crew = Crew { wrong: 1, ..Crew::new(&cell) };
    let collected = cell.collect_with("session", Some(&mut cell.link()), &mut crew, quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Done);
    assert!(collected.summary.troubles[0].contains("A:1 with the 460 mm bar"), "{:?}", collected.summary.troubles);
    cell.assert_all_measured("session");

    let cell = self::cell();
    let mut crew = Crew { wrong: 3, ..Crew::new(&cell) };
    let collected = cell.collect_with("other", Some(&mut cell.link()), &mut crew, quick());
    assert!(matches!(collected.ended, Err(CollectError::WrongConnection { .. })), "{:?}", collected.ended);
    assert_eq!(measured_lines(&cell, "other").len(), 0);
}

#[test]
fn a_bar_that_is_still_on_keeps_the_robot_where_it_is() {
    let cell = cell();
    let mut crew = Crew { left_on: 1, ..Crew::new(&cell) };
    let collected = cell.collect_with("session", Some(&mut cell.link()), &mut crew, quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Done);
    assert!(collected.summary.troubles.iter().any(|words| words.contains("is the bar off?")), "{:?}", crew.told);

    let cell = self::cell();
    let mut crew = Crew { left_on: 3, ..Crew::new(&cell) };
    let collected = cell.collect_with("other", Some(&mut cell.link()), &mut crew, quick());
    assert!(matches!(collected.ended, Err(CollectError::StillOn { .. })), "{:?}", collected.ended);
}

#[test]
fn poses_can_be_erased_skipped_and_waited_with() {
    let cell = cell();
    let wishes = [(3, Wish::EraseLast), (5, Wish::Skip), (7, Wish::Pause), (7, Wish::Resume), (12, Wish::Quit)];
    let mut crew = Crew::wishing(&cell, &wishes);
    let collected = cell.collect_with("session", Some(&mut cell.link()), &mut crew, quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Quit);
    assert_eq!(collected.count(&RowState::Skipped), 1);
    assert_eq!(measured_lines(&cell, "session").len(), 11, "twelve measured, one of them erased and measured again");

    let collected = cell.collect_with("session", Some(&mut cell.link()), &mut Crew::new(&cell), quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Done);
    let mut lines = measured_lines(&cell, "session");
    lines.sort();
    lines.dedup();
    assert_eq!(lines.len(), 23, "what was skipped stays so");
}

#[test]
fn a_robot_that_is_driven_by_hand_is_followed() {
    let (mut drive, driven) = driver();
    let cell = SimulatedCell::driven_by_hand(plant(3), driven, &SHORT_PLAN);
    /// Attaches the bar where it is asked for, drives to what it is told, and a little beside it.
    struct Pendant<'a> {
        driver: &'a mut host_cal::virtual_board::Driver,
        is_done: bool,
    }
    impl Operator for Pendant<'_> {
        fn tell(&mut self, event: &Event<'_>) -> Result<(), LinkError> {
            let rig = ballbar_tests::simulated_cell::rig();
            match event {
                Event::Attach(bar) => {
                    self.wait();
                    let (chuck, sphere) = (rig.chuck(&bar.chuck).unwrap(), rig.sphere(&bar.sphere).unwrap());
                    let pairing = rig.pairing(host_cal::files::PairingId { chuck, sphere });
                    let bar = host_cal::virtual_board::AttachedBar { pairing, mid_m: bar.bar_m };
                    self.give(Order::Attach { bar, length_error_m: 0.0 });
                }
                Event::Detach(_) => self.give(Order::Detach),
                Event::Drive { q, .. } => {
                    let mut beside = **q;
                    beside.as_array_mut()[5] += 0.01;
                    let speed = JointSpeed { revolute_rad_s: 2.0, ..JointSpeed::default() };
                    self.driver.give(Order::Move { q: beside, speed, dwell_s: 1.0, length_error_m: 0.0 });
                }
                _ => {}
            }
            Ok(())
        }

        fn wish(&mut self) -> Option<Wish> {
            std::mem::take(&mut self.is_done).then_some(Wish::Confirm)
        }
    }
    impl Pendant<'_> {
        fn give(&mut self, order: Order) {
            self.driver.give(order);
            self.wait();
            self.is_done = true;
        }

        fn wait(&self) {
            while self.driver.stance().is_moving {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
    }

    let mut pendant = Pendant { driver: &mut drive, is_done: false };
    let collected = cell.collect_with("session", None, &mut pendant, quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Done);
    cell.assert_all_measured("session");
}

#[test]
fn a_board_that_falls_silent_ends_the_run() {
    let cell = cell();
    struct Unplugs {
        crew: Crew,
        board: Option<host_cal::virtual_board::VirtualBoard>,
    }
    impl Operator for Unplugs {
        fn tell(&mut self, event: &Event<'_>) -> Result<(), LinkError> {
            if self.crew.measured == 5 {
                self.board = None;
            }
            self.crew.tell(event)
        }
        fn wish(&mut self) -> Option<Wish> {
            self.crew.wish()
        }
    }
    let mut link = cell.link();
    let crew = Crew::new(&cell);
    let SimulatedCell { folder, board, address, plan } = cell;
    let port = board.port().to_owned();
    // The same cell, whose board the operator unplugs.
    let spare = ballbar_tests::simulated_cell::plant(1);
    let options = host_cal::virtual_board::VirtualBoardOptions::new(spare, host_cal::virtual_board::Pace::Real);
    let stand_in = host_cal::virtual_board::VirtualBoard::start(options).unwrap();
    let mut unplugs = Unplugs { crew, board: Some(board) };
    let cell = SimulatedCell { folder, board: stand_in, address, plan };
    let collected = cell.collect_at(&port, "session", Some(&mut link), &mut unplugs, quick());
    assert!(
        matches!(
            collected.ended,
            Err(CollectError::Port(_) | CollectError::Board(_) | CollectError::Silent { .. } | CollectError::Robot(_))
        ),
        "{:?}",
        collected.ended
    );
    assert_eq!(measured_lines(&cell, "session").len(), collected.count(&RowState::Measured));
}
