//! The command against a board that says what cannot be true, and against peers that never finish what they say.
#![cfg(unix)]

mod endless;

use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use ballbar::wire::{Answer, BoardHello, Event, MAX_FRAME, PROTOCOL, ResetReason, Stream, ToHost, encode};
use ballbar_calib::simulate::Shells;
use ballbar_tests::command::{Run, host_cal_command, host_cal_in};
use ballbar_tests::simulated_cell::{SHORT_PLAN, SimulatedCell, plant};
use ballbar_tests::tampered_line::TamperedLine;
use ballbar_tests::terminal::AtTerminal;
use host_cal::board::parameter_set;
use host_cal::files::{open_rig, open_robot};
use host_cal::robot_link::JointSpeed;
use host_cal::virtual_board::{Pace, Plant, Script, VirtualBoard, VirtualBoardOptions};
use serialport::{SerialPort, TTYPort};
use tempfile::TempDir;

/// A board that is ready, and whose robot visits so many poses as soon as a host streams.
fn board(poses: usize) -> VirtualBoard {
    let (truth, design) = (open_robot("puma560-optimised").unwrap(), open_robot("puma560").unwrap());
    let rig = open_rig("triangles").unwrap();
    let pairings = rig.all_pairings();
    let shells = Shells {
        planned_with: &design,
        truth: &truth,
        rig: &rig,
        pairings: &pairings[..1],
        bar_m: 0.46,
        per_pairing: poses,
        sigma_m: 84e-6,
        seed: 7,
    };
    let speed = JointSpeed { revolute_rad_s: 20.0, ..JointSpeed::default() };
    let script = Script::from_shells(&shells, 0.7, speed, || ()).unwrap();
    let plant = Plant::new(&truth, 0.075, 7).unwrap();
    let parameters = Some(parameter_set(&design, plant.lvdt()).unwrap());
    let options = VirtualBoardOptions { parameters, is_homed: true, ..VirtualBoardOptions::new(plant, Pace::Real) };
    let mut board = VirtualBoard::start(options).unwrap();
    board.play_with_stream(script);
    board
}

/// What is made of the nth pose that settles.
type Change = fn(Stream, &[Stream]) -> Vec<Stream>;

/// A line on which the poses that settle are changed, each in its turn, and nothing else.
fn line(board: &VirtualBoard, changes: &'static [Change]) -> TamperedLine {
    let mut past: Vec<Stream> = Vec::new();
    TamperedLine::start(board.port(), move |message| match message {
        ToHost::Stream(stream) if matches!(stream.event, Event::Settled(_)) => {
            let sent = match changes.get(past.len()) {
                Some(change) => change(stream.clone(), &past),
                None => vec![stream.clone()],
            };
            past.push(stream);
            sent.into_iter().map(ToHost::Stream).collect()
        }
        other => vec![other],
    })
}

fn with(mut stream: Stream, change: impl FnOnce(&mut ballbar::SettledPose)) -> Stream {
    if let Event::Settled(pose) = &mut stream.event {
        change(pose);
    }
    stream
}

fn record(folder: &Path, line: &TamperedLine, poses: &str) -> Run {
    let args =
        ["--session", "s", "--rig", "triangles", "--pairing", "A:1", "--bar", "460", "--poses", poses, "--for", "60s", "--json"];
    host_cal_in(folder, &[&["stream", line.port()], &args[..]].concat())
}

fn rows(folder: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(folder.join("s/poses.csv")).unwrap();
    text.lines().skip(1).map(str::to_owned).collect()
}

fn distinct(rows: &[String]) -> usize {
    rows.iter().collect::<std::collections::BTreeSet<_>>().len()
}

