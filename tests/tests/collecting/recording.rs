//! `host-cal stream --session` against a virtual board: what is kept when the program, the port or the disk is not.

use std::io::Write;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use ballbar::wire::{Event, Stream, ToHost};
use ballbar_calib::simulate::Shells;
use ballbar_tests::command::{Run, host_cal_command, host_cal_in};
use ballbar_tests::readers::{is_skipped, python};
use host_cal::board::parameter_set;
use host_cal::files::{open_rig, open_robot};
use host_cal::robot_link::JointSpeed;
use host_cal::session::{Description, LogReader, Record};
use host_cal::virtual_board::{Pace, Plant, Script, VirtualBoard, VirtualBoardOptions};
use tempfile::TempDir;

const PAIRING: [&str; 4] = ["--pairing", "A:1", "--bar", "460"];
/// Longer than anything here takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// A board that is homed, holds the design's parameters, and whose robot visits `poses` poses as soon as a host streams.
fn board(folder: &Path, poses: usize) -> VirtualBoard {
    board_with(folder, poses, true)
}

fn board_with(folder: &Path, poses: usize, is_homed: bool) -> VirtualBoard {
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
    let port_name = Some(folder.join("port"));
    let options = VirtualBoardOptions { parameters, is_homed, port_name, ..VirtualBoardOptions::new(plant, Pace::Real) };
    let mut board = VirtualBoard::start(options).unwrap();
    board.play_with_stream(script);
    board
}

