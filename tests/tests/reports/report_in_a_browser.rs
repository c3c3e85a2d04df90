//! The page of `host-cal report` in a real browser: light and dark, at three widths, turned and printed.

use std::fs;
use std::path::{Path, PathBuf};

use ballbar_tests::command::host_cal_in;
use ballbar_tests::readers::{is_skipped, python};
use ballbar_tests::shells::{DESIGN, puma, runs};
use host_cal::files::{RIGS, ROBOTS};
use serde_json::Value;
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

/// Each has to be told of, besides those of [`flaws_of_words`].
const FLAWS: [&str; 12] = [
    "console: an error of the console",
    "exception: Error: an exception",
    "request: http://127.0.0.1:9/picture.png",
    "page scrolls sideways",
    "cut: p in section#parameters",
    "shell: nothing is drawn",
    "histogram: 0 drawings are shown",
    "convergence: no sentence",
    "scene: 0 pixels are drawn",
    "the scene does not turn: drag",
    "1000 dark: the page is light",
    "has a contrast of",
];

/// What is to be told of the words that the broken page moved or shrank; which they are, the page says.
fn flaws_of_words(page: &str) -> [String; 3] {
    let texts = |figure: &str| -> Vec<String> {
        let (_, after) = page.split_once(&format!("<figure id=\"{figure}\"")).expect(figure);
        let (inside, _) = after.split_once("</figure>").expect(figure);
        let text = |element: &str| {
            element.split_once('>').and_then(|(_, rest)| rest.split_once("</text>")).expect(figure).0.trim().to_owned()
        };
        inside.split("<text").skip(1).map(text).collect()
    };
    let (cut, on, small) = (texts("held-out"), texts("singular-values"), texts("pairings"));
    let [.., below, above] = on.as_slice() else { panic!("{on:?}") };
    [
        format!("held-out: “{}” is cut", cut[0]),
        format!("singular-values: “{above}” is on “{below}”"),
        format!("pairings: “{}” is", small.last().expect("names")),
    ]
}

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
    for flaw in FLAWS.map(str::to_owned).iter().chain(&flaws_of_words(&text)) {
        assert!(found.iter().any(|finding| finding.contains(flaw)), "`{flaw}` was not found out:\n{}", found.join("\n"));
    }
}

#[test]
fn a_browser_that_says_nothing_is_given_up_and_ended() {
    if is_skipped() {
        return;
    }
    let told = python("stuck_browser.py", &[]);
    assert_eq!(told, "the browser did not answer within 2 s: Target.getTargets\n2 started, 0 running\n");
}