#[test]
fn false_poses_beside_true_ones_are_refused_kept_in_the_log_and_never_written() {
    const CHANGES: &[Change] = &[
        |s, _| vec![s.clone(), s.clone(), s],
        |s, _| vec![with(s.clone(), |pose| pose.counts_mean[0] = f64::NAN), s],
        |s, _| vec![with(s.clone(), |pose| (pose.counts_mean.truncate(2), pose.counts_std.truncate(2)).0), s],
        |s, _| vec![with(s.clone(), |pose| pose.code_mean = 1e300), s],
        |s, _| vec![Stream { sequence: s.sequence.wrapping_add(1 << 31), ..s.clone() }, s],
        |s, past| vec![s, past[0].clone()],
        |s, _| vec![with(s.clone(), |pose| pose.t_us = u64::MAX), s],
    ];
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let board = board(20);
    let line = line(&board, CHANGES);
    let run = record(folder, &line, "8");
    assert_eq!(run.code, 1, "{}", run.transcript());
    let report = run.json();
    assert_eq!((report["settled"].as_u64(), report["poses_written"].as_u64()), (Some(8), Some(8)));
    let refused = serde_json::json!({"wrong_count": 1, "not_finite": 1, "out_of_range": 2, "went_back": 1, "repeated": 3});
    assert_eq!((&report["losses"]["refused"], &report["losses"]["missing"]), (&refused, &0.into()), "{report}");
    assert!(run.stderr.contains("a message of the board is not believed: 2 encoders instead of 6"), "{}", run.stderr);
    let rows = rows(folder);
    assert_eq!((rows.len(), distinct(&rows)), (8, 8));
    assert!(rows.iter().all(|row| !row.contains("NaN") && !row.contains(",0.000000000,0.000000000,0.000000000,")), "{rows:?}");

    // The log has all that came, and who reads it believes no more of it.
    let check = host_cal_in(folder, &["log", "check", "s", "--json"]);
    assert_eq!((check.code, &check.json()["losses"]["refused"]), (1, &refused), "{}", check.transcript());
    let exported = host_cal_in(folder, &["log", "export", "s", "--csv", "s.csv", "--mcap", "s.mcap", "--json"]);
    assert_eq!((exported.code, &exported.json()["losses"]["refused"]), (1, &refused), "{}", exported.transcript());
    assert_eq!(exported.json()["settled"], 8);
    assert!(exported.stderr.contains("REFUSED: 8 messages that cannot be true"), "{}", exported.stderr);
    let mcap = std::fs::read(folder.join("s.mcap")).unwrap();
    let mcap = String::from_utf8_lossy(&mcap);
    assert!(mcap.contains("a message is not believed: 2 encoders instead of 6") && !mcap.contains("\"code_mean\":null"));
}

#[test]
fn poses_that_came_false_are_lost_and_end_the_command_otherwise_than_well() {
    const CHANGES: &[Change] = &[
        |s, _| vec![s],
        |s, _| vec![with(s, |pose| (pose.counts_mean.truncate(2), pose.counts_std.truncate(2)).0)],
        |s, _| vec![with(s, |pose| pose.counts_std[2] = f32::NAN)],
    ];
    let folder = TempDir::new().unwrap();
    // Three are true; a robot with more would be on its way to the next, which is kept if it comes before the stream has ended.
    let board = board(5);
    let line = line(&board, CHANGES);
    let run = record(folder.path(), &line, "3");
    assert_eq!(run.code, 1, "{}", run.transcript());
    let report = run.json();
    let losses = &report["losses"];
    assert_eq!(
        (&losses["missing"], &losses["refused"]["wrong_count"], &losses["refused"]["not_finite"]),
        (&0.into(), &1.into(), &1.into())
    );
    let rows = rows(folder.path());
    assert_eq!((rows.len(), distinct(&rows)), (3, 3), "those that are true are written");
    assert_eq!((&report["settled"], &report["poses_written"]), (&3.into(), &3.into()));
}

#[test]
fn messages_that_only_come_twice_cost_nothing() {
    const CHANGES: &[Change] = &[|s, _| vec![s.clone(), s], |s, past| vec![past[0].clone(), s.clone(), s]];
    let folder = TempDir::new().unwrap();
    let board = board(20);
    let line = line(&board, CHANGES);
    let run = record(folder.path(), &line, "3");
    assert_eq!((run.code, &run.json()["losses"]["refused"]["repeated"]), (0, &3.into()), "{}", run.transcript());
    let rows = rows(folder.path());
    assert_eq!((rows.len(), distinct(&rows)), (3, 3));
}