fn start(folder: &Path, args: &[&str]) -> Child {
    host_cal_command(folder, args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("host-cal starts")
}

fn finish(child: Child) -> Run {
    let output = child.wait_with_output().expect("host-cal ends");
    let text = |bytes| String::from_utf8(bytes).expect("host-cal prints UTF-8");
    Run { code: output.status.code().expect("not killed"), stdout: text(output.stdout), stderr: text(output.stderr) }
}

fn wait_for(what: &str, mut is_so: impl FnMut() -> bool) {
    let began = Instant::now();
    while !is_so() {
        assert!(began.elapsed() < PATIENCE, "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn lines_of(path: &Path) -> usize {
    std::fs::read_to_string(path).map_or(0, |text| text.lines().count())
}

/// Asks a process to end, as Ctrl-C does.
fn interrupt(child: &Child) {
    let status = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(status.expect("there is a kill").success());
}

/// Whole and damaged frames of a session's log.
fn frames(session: &Path) -> (usize, usize) {
    let mut reader = LogReader::open(session).expect("a log");
    let (mut whole, mut damaged) = (0, 0);
    while let Some(record) = reader.next_record().expect("readable") {
        match record {
            Record::Message(_) | Record::Mark(_) => whole += 1,
            Record::Refused(reason) => panic!("a message that the board sent is not believed: {reason}"),
            Record::Damaged => damaged += 1,
        }
    }
    (whole, damaged)
}

#[test]
fn a_killed_recording_keeps_every_frame_and_is_gone_on_with() {
    let folder = TempDir::new().unwrap();
    let (folder, session) = (folder.path(), folder.path().join("s"));
    let _board = board(folder, 60);
    let args = [&["stream", "port", "--session", "s"], &PAIRING[..]].concat();
    let mut killed = start(folder, &args);
    wait_for("the first pose", || lines_of(&session.join("poses.csv")) >= 2);
    killed.kill().unwrap();
    killed.wait().unwrap();
    let (whole, damaged) = frames(&session);
    assert!(whole > 20 && damaged == 0, "{whole} whole frames, {damaged} damaged");
    let poses_before = lines_of(&session.join("poses.csv"));

    // As if it had been killed within a frame: half of one at the end of the log.
    let mut log = std::fs::OpenOptions::new().append(true).open(session.join("stream.bbl")).unwrap();
    log.write_all(&[7, 1, 2, 3]).unwrap();
    drop(log);
    let check = host_cal_in(folder, &["log", "check", "s", "--json"]);
    assert_eq!((check.code, check.json()["unfinished_bytes"].as_u64()), (0, Some(4)), "a torn end is no loss");

    let again = host_cal_in(folder, &[&args[..], &["--poses", "2", "--json"]].concat());
    assert_eq!(again.code, 0, "{}", again.stderr);
    assert_eq!(again.json()["poses_written"], 2);
    let recovered = again.json()["poses_recovered"].as_u64().unwrap() as usize;
    assert_eq!(lines_of(&session.join("poses.csv")), poses_before + recovered + 2, "nothing lost, nothing doubled");
    let (more, damaged) = frames(&session);
    assert!(more > whole && damaged == 1, "the torn frame counts once, what follows is whole: {more} {damaged}");
    let description = Description::read(&session).unwrap();
    let ended: Vec<bool> = description.runs.iter().map(|run| run.ended.is_some()).collect();
    assert_eq!(ended, [false, true], "the killed run has no end");
}

#[test]
fn an_unplugged_board_is_waited_for_and_marked_as_a_gap() {
    let folder = TempDir::new().unwrap();
    let (folder, session) = (folder.path(), folder.path().join("s"));
    let first = board(folder, 60);
    let recording = start(folder, &[&["stream", "port", "--session", "s", "--poses", "4", "--json"], &PAIRING[..]].concat());
    wait_for("the first pose", || lines_of(&session.join("poses.csv")) >= 2);
    drop(first);
    let _second = board(folder, 60);
    let run = finish(recording);
    assert_eq!(run.code, 1, "a gap is not nothing: {}", run.stderr);
    assert!(run.stderr.contains("port: the board is away: ") && run.stderr.contains("port: the board is back"), "{}", run.stderr);
    // The second board begins where the first one was: that pose is written once.
    assert_eq!((run.json()["gaps"].as_u64(), run.json()["poses_written"].as_u64()), (Some(1), Some(3)));
    assert_eq!(run.json()["losses"]["lost_on_line"], 0, "what the board did not send is a gap and not a loss");

    let check = host_cal_in(folder, &["log", "check", "s", "--json"]);
    assert_eq!((check.code, check.json()["gaps"].as_u64(), check.json()["damaged"].as_u64()), (1, Some(1), Some(0)));
    assert_eq!(check.json()["samples"], run.json()["samples"]);
    let files = ["--csv", "s.csv", "--parquet", "s.parquet", "--mcap", "s.mcap"];
    let exported = host_cal_in(folder, &[&["log", "export", "s", "--json"][..], &files].concat());
    assert_eq!((exported.code, exported.json()["gaps"].as_u64()), (1, Some(1)), "{}", exported.stderr);
    assert_eq!(exported.json()["samples"], run.json()["samples"]);
    assert_eq!(exported.json()["settled"], run.json()["settled"]);
    let table = std::fs::read_to_string(folder.join("s.csv")).unwrap();
    assert_eq!(table.lines().count() as u64, run.json()["samples"].as_u64().unwrap() + 1);
    let segments: std::collections::BTreeSet<&str> = table.lines().skip(1).filter_map(|line| line.split(',').next()).collect();
    assert_eq!(segments.len(), 2, "two stretches with the gap between them: {segments:?}");
    if !is_skipped() {
        let read =
            python("log_tables.py", &["s.csv", "s.parquet", "s.mcap"].map(|name| folder.join(name)).each_ref().map(|p| &**p));
        let read: serde_json::Value = serde_json::from_str(&read).unwrap();
        assert_eq!((&read["row_count"], &read["messages"]["/settled"]), (&run.json()["samples"], &run.json()["settled"]));
        // The host's clock and both boards' agree on when it was, to what greeting a board takes.
        let unix_us = |row: usize| read["rows"][row]["unix_us"].as_i64().unwrap() as f64;
        let now_us = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_micros() as f64;
        assert!(unix_us(0) < unix_us(1) && (0.0..60e6).contains(&(now_us - unix_us(1))), "{read}");
    }
}

#[test]
fn a_board_that_comes_back_without_its_homing_adds_no_poses() {
    let folder = TempDir::new().unwrap();
    let (folder, session) = (folder.path(), folder.path().join("s"));
    let first = board(folder, 60);
    let recording = start(folder, &[&["stream", "port", "--session", "s", "--poses", "3", "--json"], &PAIRING[..]].concat());
    wait_for("the first pose", || lines_of(&session.join("poses.csv")) >= 2);
    drop(first);
    let _second = board_with(folder, 60, false);
    let run = finish(recording);
    let (written, withheld) = (run.json()["poses_written"].as_u64().unwrap(), run.json()["poses_withheld"].as_u64().unwrap());
    assert!(run.code == 1 && withheld >= 1 && written + withheld == 3, "{written} written, {withheld} withheld: {}", run.stderr);
    assert!(run.stderr.contains("NOT HOMED"), "{}", run.stderr);
    assert_eq!(lines_of(&session.join("poses.csv")) as u64, written + 1, "counts that begin at zero are no joint angles");
}

#[test]
fn an_arm_that_still_stands_after_a_glitch_of_the_cable_is_written_once() {
    let folder = TempDir::new().unwrap();
    let (folder, session) = (folder.path(), folder.path().join("s"));
    // Both boards show the same first pose: to the host it is one arm that stood still while the port was away.
    let first = board(folder, 1);
    let recording = start(folder, &[&["stream", "port", "--session", "s", "--poses", "2", "--json"], &PAIRING[..]].concat());
    wait_for("the first pose", || lines_of(&session.join("poses.csv")) >= 2);
    drop(first);
    let _second = board(folder, 1);
    let run = finish(recording);
    assert_eq!((run.json()["settled"].as_u64(), run.json()["poses_written"].as_u64()), (Some(2), Some(1)), "{}", run.stderr);
    assert_eq!(lines_of(&session.join("poses.csv")), 2);
}

#[test]
fn a_board_with_other_parameters_ends_the_recording() {
    let folder = TempDir::new().unwrap();
    let (folder, session) = (folder.path(), folder.path().join("s"));
    let first = board(folder, 60);
    let recording = start(folder, &[&["stream", "port", "--session", "s", "--json"], &PAIRING[..]].concat());
    wait_for("the first pose", || lines_of(&session.join("poses.csv")) >= 2);
    drop(first);
    let plant = Plant::new(&open_robot("puma560-optimised").unwrap(), 0.075, 7).unwrap();
    let port_name = Some(folder.join("port"));
    let _bare = VirtualBoard::start(VirtualBoardOptions { port_name, ..VirtualBoardOptions::new(plant, Pace::Real) }).unwrap();
    let run = finish(recording);
    assert!(run.code == 2 && run.stderr.contains("came back with other parameters"), "{} {}", run.code, run.stderr);
    assert!(run.json()["poses_written"].as_u64() >= Some(1), "and says what was recorded before");
}

#[test]
fn a_refused_argument_leaves_no_session() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let _board = board(folder, 60);
    for bad in [["--rate", "50"], ["--rate", "5001"], ["--hold-ms", "9"], ["--for", "soon"], ["--bar", "-1"]] {
        let run = host_cal_in(folder, &[&["stream", "port", "--session", "s"], &bad[..]].concat());
        assert!(run.code == 2 && !folder.join("s").exists(), "{bad:?}: {} {}", run.code, run.stderr);
    }
}

#[test]
fn without_a_pairing_no_pose_is_said_to_be_written() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let _board = board(folder, 60);
    let run = host_cal_in(folder, &["stream", "port", "--session", "s", "--poses", "1", "--json"]);
    assert_eq!((run.code, run.json()["settled"].as_u64(), run.json()["poses_written"].as_u64()), (0, Some(1), Some(0)));
    assert!(run.stderr.contains("not to poses.csv") && !folder.join("s/poses.csv").exists(), "{}", run.stderr);
}

#[test]
fn ctrl_c_ends_a_recording_with_its_report() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let _board = board(folder, 60);
    let recording = start(folder, &["stream", "port", "--session", "s", "--raw", "--json"]);
    wait_for("a log", || std::fs::metadata(folder.join("s/stream.bbl")).is_ok_and(|log| log.len() > 20_000));
    interrupt(&recording);
    let run = finish(recording);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let samples = run.json()["samples"].as_u64().unwrap();
    assert!(samples > 500, "{samples}");
    assert_eq!(host_cal_in(folder, &["log", "check", "s", "--json"]).json()["samples"], samples);
    assert!(Description::read(&folder.join("s")).unwrap().runs[0].ended.is_some());
    let status = host_cal_in(folder, &["status", "port", "--json"]).json();
    assert_eq!(status["streaming"], false, "the stream was ended on the board too");
}

