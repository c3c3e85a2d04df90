//! Names, paths and words from outside reach no terminal and no browser as they are: every door, with names that move a cursor, ring a
//! bell, turn a line round or hide.

use std::fs;
use std::path::Path;

use ballbar_tests::command::{Run, host_cal_in};
use ballbar_tests::shells::{runs, simulate};
use host_cal::files::{RIGS, ROBOTS};
use host_cal::text::is_hidden;
use tempfile::TempDir;

/// Control sequences of a terminal, C1 controls, ends of lines, bidirectional and invisible characters.
const HOSTILE: [&str; 10] = [
    "\u{1b}[31mred",
    "\u{1b}]0;pwned\u{7}",
    "\u{9b}2J",
    "a\rb",
    "a\nb",
    "\u{202e}lmot",
    "\u{2066}x\u{2069}",
    "a\u{2028}b",
    "a\u{200b}b\u{feff}",
    "a\u{e0041}b",
];

/// That nothing of a run's output is obeyed or hidden; what colours the renderer would use are switched off.
fn is_plain(what: &str, run: &Run) {
    for (stream, text) in [("stdout", &run.stdout), ("stderr", &run.stderr)] {
        let hidden = text.chars().find(|&c| c != '\n' && is_hidden(c));
        assert_eq!(hidden, None, "{what}, {stream}: {text:?}");
    }
    assert!(!run.stderr.contains("panicked"), "{what}: {}", run.stderr);
}

fn put(folder: &TempDir, name: &str, text: &str) {
    fs::write(folder.path().join(name), text).expect("a file");
}

#[test]
fn words_in_files_and_arguments_are_shown_harmless() {
    let folder = TempDir::new().expect("a temporary folder");
    simulate(&folder, "poses.csv", &["--bar", "460", "--per-pair", "2"]);
    let poses = fs::read_to_string(folder.path().join("poses.csv")).expect("poses");
    let (robot, rig) = (ROBOTS[0].1, RIGS[0].1);
    for hostile in HOSTILE {
        let quoted = toml_string(hostile);
        let urdf = |joint: &str| {
            format!(
                "<robot name='r'><link name='a'/><link name='b'/><joint name='{joint}' type='revolute'><parent link='a'/><child \
                 link='b'/><limit lower='-170' upper='170'/><calibration rising='0'/></joint></robot>"
            )
        };
        let files = [
            ("column.csv", poses.replacen("length_mm", &format!("\"{hostile}\""), 1)),
            ("known-column.csv", poses.replacen("length_mm", &format!("length_mm,\"{hostile}\""), 1)),
            ("sphere.csv", poses.replacen("\nA,1,", &format!("\nA,\"{hostile}\","), 1)),
            ("number.csv", poses.replacen("\nA,1,", &format!("\nA,1,\"{hostile}\","), 1)),
            ("set.csv", poses.replacen(",460\n", &format!(",\"{hostile}\"\n"), 1)),
            ("name.toml", format!("name = {quoted}\n{robot}")),
            ("raw.toml", format!("name = \"{hostile}\"\n{robot}")),
            ("key.toml", format!("{quoted} = 1\n{robot}")),
            ("value.toml", robot.replacen("\"revolute\"", &quoted, 1)),
            ("chuck.toml", rig.replacen("\"A\"", &quoted, 1)),
            ("rig-key.toml", format!("{quoted} = 1\n{rig}")),
            ("joint.urdf", urdf(hostile)),
            ("escaped.urdf", urdf(&hostile.chars().map(|c| format!("&#x{:x};", u32::from(c))).collect::<String>())),
            ("element.urdf", format!("<{hostile}/>")),
        ];
        for (name, text) in &files {
            put(&folder, name, text);
        }
        let fit = ["fit", "--robot", "puma560", "--rig", "triangles"];
        let doors: [&[&str]; 19] = [
            &["fit", "--robot", "puma560", "--rig", "triangles", "column.csv"],
            &["fit", "--robot", "puma560", "--rig", "triangles", "known-column.csv"],
            &["fit", "--robot", "puma560", "--rig", "triangles", "sphere.csv"],
            &["fit", "--robot", "puma560", "--rig", "triangles", "number.csv"],
            &["rank", "--robot", "puma560", "--rig", "triangles", "set.csv"],
            &["fk", "--robot", "name.toml", "--q", "0,0,0,0,0,0"],
            &["fk", "--robot", "raw.toml", "--q", "0,0,0,0,0,0", "--json"],
            &["fk", "--robot", "key.toml", "--q", "0,0,0,0,0,0"],
            &["fk", "--robot", "value.toml", "--q", "0,0,0,0,0,0"],
            &["rank", "--robot", "puma560", "--rig", "chuck.toml", "poses.csv"],
            &["rank", "--robot", "puma560", "--rig", "rig-key.toml", "poses.csv"],
            &["simulate", "--robot", "puma560", "--rig", "chuck.toml", "--per-pair", "1", "--json"],
            &["import", "joint.urdf", "--out", "imported.toml", "--force"],
            &["import", "escaped.urdf", "--out", "imported.toml", "--force"],
            &["import", "element.urdf"],
            &["fk", "--robot", hostile, "--q", "0"],
            &["fit", hostile],
            &["import", "joint.urdf", "--base", hostile, "--tip", hostile],
            &["rank", "--robot", "puma560", "--rig", "triangles", "poses.csv", "--pairings", hostile],
        ];
        for door in doors {
            is_plain(&format!("{hostile:?} {door:?}"), &host_cal_in(folder.path(), door));
        }
        for arguments in [&[hostile][..], &["fit", "--", hostile], &["plan", "--per-pair", hostile], &[&format!("--{hostile}")]] {
            is_plain(&format!("{arguments:?}"), &host_cal_in(folder.path(), arguments));
        }
        let hold = [&fit[..], &["poses.csv", "--hold", hostile]].concat();
        is_plain(&format!("{hold:?}"), &host_cal_in(folder.path(), &hold));
        let hold_out = [&fit[..], &["poses.csv", "--hold-out", hostile]].concat();
        is_plain(&format!("{hold_out:?}"), &host_cal_in(folder.path(), &hold_out));
    }
}