#[test]
fn no_command_prints_what_cannot_be_true() {
    let folder = TempDir::new().unwrap();
    let board = board(1);
    type Spoil = fn(&mut Answer);
    let cases: [(&str, Spoil, &str); 6] = [
        (
            "pose",
            |a| {
                if let Answer::CurrentPose(pose) = a {
                    pose.q[3] = f32::NAN
                }
            },
            "a joint value is not a finite number",
        ),
        (
            "pose",
            |a| {
                if let Answer::CurrentPose(pose) = a {
                    pose.q.truncate(2)
                }
            },
            "2 joint values instead of 6",
        ),
        (
            "pose",
            |a| {
                if let Answer::CurrentPose(pose) = a {
                    pose.pose.position_m = [f32::INFINITY; 3]
                }
            },
            "the tool's position is not a finite",
        ),
        (
            "pose",
            |a| {
                if let Answer::CurrentPose(pose) = a {
                    pose.pose.position_m[1] = 3.4e38
                }
            },
            "the tool's position is out of range",
        ),
        (
            "pose",
            |a| {
                if let Answer::Parameters(set) = a {
                    set.parameters[6] = f32::NAN
                }
            },
            "its parameters cannot be used",
        ),
        (
            "status",
            |a| {
                if let Answer::Status(status) = a {
                    status.encoders.truncate(1)
                }
            },
            "1 encoders instead of 6",
        ),
    ];
    for (command, spoil, words) in cases {
        let line = TamperedLine::start(board.port(), move |mut message| {
            if let ToHost::Reply(reply) = &mut message
                && let Ok(answer) = &mut reply.outcome
            {
                spoil(answer);
            }
            vec![message]
        });
        for json in [&[][..], &["--json"]] {
            let run = host_cal_in(folder.path(), &[&[command, line.port()], json].concat());
            let message = run.stderr.split_whitespace().collect::<Vec<_>>().join(" ").replace("│ ", "");
            assert!(run.code == 2 && run.stdout.is_empty() && message.contains(words), "{words}: {}", run.transcript());
        }
    }
}

#[test]
fn lvdt_ends_with_ctrl_c_alone() {
    let folder = TempDir::new().unwrap();
    let board = board(1);
    let args = ["lvdt", board.port(), "--bar", "460", "--lengths", "425,440,455,470,485,495"];
    let mut terminal = AtTerminal::start(folder.path(), &args, (100, 30));
    terminal.wait_for("press Enter when it stands");
    let began = Instant::now();
    terminal.press("\u{3}");
    let (code, text) = terminal.finish();
    assert!(code == 130 && text.contains("ended before all lengths were measured: 0 of 6"), "{code}: {text}");
    assert!(began.elapsed() < Duration::from_secs(3), "{:?}", began.elapsed());
    let status = host_cal_in(folder.path(), &["status", board.port(), "--json"]).json();
    assert_eq!(status["streaming"], false);
}

#[test]
fn joints_beyond_the_limits_are_warned_of_where_these_are_known() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let board = board(20);
    let home = |q: &str, more: &[&str]| host_cal_in(folder, &[&["home", board.port(), "--q", q, "--json"], more].concat());
    let unknown = home("0,0,0,0,0,0", &[]);
    assert!(unknown.code == 0 && unknown.json()["beyond_limits"].is_null(), "{}", unknown.transcript());
    let within = home("0,0,0,0,0,0", &["--robot", "puma560"]);
    assert_eq!((within.code, &within.json()["beyond_limits"]), (0, &serde_json::json!([])), "{}", within.transcript());
    let other = home("0,0,0,0,0,0", &["--robot", "scara"]);
    assert!(other.code == 2 && other.stderr.contains("has 4 joints, the board's robot 6"), "{}", other.transcript());
    let beyond = home("170,0,0,0,0,0", &["--robot", "puma560"]);
    assert!(beyond.code == 0 && beyond.stderr.contains("joint 1 at 170 deg is beyond its limits"), "{}", beyond.transcript());

    // Its robot stood at zero in truth: wherever it goes, joint 1 is told to be beyond its limits.
    assert_eq!(home("350,0,0,0,0,0", &[]).code, 0);
    let stream = |more: &[&str]| {
        let args = ["stream", board.port(), "--settled", "--poses", "2", "--for", "60s", "--json"];
        host_cal_in(folder, &[&args[..], more].concat())
    };
    let run = stream(&["--robot", "puma560"]);
    assert!(run.json()["beyond_limits"].as_u64() >= Some(1), "{}", run.transcript());
    assert!(run.stderr.contains("is the board homed where the robot stands?"), "{}", run.stderr);
    assert!(stream(&[]).json()["beyond_limits"].is_null());
}