#[test]
fn a_recording_refuses_what_is_no_session_and_changes_nothing_there() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let _board = board(folder, 60);
    let session = folder.join("s");
    let cases = [
        ("stream.bbl", "not a log at all", "no log of a session"),
        (
            "stream.bbl",
            "BBL1\u{7}\u{0}\u{1}\u{1}\u{1}\u{1}\u{1}\u{1}\u{1}\u{1}\u{0}",
            "recorded with protocol 7 (0101010101010101)",
        ),
        ("session.toml", "runs = 3", "session.toml:1: "),
        ("session.toml", "[[runs]]\nstarted = \"2026", "session.toml:2: "),
        ("session.toml", "", "no [[runs]]"),
        ("poses.csv", "chuck,sphere,q1_deg,length_mm\nA,1,1.0,460.0\n", "poses.csv:1: the columns are"),
        ("poses.csv", "", "poses.csv:1: the columns are"),
    ];
    for (name, contents, message) in cases {
        let _ = std::fs::remove_dir_all(&session);
        std::fs::create_dir(&session).unwrap();
        std::fs::write(session.join(name), contents).unwrap();
        let run = host_cal_in(folder, &[&["stream", "port", "--session", "s", "--for", "1s"], &PAIRING[..]].concat());
        assert!(run.code == 2 && run.stderr.contains(message), "{name}: {} {}", run.code, run.stderr);
        assert_eq!(std::fs::read_to_string(session.join(name)).unwrap(), contents, "{name}");
    }
}

