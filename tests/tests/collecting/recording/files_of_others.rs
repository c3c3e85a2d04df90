//! Sessions that are none, that somebody else is at, or that were edited or damaged: what is refused, and what is kept.

use ballbar_tests::command::host_cal_in;
use tempfile::TempDir;

use super::{PAIRING, board, finish, lines_of, start, times_us, wait_for};

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
