//! The books of a recording under way: what they write is what the log gives back.

use std::path::Path;

use ballbar::wire::{Answer, Event, ParameterSet, Reply, Stream, ToHost};
use ballbar::{SettledPose, StillnessCriteria};
use host_cal::board::{Frame, RobotOnBoard, nominal_lvdt, parameter_set};
use host_cal::files::open_robot;
use host_cal::record::{Account, Fate, News, Watched};
use host_cal::session::{Connection, LoggedPoses, Recorder, missing_poses};
use tempfile::TempDir;

use super::session_recovery::{ALL_HOMED, begin, connection, frame, hello};

/// Far apart for the criteria that a board begins with, and at one place by these.
const WIDE: StillnessCriteria = StillnessCriteria { hold_us: 500_000, band_counts: 500, band_codes: 500 };

fn set() -> ParameterSet {
    parameter_set(&open_robot("puma560").unwrap(), nominal_lvdt(0.075)).unwrap()
}

/// What a board with the design says when it is greeted.
fn greeting() -> [Vec<u8>; 2] {
    let parameters = Reply { id: 1, outcome: Ok(Answer::Parameters(set())) };
    [frame(&ToHost::Hello(hello())), frame(&ToHost::Reply(parameters))]
}

fn watched(connection: Option<Connection>) -> Watched {
    Watched { robot: RobotOnBoard::new(set()), limits: None, connection, pairing: None, criteria: WIDE }
}

/// A recorder that somebody has connected already, by other criteria.
fn connected_otherwise(session: &Path) -> Recorder {
    let mut recorder = begin(session);
    greeting().iter().for_each(|frame| recorder.frame(frame).unwrap());
    recorder.connect_for_every_settled(connection(), StillnessCriteria::default()).unwrap();
    recorder
}

/// The arm settles after so many seconds, every encoder at `counts`.
fn settle(account: &mut Account, seconds: u32, counts: f64) -> Fate {
    let pose = SettledPose {
        index: seconds * 1_000,
        t_us: u64::from(seconds) * 1_000_000,
        duration_us: 500_001,
        samples: 500,
        counts_mean: [counts; 6].into_iter().collect(),
        counts_std: [0.0; 6].into_iter().collect(),
        code_mean: 30_000.0,
        code_std: 0.0,
    };
    let stream = Stream { sequence: seconds, dropped: 0, overruns: 0, homed: ALL_HOMED, event: Event::Settled(pose) };
    let frame = Frame { bytes: frame(&ToHost::Stream(stream.clone())), message: Ok(stream) };
    let news = account.take(&frame).unwrap();
    let Some(News::Settled(settled)) = news else { panic!("{news:?}") };
    settled.at.and_then(|at| at.bar).map(|(_, fate)| fate).expect("the bar is within its travel")
}

/// Poses in the log, and those that poses.csv lacks.
fn logged(session: &Path) -> (usize, usize) {
    let logged = LoggedPoses::read(session).unwrap();
    (logged.count(), missing_poses(session, &logged).unwrap().len())
}

#[test]
fn limits_of_another_robot_are_none_of_the_boards() {
    let with_limits = |name| Account::new(Watched { limits: Some(open_robot(name).unwrap()), ..watched(None) });
    assert!(with_limits("puma560").unwrap().knows_limits());
    let refused = with_limits("scara").err().expect("four joints are not six");
    assert_eq!((refused.found, refused.expected), (4, 6));
}

#[test]
fn what_is_written_and_what_the_log_gives_back_go_by_the_same_criteria() {
    let folder = TempDir::new().unwrap();
    let session = folder.path().join("s");
    let account = Account::new(watched(Some(connection()))).unwrap();
    let mut account = account.with_recorder(connected_otherwise(&session)).unwrap();
    assert_eq!(settle(&mut account, 1, 1_000.0), Fate::Written);
    account.lose().unwrap();
    let [hello, parameters] = greeting();
    account.regain(&hello, Some(&parameters)).unwrap();
    // The program ends on it: whether it was to be written, the log alone has to tell.
    assert_eq!(settle(&mut account, 2, 1_200.0), Fate::SameStand);
    account.end().unwrap();
    assert_eq!(account.counts().written, 1);
    assert_eq!(logged(&session), (1, 0));
}

#[test]
fn without_a_connection_nothing_is_written_although_the_recorder_had_one() {
    let folder = TempDir::new().unwrap();
    let session = folder.path().join("s");
    let account = Account::new(watched(None)).unwrap();
    let mut account = account.with_recorder(connected_otherwise(&session)).unwrap();
    assert_eq!(settle(&mut account, 1, 1_000.0), Fate::Seen { is_homed: true });
    account.end().unwrap();
    assert_eq!(logged(&session), (0, 0));
}