/// A TOML text with every character that is not plain by its number.
fn toml_string(text: &str) -> String {
    let escaped: String = text
        .chars()
        .map(|c| if c.is_ascii_graphic() && !"\"\\".contains(c) { c.to_string() } else { format!("\\U{:08x}", u32::from(c)) })
        .collect();
    format!("\"{escaped}\"")
}

#[cfg(unix)]
#[test]
fn files_of_hostile_names_are_read_and_written_and_their_names_shown_harmless() {
    let folder = TempDir::new().expect("a temporary folder");
    for (i, hostile) in HOSTILE.iter().filter(|name| !name.contains('/')).enumerate() {
        let (poses, robot, out) = (format!("{hostile}.csv"), format!("{hostile}.toml"), format!("{hostile}-out"));
        simulate(&folder, &poses, &["--bar", "460", "--per-pair", "12", "--sigma-mm", "0.05", "--seed", &i.to_string()]);
        // Without a name it is called as its file.
        put(&folder, &robot, ROBOTS[0].1.split_once('\n').expect("lines").1);
        let with = ["--robot", &robot, "--rig", "triangles"];
        let commands: [&[&str]; 9] = [
            &["fit", &poses, "--out", &out],
            &["fit", &poses, "--json"],
            &["validate", &poses],
            &["rank", &poses],
            &["report", &poses, "--out", &out, "--force"],
            &["report", &poses, "--out", &out, "--json"],
            &["report", &poses, "--out", &poses],
            &["plan", "--check", &poses],
            &["simulate", "--per-pair", "1", "--out", &out, "--force"],
        ];
        for command in commands {
            is_plain(&format!("{command:?}"), &host_cal_in(folder.path(), &[command, &with].concat()));
        }
        for command in [&["log", "check", &out][..], &["log", "export", hostile, "--csv", &out], &["status", hostile]] {
            is_plain(&format!("{command:?}"), &host_cal_in(folder.path(), command));
        }
    }
}

#[test]
fn json_means_the_same_and_pages_and_figures_show_what_is_hidden() {
    let folder = TempDir::new().expect("a temporary folder");
    let name = "\u{202e}lmot \u{2028}\u{200b}";
    put(&folder, "robot.toml", &ROBOTS[0].1.replacen("name = ", &format!("name = \"{name}\" #"), 1));
    let chuck = "A\u{202e}B";
    put(&folder, "rig.toml", &RIGS[0].1.replacen("\"A\"", &format!("\"{chuck}\""), 1));
    let with = ["--robot", "robot.toml", "--rig", "rig.toml"];
    runs(&folder, &[&["simulate", "--bar", "460", "--per-pair", "12", "--sigma-mm", "0.05", "--out", "poses.csv"], &with]);
    let rank = runs(&folder, &[&["rank", "poses.csv", "--json"], &with]);
    is_plain("rank", &rank);
    assert_eq!(rank.json()["robot"], name);
    let report = ["report", "poses.csv", "--out", "r.html", "--svg", "figures", "--csv", "figures"];
    is_plain("report", &host_cal_in(folder.path(), &[&report[..], &with].concat()));
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).expect("a file");
    let page = read("r.html");
    assert!(page.contains("\\u{202e}lmot \\u{2028}\\u{200b}") && page.contains("A\\u{202e}B:1"), "the names are shown");
    let svgs = fs::read_dir(folder.path().join("figures")).expect("figures").map(|entry| entry.expect("an entry").path());
    let texts = svgs.filter(|path| path.extension().is_some_and(|end| end == "svg")).map(|path| read_path(&path));
    for text in texts.chain([page]) {
        assert_eq!(text.chars().find(|&c| !"\n\t".contains(c) && is_hidden(c)), None);
    }
    // Files for programs keep their data.
    assert!(read("figures/pairings.csv").contains("A\u{202e}B:1") && read("poses.csv").contains("A\u{202e}B,1,"));
    let export = runs(&folder, &[&["export", "--robot", "robot.toml", "--format", "json"]]);
    assert_eq!(export.json()["name"], name);
}

fn read_path(path: &Path) -> String {
    fs::read_to_string(path).expect("a file")
}
