//! The files that an export writes: refused, interrupted, without room, or in the place of older ones.

use std::fs;

use ballbar_tests::command::host_cal_command;

use super::{COUNTS, Log, sample, set_of};

#[test]
fn an_export_that_is_refused_changes_nothing() {
    let mut log = Log::new();
    log.hello(0).parameters(&set_of("puma560"));
    for index in 0..2_000 {
        log.sample(&sample(index, &COUNTS, 30_000));
    }
    let names = || {
        let entries = fs::read_dir(log.path()).expect("the folder");
        let mut names: Vec<String> = entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into()).collect();
        names.sort();
        names
    };
    let before = fs::read(log.path().join("s/stream.bbl")).expect("the log");
    for (code, args, message) in [
        (3, ["--csv", "a.csv", "--mcap", "absent/a.mcap"], "absent/a.mcap: cannot be written"),
        (3, ["--parquet", "s", "--csv", "a.csv"], "s: cannot be written: it is there, but is no regular file"),
        (2, ["--csv", "a", "--parquet", "a"], "a: is named twice, for two outputs"),
        (2, ["--csv", "./new", "--parquet", "s/../new"], "s/../new: is named twice, for two outputs"),
        (2, ["--csv", "s/stream.bbl", "--mcap", "a"], "s/stream.bbl: is a file of a session, which no output replaces"),
        (2, ["--csv", "s/poses.csv", "--mcap", "a"], "s/poses.csv: is a file of a session, which no output replaces"),
        (3, ["--csv", "a.csv", "--mcap", "new/"], "new/: cannot be written: this is a folder's name, not a file's"),
        (3, ["--csv", "a.csv", "--mcap", &"n".repeat(300)], "File name too long"),
    ] {
        fs::write(log.path().join("a.csv"), "older").expect("an older file");
        let run = log.export(&[&["log", "export", "s", "--force"][..], &args].concat());
        assert!(run.code == code && run.stderr.contains(message), "{args:?}: {}", run.transcript());
        assert_eq!(names(), ["a.csv", "s"], "{args:?}");
        assert_eq!(fs::read_to_string(log.path().join("a.csv")).expect("the older file"), "older", "{args:?}");
    }
    let none = log.export(&["log", "export", "s"]);
    assert!(none.code == 2 && none.stderr.contains("<--csv <FILE>|--parquet <FILE>|--mcap <FILE>>"), "{}", none.stderr);
    assert_eq!(fs::read(log.path().join("s/stream.bbl")).expect("the log"), before);
}

#[test]
fn ctrl_c_ends_an_export_and_leaves_nothing() {
    let mut log = Log::new();
    log.hello(0).parameters(&set_of("puma560"));
    for index in 0..150_000 {
        log.sample(&sample(index, &COUNTS.map(|counts| counts.wrapping_mul(index as i32)), index as u16));
    }
    let args = ["log", "export", "s", "--csv", "a.csv", "--parquet", "a.parquet", "--mcap", "a.mcap"];
    let mut child = host_cal_command(log.path(), &args).stderr(std::process::Stdio::piped()).spawn().expect("host-cal starts");
    let files = || fs::read_dir(log.path()).expect("the folder").count();
    while files() < 4 {
        assert!(child.try_wait().expect("a child").is_none(), "it ended before it began to write");
    }
    let status = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(status.expect("there is a kill").success());
    let run = child.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.code() == Some(130) && said.contains("Nothing was written."), "{}: {said}", run.status);
    assert_eq!(files(), 1, "of temporary files none is left");
}

#[cfg(unix)]
#[test]
fn an_older_files_permissions_and_links_are_kept() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let mut log = Log::new();
    log.hello(0).sample(&sample(1, &COUNTS, 30_000));
    let [csv, link] = ["a.csv", "link.csv"].map(|name| log.path().join(name));
    fs::write(&csv, "older").expect("an older file");
    symlink("a.csv", &link).expect("a link");
    let to_mode = |mode| fs::set_permissions(&csv, PermissionsExt::from_mode(mode)).expect("its permissions");
    let export = || log.export(&["log", "export", "s", "--csv", "link.csv", "--force"]);

    to_mode(0o444);
    let refused = export();
    assert!(refused.code == 3 && refused.stderr.contains("link.csv: cannot be written: it is there, and read-only"));
    to_mode(0o600);
    assert_eq!(export().code, 0);
    assert_eq!(fs::metadata(&csv).expect("the file").permissions().mode() & 0o777, 0o600);
    assert!(link.is_symlink() && fs::read_to_string(&csv).expect("the table").starts_with("segment,"));

    fs::remove_file(&csv).expect("the file");
    let dangling = export();
    assert!(dangling.code == 3 && dangling.stderr.contains("it is a link to what is not there"), "{}", dangling.transcript());
    assert!(link.is_symlink() && !csv.exists());
}

/// As on a disk that is full, by the limit on the size of files.
#[test]
fn a_file_that_cannot_be_finished_leaves_nothing_in_any_format() {
    let mut log = Log::new();
    log.hello(0).parameters(&set_of("puma560"));
    for index in 0..4_000 {
        log.sample(&sample(index, &COUNTS.map(|counts| counts.wrapping_mul(index as i32)), index as u16));
    }
    for format in ["--csv", "--parquet", "--mcap"] {
        let command = host_cal_command(log.path(), &["log", "export", "s", format, "a"]);
        let program = command.get_program().to_string_lossy().into_owned();
        let script = format!("trap '' XFSZ; ulimit -f 8; exec '{program}' log export s {format} a");
        let run = std::process::Command::new("bash").args(["-c", &script]).current_dir(log.path()).output().expect("bash");
        let said = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.code() == Some(3) && said.contains("a: cannot be written: "), "{format}: {} {said}", run.status);
        assert!(said.contains("File too large") && !said.contains("panicked"), "{format}: {said}");
        assert_eq!(fs::read_dir(log.path()).expect("the folder").count(), 1, "{format}");
    }
}
