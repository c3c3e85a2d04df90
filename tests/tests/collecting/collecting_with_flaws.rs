//! Collections by robots that do not what they are told, and what becomes of the run then.
#![cfg(unix)]

use std::time::{Duration, Instant};

use ballbar::JointVector;
use ballbar_tests::crew::Crew;
use ballbar_tests::simulated_cell::{SHORT_PLAN, SimulatedCell, column, plant, poses_of, quick};
use host_cal::collect::{CollectError, Ended, Event, Operator, RowState, Wish};
use host_cal::robot_link::sim::{SimClient, SimLink, SimRequest};
use host_cal::robot_link::{JointSpeed, LinkError, MoveState, RobotLink};

const SIGMA_M: f64 = 7e-5;

fn cell() -> SimulatedCell {
    SimulatedCell::start(plant(3), SIGMA_M, &SHORT_PLAN)
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
fn nothing_moves_while_controller_and_encoders_disagree() {
    let cell = cell();
    let run = cell.host_cal(&["home", "port", "--q", "0,-90,90,0,0,0"]);
    assert_eq!(run.code, 0, "{}", run.transcript());
    let mut link = cell.link();
    let before = link.joints().unwrap();
    let collected = cell.collect_with("session", Some(&mut link), &mut Crew::new(&cell), quick());
    assert!(matches!(collected.ended, Err(CollectError::Disagree { .. })), "{:?}", collected.ended);
    assert_eq!(link.joints().unwrap(), before);
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
    assert_eq!(collected.summary.troubles.len(), 2, "{:?}", crew.told);
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
            assert_eq!(missed + collected.count(&RowState::Measured), poses_of(&SHORT_PLAN));
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
fn an_operator_who_quits_stops_the_robot_on_its_way() {
    let cell = cell();

    /// Quits when the bar was on for a while: during the slow move.
    struct Quits {
        crew: Crew,
        looks: usize,
    }
    impl Operator for Quits {
        fn tell(&mut self, event: &Event<'_>) -> Result<(), LinkError> {
            self.crew.tell(event)
        }
        fn wish(&mut self) -> Option<Wish> {
            self.looks += usize::from(self.crew.measured >= 1);
            if self.looks > 300 { Some(Wish::Quit) } else { self.crew.wish() }
        }
    }
    let mut quits = Quits { crew: Crew::new(&cell), looks: 0 };
    let mut link = Slow(cell.link());
    let collected = cell.collect_with("session", Some(&mut link), &mut quits, quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Quit);
    let stopped = link.joints().unwrap().unwrap();
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!(link.joints().unwrap().unwrap(), stopped);
    let is_there = |q: &JointVector<f64>| q.as_array().iter().zip(stopped.as_array()).all(|(a, b)| (a - b).abs() < 1e-4);
    let at_a_row = collected.rows.iter().any(|row| is_there(&row.q));
    assert!(!at_a_row, "it was stopped between rows");
}

/// So slow with the bar on that no move ends within a test.
struct Slow(SimLink);

impl RobotLink for Slow {
    fn name(&self) -> String {
        "slow".into()
    }
    fn start_move(&mut self, q: &JointVector<f64>, speed: &JointSpeed) -> Result<(), LinkError> {
        let with_bar = self.0.joints()?.is_some_and(|from| (from.as_array()[0] - q.as_array()[0]).abs() < 0.2);
        let slower = if with_bar { 500.0 } else { 1.0 };
        self.0.start_move(q, &JointSpeed { revolute_rad_s: speed.revolute_rad_s / slower, ..*speed })
    }
    fn poll(&mut self) -> Result<MoveState, LinkError> {
        self.0.poll()
    }
    fn joints(&mut self) -> Result<Option<JointVector<f64>>, LinkError> {
        self.0.joints()
    }
    fn stop(&mut self) -> Result<(), LinkError> {
        self.0.stop()
    }
    fn recover(&mut self) -> Result<(), LinkError> {
        self.0.recover()
    }
}

#[test]
fn an_arm_that_was_moved_during_a_pause_is_brought_back() {
    let cell = cell();

    /// During the pause somebody jogs the arm, the bar on.
    struct Jogs {
        crew: Crew,
        link: SimLink,
        rows: Vec<ballbar_calib::plan::PlanRow>,
        is_jogged: bool,
    }
    impl Operator for Jogs {
        fn tell(&mut self, event: &Event<'_>) -> Result<(), LinkError> {
            if matches!(event, Event::Done(Wish::Pause)) && !self.is_jogged {
                self.is_jogged = true;
                let stood = self.link.joints()?.unwrap();
                // To some row of the same shell, which is a place with the bar inside its travel.
                let other = self.rows.iter().rev().find(|row| row.bar.is_some() && row.pairing == self.rows[1].pairing).unwrap();
                assert!((other.q.as_array()[0] - stood.as_array()[0]).abs() > 0.02);
                self.link.start_move(&other.q, &JointSpeed::default())?;
                while self.link.poll()? == MoveState::Moving {
                    std::thread::sleep(Duration::from_millis(1));
                }
            }
            self.crew.tell(event)
        }
        fn wish(&mut self) -> Option<Wish> {
            self.crew.wish()
        }
    }
    let crew = Crew::wishing(&cell, &[(2, Wish::Pause), (2, Wish::Resume)]);
    let mut jogs = Jogs { crew, link: cell.link(), rows: cell.rows(), is_jogged: false };
    let collected = cell.collect_with("session", Some(&mut cell.link()), &mut jogs, quick());
    match &collected.ended {
        Ok(ended) => {
            assert_eq!(*ended, Ended::Done);
            assert!(collected.summary.troubles.iter().any(|words| words.contains("was moved")), "{:?}", jogs.crew.told);
            cell.assert_all_measured("session");
        }
        // Without a clear way back nothing moves.
        Err(CollectError::Moved { .. }) => {}
        Err(error) => panic!("{error}"),
    }
}
