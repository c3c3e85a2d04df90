//! `host-cal collect` over a virtual board and a simulated robot, with bars and people that do not what they should.
#![cfg(unix)]

use std::process::Stdio;
use std::time::Duration;

use ballbar::JointVector;
use ballbar_tests::command::host_cal_command;
use ballbar_tests::crew::Crew;
use ballbar_tests::simulated_cell::{SHORT_PLAN, SimulatedCell, column, design, plant, poses_of, quick, rig};
use host_cal::collect::{CollectError, Ended, Event, Operator, RowState, Wish};
use host_cal::robot_link::sim::{SimLink, SimRequest};
use host_cal::robot_link::{JointSpeed, LinkError, MoveState, RobotLink};
use host_cal::virtual_board::{Order, driver};

const SIGMA_M: f64 = 7e-5;

fn cell() -> SimulatedCell {
    SimulatedCell::start(plant(3), SIGMA_M, &SHORT_PLAN)
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
    assert_eq!(
        (&report["status"], &report["measured"], &report["left"]),
        (&"done".into(), &poses_of(&SHORT_PLAN).into(), &0.into())
    );
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
    assert_eq!(rank.json()["rank"], poses_of(&SHORT_PLAN), "{}", rank.transcript());
    assert_eq!(column(&cell.path("session"), "bar_mm"), vec!["460"; poses_of(&SHORT_PLAN)]);

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
fn a_bar_that_is_attached_elsewhere_is_noticed() {
    let cell = cell();
    let mut crew = Crew::new(&cell).wrong(1);
    let collected = cell.collect_with("session", Some(&mut cell.link()), &mut crew, quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Done);
    assert!(collected.summary.troubles[0].contains("A:1 with the 460 mm bar"), "{:?}", collected.summary.troubles);
    cell.assert_all_measured("session");

    let cell = self::cell();
    let mut crew = Crew::new(&cell).wrong(3);
    let collected = cell.collect_with("other", Some(&mut cell.link()), &mut crew, quick());
    assert!(matches!(collected.ended, Err(CollectError::WrongConnection { .. })), "{:?}", collected.ended);
    assert_eq!(measured_lines(&cell, "other").len(), 0);
}

#[test]
fn a_bar_that_is_still_on_keeps_the_robot_where_it_is() {
    let cell = cell();
    // The first time nobody knows whether it is on.
    let mut crew = Crew::new(&cell).left_on(2);
    let collected = cell.collect_with("session", Some(&mut cell.link()), &mut crew, quick());
    assert_eq!(*collected.ended.as_ref().unwrap(), Ended::Done);
    assert!(collected.summary.troubles.iter().any(|words| words.contains("is the bar off?")), "{:?}", crew.told);

    let cell = self::cell();
    let mut crew = Crew::new(&cell).left_on(4);
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
    assert_eq!(lines.len(), poses_of(&SHORT_PLAN) - 1, "what was skipped stays so");
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
                    let pairing = rig.pairing(ballbar_calib::model::PairingId { chuck, sphere });
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

#[test]
fn a_bar_that_follows_the_robot_is_not_off() {
    let cell = cell();
    let mut link = cell.link();
    let mut hand = cell.hand();
    let move_to = |link: &mut SimLink, q: &JointVector<f64>| {
        link.start_move(q, &JointSpeed::default()).unwrap();
        while link.poll().unwrap() == MoveState::Moving {
            std::thread::sleep(Duration::from_millis(1));
        }
    };
    // Beside the plan, with the bar on, where the way to the plan changes its length.
    let row = cell.rows()[0].q;
    let pairing = rig().pairing(cell.rows()[0].pairing);
    let kinematics = ballbar::Kinematics::new(&design().chain);
    let beside = (0..6).flat_map(|joint| [0.02, 0.05].map(|by| (joint, by))).map(|(joint, by)| {
        let mut q = row;
        q.as_array_mut()[joint] += by;
        q
    });
    let change_m = |q: &JointVector<f64>| (kinematics.length(q, &pairing) - kinematics.length(&row, &pairing)).abs();
    let q =
        beside.into_iter().find(|q| (0.004..0.015).contains(&change_m(q))).expect("some joint moves the sphere along the bar");
    move_to(&mut link, &q);
    hand.act(&SimRequest::Attach { chuck: "A".into(), sphere: "1".into(), mid_m: 0.46 }).unwrap();
    let mut crew = Crew::new(&cell).left_on(1);
    let collected = cell.collect_with("session", Some(&mut link), &mut crew, quick());
    assert!(matches!(collected.ended, Err(CollectError::StillOn { .. })), "{:?} {:?}", collected.ended, crew.told);
}

#[test]
fn a_plan_that_leads_into_something_is_not_driven() {
    let cell = cell();
    // Without its via points the way is no way.
    let straight: String = cell.plan.lines().filter(|line| !line.starts_with("via")).flat_map(|line| [line, "\n"]).collect();
    std::fs::write(cell.path("plan.csv"), straight).unwrap();
    let run = cell.collect("session", &[]);
    assert_eq!(run.code, 2, "{}", run.transcript());
    assert!(run.stderr.contains("the plan has "), "{}", run.stderr);
    assert!(!cell.path("session").exists());
}