#[test]
fn the_poses_that_were_recorded_are_those_of_the_log_and_the_fit_reads_them() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let _board = board(folder, 4);
    let args = [&["stream", "port", "--session", "s", "--settled", "--poses", "4", "--rig", "triangles", "--json"], &PAIRING[..]]
        .concat();
    let run = host_cal_in(folder, &args);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert_eq!(
        (run.json()["settled"].as_u64(), run.json()["samples"].as_u64()),
        (Some(4), Some(0)),
        "nothing else was asked for"
    );
    let rank = host_cal_in(folder, &["rank", "--robot", "puma560", "--rig", "triangles", "s/poses.csv", "--json"]);
    assert_eq!(rank.json()["rank"], 4, "four lengths tell four things: {}", rank.stderr);
    let validate =
        host_cal_in(folder, &["validate", "--robot", "puma560-optimised", "--rig", "triangles", "s/poses.csv", "--json"]);
    let rms_mm = validate.json()["rms_mm"].as_f64().unwrap();
    assert!(rms_mm < 0.3, "the true robot explains what the board measured: {rms_mm} mm");
}

/// Times by the board's clock of the settled poses that a log holds and of those in poses.csv, microseconds, in order.
fn times_us(session: &Path) -> [Vec<u64>; 2] {
    let mut reader = LogReader::open(session).expect("a log");
    let mut settled = Vec::new();
    while let Some(record) = reader.next_record().expect("readable") {
        if let Record::Message(message) = record
            && let ToHost::Stream(Stream { event: Event::Settled(pose), .. }) = *message
        {
            settled.push(pose.t_us + u64::from(pose.duration_us / 2));
        }
    }
    let text = std::fs::read_to_string(session.join("poses.csv")).unwrap_or_default();
    let t_us = |line: &str| (line.split(',').nth(10).unwrap().parse::<f64>().unwrap() * 1e6) as u64;
    let mut written: Vec<u64> = text.lines().skip(1).filter(|line| !line.starts_with('#')).map(t_us).collect();
    settled.sort_unstable();
    written.sort_unstable();
    [settled, written]
}

