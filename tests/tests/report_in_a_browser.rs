//! The page of `host-cal report` in a real browser: light and dark, at three widths, turned and printed.

mod shells;

use std::fs;
use std::path::{Path, PathBuf};

use ballbar_tests::command::host_cal_in;
use ballbar_tests::readers::{is_skipped, python};
use host_cal::files::{RIGS, ROBOTS};
use serde_json::Value;
use shells::{DESIGN, puma, runs};
use tempfile::TempDir;

/// All that the browser was told to look for, found in one page that has each of it.
const BROKEN: &str = r##"
<style>#time{width:3000px}@media screen and (prefers-color-scheme:dark){body{background:#fff!important}}
#parameters p{width:200px;overflow:hidden;white-space:nowrap}</style>
<img src="http://127.0.0.1:9/picture.png" alt="">
<script>console.error("an error of the console")</script>
<script>
const all = (path) => [...document.querySelectorAll(path)];
document.querySelector("#held-out text").setAttribute("x", "-300");
all("#shell svg *").forEach((mark) => mark.remove());
document.querySelector("#histogram svg").remove();
document.querySelector("#convergence figcaption").textContent = "";
const [second, first] = all("#singular-values text").slice(-2);
["x", "y", "transform", "text-anchor"].forEach((name) => {
  const value = second.getAttribute(name);
  value === null ? first.removeAttribute(name) : first.setAttribute(name, value);
});
all("#pairings text").forEach((text) => text.setAttribute("font-size", "12"));
const canvas = document.querySelector("#scene canvas");
canvas.replaceWith(canvas.cloneNode());
throw new Error("an exception");
</script></body>"##;

/// Each has to be told of it.
const FLAWS: [&str; 15] = [
    "console: an error of the console",
    "exception: Error: an exception",
    "request: http://127.0.0.1:9/picture.png",
    "page scrolls sideways",
    "cut: p in section#parameters",
    "held-out: “% of lengths below” is cut",
    "shell: nothing is drawn",
    "histogram: 0 drawings are shown",
    "convergence: no sentence",
    "singular-values: “50” is on “40”",
    "pairings: “A:1” is",
    "scene: 0 pixels are drawn",
    "the scene does not turn: drag",
    "1000 dark: the page is light",
    "has a contrast of",
];

fn write(folder: &TempDir, name: &str, text: &str) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, text).expect("a file in the temporary folder");
    path
}

/// A PUMA with names that want to be code, and few poses of one chuck in two files with times that start anew.
fn hard(folder: &TempDir) -> PathBuf {
    const HOSTILE: &str = "</script><script>alert(1)</script>&'";
    let text_of = |list: &[(&str, &str)], name: &str| list.iter().find(|entry| entry.0 == name).expect("built in").1.to_owned();
    let robot = text_of(&ROBOTS, "puma560");
    let robot: Vec<&str> = robot.lines().filter(|line| !line.starts_with("name")).collect();
    write(folder, "robot.toml", &format!("name = \"{}\"\n{}\n", HOSTILE.repeat(4), robot.join("\n")));
    write(folder, "rig.toml", &text_of(&RIGS, "triangles").replace("name = \"A\"", &format!("name = \"{HOSTILE}\"")));
    let poses = fs::read_to_string(folder.path().join("poses.csv")).expect("poses");
    let mut lines = poses.lines();
    let header = format!("{},t_s", lines.next().expect("a header"));
    let rows: Vec<String> =
        lines.filter(|line| line.starts_with("A,")).take(40).map(|line| line.replacen('A', HOSTILE, 1)).collect();
    let file = |rows: &[String]| {
        let rows = rows.iter().enumerate().map(|(i, row)| format!("{row},{}\n", 60 * i));
        format!("{header}\n{}", rows.collect::<String>())
    };
    write(folder, "<i>.csv", &file(&rows[..20]));
    write(folder, "second \"quoted\".csv", &file(&rows[20..]));
    let arguments =
        ["report", "--robot", "robot.toml", "--rig", "rig.toml", "<i>.csv", "second \"quoted\".csv", "--out", "hard.html"];
    let run = host_cal_in(folder.path(), &arguments);
    assert!(run.code < 2, "{}", run.transcript());
    folder.path().join("hard.html")
}

fn findings(looks: &Value, page: &Path) -> Vec<String> {
    let findings = looks[page.to_str().expect("a name")]["findings"].as_array().expect("findings");
    findings.iter().map(|finding| finding.as_str().expect("words").to_owned()).collect()
}

#[test]
fn a_browser_finds_nothing_wrong_with_the_page_and_every_flaw_of_a_broken_one() {
    if is_skipped() {
        return;
    }
    let folder = puma();
    runs(&folder, &[&["report", "poses.csv", "--validate", "other.csv", "--out", "good.html"], &DESIGN]);
    let good = folder.path().join("good.html");
    let hard = hard(&folder);
    let text = fs::read_to_string(&good).expect("a page");
    let broken = write(&folder, "broken.html", &text.replace("</body>", BROKEN));

    let looks = python("look_at_pages.py", &[&good, &hard, &broken]);
    let looks: Value = serde_json::from_str(&looks).expect("JSON");
    for page in [&good, &hard] {
        assert_eq!(findings(&looks, page), Vec::<String>::new(), "{}", page.display());
        let look = &looks[page.to_str().expect("a name")];
        assert_eq!(look["figures"].as_array().map(Vec::len), Some(11));
        assert!((3..20).contains(&look["print_pages"].as_u64().unwrap_or_default()), "{look}");
    }
    let found = findings(&looks, &broken);
    for flaw in FLAWS {
        assert!(found.iter().any(|finding| finding.contains(flaw)), "`{flaw}` was not found out:\n{}", found.join("\n"));
    }
}
