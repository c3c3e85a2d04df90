//! What the shell gets of the command: completions that bash completes with, manual pages that groff formats.

use std::fs;
use std::path::Path;
use std::process::Command;

use ballbar_tests::command::host_cal_in;
use ballbar_tests::readers::{is_skipped, output};
use tempfile::TempDir;

/// A folder with the script for bash, and something to complete.
fn with_completions() -> TempDir {
    let folder = TempDir::new().expect("a temporary folder");
    let run = host_cal_in(folder.path(), &["completions", "bash"]);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    fs::write(folder.path().join("script"), run.stdout).expect("a file");
    folder
}

/// What bash offers for the last of these words, sorted.
fn offers(folder: &Path, words: &[&str]) -> Vec<String> {
    let (last, before) = (words.len() - 1, words.len() - 2);
    let quoted: Vec<String> = words.iter().map(|word| format!("'{word}'")).collect();
    let script = format!(
        "source ./script; COMP_WORDS=({}); COMP_CWORD={last}; _host__cal host-cal '{}' '{}'; printf '%s\\n' \"${{COMPREPLY[@]}}\"",
        quoted.join(" "),
        words[last],
        words[before]
    );
    let text = output(Command::new("bash").args(["--norc", "-c", &script]).current_dir(folder));
    let mut offers: Vec<String> = text.lines().filter(|line| !line.is_empty()).map(str::to_owned).collect();
    offers.sort();
    offers
}

#[test]
fn bash_completes_commands_flags_formats_and_names() {
    let folder = with_completions();
    let folder = folder.path();
    let registered =
        output(Command::new("bash").args(["--norc", "-c", "source ./script; complete -p host-cal"]).current_dir(folder));
    assert!(registered.contains("-F _host__cal host-cal") && registered.contains("-o default"), "files too: {registered}");

    assert_eq!(offers(folder, &["host-cal", "va"]), ["validate"]);
    assert_eq!(offers(folder, &["host-cal", "log", "ex"]), ["export"]);
    assert_eq!(offers(folder, &["host-cal", "log", "export", "--p"]), ["--parquet"]);
    assert_eq!(offers(folder, &["host-cal", "fit", "--robot", "pum"]), ["puma560", "puma560-optimised"]);
    assert_eq!(offers(folder, &["host-cal", "plan", "--rig", ""]), ["triangles"]);
    let formats = offers(folder, &["host-cal", "export", "--format", ""]);
    assert!(formats.contains(&"urdf".to_owned()) && !formats.contains(&"puma560".to_owned()), "{formats:?}");
    assert!(offers(folder, &["host-cal", "fit", "--robot", "my-own"]).is_empty(), "then bash offers files by itself");
}

#[test]
fn every_shell_gets_a_script_that_knows_every_command() {
    let folder = TempDir::new().expect("a temporary folder");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let run = host_cal_in(folder.path(), &["completions", shell, "--json"]);
        let json = run.json();
        let script = json["script"].as_str().expect("a script");
        assert_eq!((run.code, json["shell"].as_str()), (0, Some(shell)));
        for word in ["validate", "parquet", "virtual-board", "manual"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    let run = host_cal_in(folder.path(), &["completions", "cmd.exe"]);
    assert!(run.code == 2 && run.stderr.contains("powershell"), "{}", run.stderr);
}

/// A page as a terminal shows it.
fn formatted(path: &Path) -> String {
    output(Command::new("groff").args(["-man", "-Tutf8", "-P-cbou", "-rLL=90n"]).arg(path))
}

#[test]
fn manual_pages_of_all_commands_are_formatted_without_a_warning() {
    if is_skipped() {
        return;
    }
    let folder = TempDir::new().expect("a temporary folder");
    let run = host_cal_in(folder.path(), &["manual", "--out", "share/man1", "--json"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let pages: Vec<String> = serde_json::from_value(run.json()["pages"].clone()).expect("names");
    for page in ["host-cal.1", "host-cal-fit.1", "host-cal-log.1", "host-cal-log-export.1", "host-cal-manual.1"] {
        assert!(pages.iter().any(|name| name == page), "{page} of {pages:?}");
    }
    let help = host_cal_in(folder.path(), &["help"]).stdout;
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names = commands.filter_map(|line| line.strip_prefix("  ").filter(|rest| !rest.starts_with(' '))?.split(' ').next());
    let names: Vec<&str> = names.filter(|name| *name != "help").collect();
    assert!(names.contains(&"fit") && names.contains(&"manual"), "the first and the last: {names:?}");
    for command in names {
        assert!(pages.contains(&format!("host-cal-{command}.1")), "{command}");
    }
    for page in &pages {
        let path = folder.path().join("share/man1").join(page);
        let checked = Command::new("groff").args(["-man", "-ww", "-z", "-Tutf8"]).arg(&path).output().expect("groff runs");
        assert!(checked.status.success(), "{page}");
        assert_eq!(String::from_utf8_lossy(&checked.stderr), "", "{page}");
    }

    let fit = formatted(&folder.path().join("share/man1/host-cal-fit.1"));
    for heading in ["NAME", "SYNOPSIS", "DESCRIPTION", "OPTIONS", "EXAMPLES"] {
        assert!(fit.lines().any(|line| line == heading), "{heading} in\n{fit}");
    }
    let examples = fit.lines().skip_while(|line| *line != "EXAMPLES").skip(1).take_while(|line| !line.is_empty());
    let examples: Vec<&str> = examples.map(str::trim).collect();
    assert!(!examples.is_empty() && examples.iter().all(|line| line.starts_with("host-cal fit ")), "{examples:?}");
    let screen = host_cal_in(folder.path(), &["fit", "--help"]).stdout;
    assert!(examples.iter().all(|example| screen.contains(example)), "the lines of the help: {examples:?}");
}

#[test]
fn one_page_is_printed_and_a_wrong_name_refused() {
    let folder = TempDir::new().expect("a temporary folder");
    let page = host_cal_in(folder.path(), &["manual", "log", "export"]);
    assert!(page.code == 0 && page.stdout.contains(".TH host-cal-log-export 1"), "{}", page.transcript());
    let wrong = host_cal_in(folder.path(), &["manual", "log", "exprt"]);
    assert!(wrong.code == 2 && wrong.stderr.contains("there is no command `log exprt`"), "{}", wrong.stderr);
    fs::write(folder.path().join("file"), "").expect("a file");
    let refused = host_cal_in(folder.path(), &["manual", "--out", "file/man1"]);
    assert!(refused.code == 3 && refused.stderr.contains("file/man1: cannot be made"), "{}", refused.stderr);
}