#[test]
fn a_recording_killed_again_and_again_keeps_every_settled_pose_once_and_leaves_no_files_behind() {
    let folder = TempDir::new().unwrap();
    let (folder, session) = (folder.path(), folder.path().join("s"));
    let _board = board(folder, 60);
    let args = [&["stream", "port", "--session", "s"], &PAIRING[..]].concat();
    for kill in 1..=6 {
        let mut killed = start(folder, &args);
        wait_for("another pose", || lines_of(&session.join("poses.csv")) > kill);
        // Somewhere between now and the next pose.
        std::thread::sleep(Duration::from_millis(kill as u64 * 137 % 700));
        killed.kill().unwrap();
        killed.wait().unwrap();
    }
    // As if killed while poses.csv was written.
    std::fs::write(session.join(".host-cal-dEaD01.tmp"), "half of it").unwrap();
    std::fs::write(session.join(".host-cal-mine"), "somebody's").unwrap();
    let last = host_cal_in(folder, &[&args[..], &["--for", "100ms", "--json"]].concat());
    assert_eq!(last.code, 0, "{}", last.stderr);
    let [settled, written] = times_us(&session);
    assert!(settled.len() >= 6 && settled.len() == written.len(), "{settled:?} {written:?}");
    assert!(settled.iter().zip(&written).all(|(settled, written)| settled.abs_diff(*written) <= 1), "{settled:?} {written:?}");
    let mut names: Vec<_> = std::fs::read_dir(&session).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort_unstable();
    assert_eq!(names, [".host-cal-mine", "poses.csv", "session.lock", "session.toml", "stream.bbl"]);
    let check = host_cal_in(folder, &["log", "check", "s", "--json"]);
    assert_eq!((check.code, &check.json()["poses_missing"]), (0, &serde_json::json!([])), "{}", check.transcript());
}

#[test]
fn a_second_recording_into_a_session_is_refused_and_the_first_one_loses_nothing() {
    let folder = TempDir::new().unwrap();
    let (folder, session) = (folder.path(), folder.path().join("s"));
    let (_board, other) = (board(folder, 60), TempDir::new().unwrap());
    let _other_board = board(other.path(), 60);
    let recording = start(folder, &[&["stream", "port", "--session", "s", "--poses", "4", "--json"], &PAIRING[..]].concat());
    wait_for("the first pose", || lines_of(&session.join("poses.csv")) >= 2);
    let port = other.path().join("port").display().to_string();
    // By another way to the same directory.
    let second = host_cal_in(folder, &[&["stream", &port, "--session", "s/../s"], &PAIRING[..]].concat());
    assert_eq!(second.code, 2, "{}", second.stderr);
    let said = second.stderr.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ");
    let holder =
        format!("host-cal stream port --session s --poses 4 --json --pairing A:1 --bar 460 (process {}, since ", recording.id());
    assert!(said.contains("another program records into this session") && said.contains(&holder), "{said}");
    let rank = host_cal_in(folder, &["rank", "s", "--robot", "puma560", "--rig", "triangles", "--json"]);
    assert!(rank.json()["rank"].as_u64() >= Some(1), "readers read on: {}", rank.stderr);
    let check = host_cal_in(folder, &["log", "check", "s", "--json"]);
    assert_eq!((check.code, &check.json()["runs"]), (0, &1.into()), "{}", check.transcript());
    let run = finish(recording);
    assert_eq!((run.code, run.json()["poses_written"].as_u64()), (0, Some(4)), "{}", run.stderr);
    assert_eq!(lines_of(&session.join("poses.csv")), 5);
    // The lock ends with the program, and its file stays.
    assert_eq!(host_cal_in(folder, &[&["stream", &port, "--session", "s", "--for", "100ms"], &PAIRING[..]].concat()).code, 0);
}

#[test]
fn what_somebody_does_to_poses_csv_while_it_grows_ends_the_recording_and_nothing_is_lost() {
    type Edit = fn(&str) -> Option<String>;
    let without_line = |text: &str, line: usize| -> String {
        text.split_inclusive('\n').enumerate().filter(|(i, _)| *i != line).map(|(_, line)| line).collect()
    };
    let edits: [(&str, Edit); 4] = [
        ("a row deleted", |text| {
            Some(text.split_inclusive('\n').enumerate().filter(|(i, _)| *i != 1).map(|(_, line)| line).collect())
        }),
        ("a length corrected", |text| Some(text.replacen(",460,", ",610,", 1))),
        ("a remark", |text| Some(format!("{text}# by Ann\n"))),
        ("removed", |_| None),
    ];
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let _board = board(folder, 60);
    for (number, (what, edit)) in edits.into_iter().enumerate() {
        let name = format!("s{number}");
        let poses = folder.join(&name).join("poses.csv");
        let args = [&["stream", "port", "--session", &name, "--json"], &PAIRING[..]].concat();
        let recording = start(folder, &args);
        wait_for("two poses", || lines_of(&poses) >= 3);
        let before = std::fs::read_to_string(&poses).unwrap();
        let edited = edit(&before);
        match &edited {
            Some(text) => std::fs::write(&poses, text).unwrap(),
            None => std::fs::remove_file(&poses).unwrap(),
        }
        let run = finish(recording);
        assert!(run.code == 3 && run.stderr.contains("poses.csv: another program has"), "{what}: {} {}", run.code, run.stderr);
        assert_eq!(std::fs::read_to_string(&poses).ok(), edited, "{what}: the edit stands");
        assert!(run.json()["poses_written"].as_u64() >= Some(2), "{what}: and it is said what was recorded");

        let again = host_cal_in(folder, &[&args[..], &["--for", "50ms"]].concat());
        assert_eq!(again.code, 0, "{what}: {}", again.stderr);
        let after = std::fs::read_to_string(&poses).unwrap();
        let [settled, written] = times_us(&folder.join(&name));
        let out = if what == "a row deleted" { 1 } else { 0 };
        assert_eq!(written.len(), settled.len() - out, "{what}: the poses measured since are in it: {after}");
        if let Some(text) = &edited {
            assert!(after.starts_with(text.as_str()), "{what}: {after}");
        }
        if what == "a row deleted" {
            assert_eq!(without_line(&before, 1), edited.unwrap());
            assert!(!after.contains(before.lines().nth(1).unwrap()), "what was deleted stays deleted");
        }
    }
}

#[test]
fn a_log_that_is_taken_away_ends_the_recording() {
    let folder = TempDir::new().unwrap();
    let (folder, log) = (folder.path(), folder.path().join("s/stream.bbl"));
    let _board = board(folder, 60);
    let recording = start(folder, &[&["stream", "port", "--session", "s", "--for", "60s", "--json"], &PAIRING[..]].concat());
    wait_for("a log", || std::fs::metadata(&log).is_ok_and(|log| log.len() > 20_000));
    std::fs::remove_file(&log).unwrap();
    let run = finish(recording);
    assert!(run.code == 3 && run.stderr.contains("stream.bbl: another program has removed it"), "{} {}", run.code, run.stderr);
    assert!(run.json()["duration_s"].as_f64().unwrap() < 30.0, "within about a second");
}

#[test]
fn damaged_poses_are_not_added_to() {
    let folder = TempDir::new().unwrap();
    let (folder, poses) = (folder.path(), folder.path().join("s/poses.csv"));
    let _board = board(folder, 60);
    let args = [&["stream", "port", "--session", "s", "--poses", "2"], &PAIRING[..]].concat();
    assert_eq!(host_cal_in(folder, &args).code, 0);
    let good = std::fs::read(&poses).unwrap();
    let header = good.split_inclusive(|&byte| byte == b'\n').next().unwrap();
    let damages: [(&str, Vec<u8>, &str); 5] = [
        ("a row cut off", good[..good.len() - 30].to_vec(), "poses.csv:3: "),
        ("a row without its end", good[..good.len() - 1].to_vec(), "poses.csv:3: the file ends within this line"),
        ("bytes that are no text", [&good[..], &[0xFF, 0, 7]].concat(), "line 4 is no UTF-8 text"),
        ("a second header", [&good[..], header].concat(), "poses.csv:4: the header stands here again"),
        (
            "a number that is none",
            String::from_utf8(good.clone()).unwrap().replacen(",460,", ",4b0,", 1).into(),
            "column `bar_mm`: `4b0`",
        ),
    ];
    let log = std::fs::read(folder.join("s/stream.bbl")).unwrap();
    for (what, damaged, message) in damages {
        std::fs::write(&poses, &damaged).unwrap();
        let run = host_cal_in(folder, &args);
        let said = run.stderr.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ");
        assert!(run.code == 2 && said.contains(message) && said.contains("help: Nothing was"), "{what}: {} {said}", run.code);
        assert!(
            std::fs::read(&poses).unwrap() == damaged && std::fs::read(folder.join("s/stream.bbl")).unwrap() == log,
            "{what}"
        );
    }
}
