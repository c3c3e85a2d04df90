//! Files as spreadsheets, editors and other programs write them: read, or refused with their line and what to do; and files without end.

use std::fs;
use std::time::{Duration, Instant};

use ballbar_calib::model::{Dataset, Rig, Robot};
use ballbar_tests::command::host_cal_in;
use ballbar_tests::data::real_data;
use ballbar_tests::shells::{DESIGN, runs, simulate};
use ballbar_tests::workbench::{RIG, ROBOT, Workbench};
use host_cal::files::{Source, UrdfEnds, append_poses, parse_rig, parse_robot, parse_urdf, read_plan, read_targets};
use serde_json::Value;
use tempfile::TempDir;

fn utf16(text: &str, is_big: bool) -> Vec<u8> {
    let units = std::iter::once(0xfeff).chain(text.encode_utf16());
    units.flat_map(|unit| if is_big { unit.to_be_bytes() } else { unit.to_le_bytes() }).collect()
}

/// What a spreadsheet of a country with decimal commas writes.
fn with_decimal_commas(text: &str) -> String {
    text.replace(',', ";").replace('.', ",")
}

/// Writes a file in every form and expects `run` to say the same of each.
fn read_alike(file: &str, text: &str, run: impl Fn(&TempDir) -> Value, folder: &TempDir) {
    let put = |bytes: &[u8]| fs::write(folder.path().join(file), bytes).expect("a file");
    put(text.as_bytes());
    let expected = run(folder);
    let (header, rows) = text.split_once('\n').expect("a header");
    let commas = ",".repeat(header.matches(',').count());
    let padded: String = text.lines().map(|line| format!("{line},,,\n")).collect();
    let forms: [(&str, Vec<u8>); 10] = [
        ("rows of commas", format!("{header}\n{commas}\n{rows}{commas}\r\n,,,\n").into_bytes()),
        ("empty columns at the end", padded.into_bytes()),
        ("empty columns at the end of some rows", text.replacen('\n', ",,\n", 3).into_bytes()),
        ("a byte order mark and line ends of Windows", format!("\u{feff}{}", text.replace('\n', "\r\n")).into_bytes()),
        ("UTF-16", utf16(text, false)),
        ("UTF-16, the high byte first", utf16(text, true)),
        ("semicolons", text.replace(',', ";").into_bytes()),
        ("semicolons and decimal commas", format!("\u{feff}# Prüfstand\n{}", with_decimal_commas(text)).into_bytes()),
        ("tabs in UTF-16 and decimal commas", utf16(&with_decimal_commas(text).replace(';', "\t"), false)),
        ("semicolons and empty rows", format!("{};\n;;;\n{}", header.replace(',', ";"), rows.replace(',', ";")).into_bytes()),
    ];
    for (what, bytes) in forms {
        put(&bytes);
        assert_eq!(run(folder), expected, "{file} with {what}");
    }
}

#[test]
fn tables_of_spreadsheets_are_read_like_plain_ones() {
    let folder = TempDir::new().expect("a temporary folder");
    simulate(&folder, "made.csv", &["--bar", "460", "--per-pair", "3"]);
    let poses = fs::read_to_string(folder.path().join("made.csv")).expect("poses");
    let validate = |folder: &TempDir| {
        let mut document = runs(folder, &[&["validate", "poses.csv", "--json"], &DESIGN]).json();
        // The lines are others.
        document.as_object_mut().expect("an object").remove("largest");
        document
    };
    read_alike("poses.csv", &poses, validate, &folder);

    let targets = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10.5,-80,70,5,20,0\n12.25,-80,70,5,20,0\n";
    let compensate = |folder: &TempDir| {
        let robots = ["--robot", "puma560-optimised", "--nominal", "puma560"];
        let document = host_cal_in(folder.path(), &[&["compensate", "targets.csv", "--json"][..], &robots].concat()).json();
        let q = |line: &Value| line["q"].clone();
        document["commands"].as_array().expect("commands").iter().map(q).collect()
    };
    read_alike("targets.csv", targets, compensate, &folder);

    let plan = [
        &["plan", "--bar", "460", "--pairings", "A:1", "--per-pair", "3", "--latitudes-deg", "45", "--out", "p.csv"][..],
        &DESIGN,
    ];
    host_cal_in(folder.path(), &plan.concat());
    let planned = fs::read_to_string(folder.path().join("p.csv")).expect("a plan");
    let check =
        |folder: &TempDir| host_cal_in(folder.path(), &[&["plan", "--check", "plan.csv", "--json"][..], &DESIGN].concat()).json();
    read_alike("plan.csv", &planned, check, &folder);
}

#[test]
fn what_cannot_be_read_is_refused_with_its_line_and_what_to_do() {
    let header = "chuck,sphere,q1_deg,q2_mm,length_mm\n";
    let cases: [(&str, &str, Vec<u8>, &str); 9] = [
        ("poses.csv", "poses.csv:1: this is no UTF-8 text", b"# Pr\xfcfstand\nchuck,sphere\n".to_vec(), "CSV UTF-8"),
        ("poses.csv", "poses.csv:3: this is no UTF-8 text", [header.as_bytes(), b"\n\xc4,1,2,3,4\n"].concat(), "CSV UTF-8"),
        ("poses.csv", "poses.csv:1: a zero byte", utf16(header, false)[2..].to_vec(), "byte order mark"),
        ("poses.csv", "poses.csv:1: this is no UTF-16LE text", b"\xff\xfe\x00\xd8a\0".to_vec(), "UTF-8"),
        (
            "poses.csv",
            "`1,234.5` is not a number",
            format!("{header}A,1,2,3,1,234.5\n").replace(',', ";").replace("1;234.5", "1,234.5").into(),
            "point",
        ),
        ("poses.csv", "poses.csv:2: 6 fields, expected 5", format!("{header}A,1,2,3,460,25\n").into(), "decimal comma"),
        ("robot.toml", "robot.toml:1: this is no UTF-8 text", [b"# \xe4\n", ROBOT.as_bytes()].concat(), "UTF-8"),
        (
            "rig.toml",
            "rig.toml:2: this is no UTF-8 text",
            RIG.replace("\"A\"", "\"?\"").bytes().map(|b| if b == b'?' { 0xfc } else { b }).collect(),
            "UTF-8",
        ),
        ("rig.toml", "rig.toml:1: a zero byte", b"\0\0\0\0".to_vec(), "UTF-8"),
    ];
    for (file, says, bytes, remedy) in cases {
        let bench = Workbench::new();
        bench.put(file, bytes);
        let said =
            bench.fails(2, &["validate", "--robot", "robot.toml", "--rig", "rig.toml", "poses.csv"]).replace("\n  │ ", " ");
        assert!(said.contains(says) && said.contains(remedy), "{says}: {said}");
    }
    // What an editor of Windows calls Unicode.
    let bench = Workbench::new();
    bench.put("robot.toml", utf16(ROBOT, false));
    bench.put("rig.toml", utf16(RIG, true));
    let run = bench.run(&["validate", "--robot", "robot.toml", "--rig", "rig.toml", "poses.csv"]);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
}

/// Two joints and a tool: with the parts in question put in.
fn urdf(origin: &str, limit: &str, more: &str) -> String {
    format!(
        "<robot name='two'>\n<link name='base'/><link name='a'/><link name='b'/><link name='tool'/>\n<joint name='j1' type='revolute'>\n\
         <parent link='base'/><child link='a'/><origin xyz='0 0 0.4'/><axis xyz='0 0 1'/>\n{limit}\n{more}\n</joint>\n<joint name='j2' \
         type='revolute'><parent link='a'/><child link='b'/>{origin}<axis xyz='0 1 0'/><limit lower='-2' upper='2'/></joint>\n<joint \
         name='t' type='fixed'><parent link='b'/><child link='tool'/><origin xyz='0.2 0 0.1'/></joint></robot>"
    )
}

const ORIGIN: &str = "<origin xyz='0.3 0 0' rpy='-1.5707963267948966 0 0'/>";
const LIMIT: &str = "<limit lower='-2' upper='2'/>";

#[test]
fn a_quaternion_is_the_turn_that_it_is() {
    let read = |origin: &str| parse_urdf(&Source::new("two.urdf", &urdf(origin, LIMIT, "")), UrdfEnds::default());
    let chain = |origin: &str| read(origin).unwrap_or_else(|error| panic!("{origin}: {error}")).robot.chain;
    let expected = chain(ORIGIN);
    let h = std::f64::consts::FRAC_1_SQRT_2;
    for (scale, sign) in [(1.0, 1.0), (1.0, -1.0), (2.5, 1.0)] {
        let quaternion = format!("<origin xyz='0.3 0 0' quat_xyzw='{} 0 0 {}'/>", -h * scale * sign, h * scale * sign);
        for (a, b) in chain(&quaternion).parameters().iter().zip(expected.parameters()) {
            assert!((a - b).abs() < 1e-12, "{quaternion}: {a} is not {b}");
        }
    }
    for (origin, says) in [
        ("<origin rpy='0 0 0' quat_xyzw='0 0 0 1'/>", "both rpy and quat_xyzw"),
        ("<origin quat_xyzw='0 0 0 0'/>", "of no length"),
        ("<origin quat_xyzw='0 0 1'/>", "four numbers"),
        ("<origin quat_xyzw='0 0 0 nan'/>", "four numbers"),
        ("<origin quat_xyzw='0 0 0 1 0'/>", "four numbers"),
    ] {
        let error = read(origin).expect_err(origin).to_string();
        assert!(error.contains("two.urdf:8") && error.contains(says), "{origin}: {error}");
    }
}

#[test]
fn what_a_robot_file_has_no_place_for_and_what_looks_like_degrees_is_said_with_its_line() {
    let remarks = |limit: &str, more: &str| {
        let imported = parse_urdf(&Source::new("two.urdf", &urdf(ORIGIN, limit, more)), UrdfEnds::default());
        imported.unwrap_or_else(|error| panic!("{limit} {more}: {error}")).remarks
    };
    assert_eq!(remarks(LIMIT, ""), [""; 0]);
    assert_eq!(remarks("<limit lower='-6.2831853071796' upper='6.2831853071796'/>", ""), [""; 0]);
    for (limit, more, says) in [
        (LIMIT, "<calibration rising='0.05'/>", "two.urdf:6: joint `j1`: <calibration> is not read"),
        (
            "<limit lower='-170' upper='170'/>",
            "",
            "two.urdf:5: joint `j1`: <limit> is -170 to 170 radians, -9740 to 9740 degrees",
        ),
        ("<limit lower='0' upper='0' effort='1'/>", "", "two.urdf:5: joint `j1`: a <limit> from 0 to 0 is none"),
        ("<limit effort='1' velocity='1'/>", "", "two.urdf:5: joint `j1`: a <limit> from 0 to 0 is none"),
    ] {
        let remarks = remarks(limit, more);
        assert!(remarks.len() == 1 && remarks[0].starts_with(says), "{limit} {more}: {remarks:?}");
    }
}

#[test]
fn a_urdf_is_read_in_the_encoding_that_it_says() {
    let folder = TempDir::new().expect("a temporary folder");
    let import = |bytes: &[u8]| {
        fs::write(folder.path().join("a.urdf"), bytes).expect("a file");
        host_cal_in(folder.path(), &["import", "a.urdf", "--json"])
    };
    let text = |encoding: &str| {
        format!("<?xml version='1.0' encoding={encoding}?>\n{}", urdf(ORIGIN, LIMIT, "").replace("two", "Prüfling"))
    };
    let latin1 = |encoding: &str| text(encoding).chars().map(|c| c as u8).collect::<Vec<u8>>();
    for (what, bytes) in [
        ("UTF-8", text("'UTF-8'").into_bytes()),
        ("a byte order mark", format!("\u{feff}{}", text("\"utf-8\"")).into_bytes()),
        ("ISO-8859-1", latin1("\"ISO-8859-1\"")),
        ("Windows-1252", latin1("'windows-1252'")),
        ("UTF-16", utf16(&text("'UTF-16'"), false)),
        ("UTF-16, the high byte first", utf16(&text("\"UTF-16\""), true)),
        ("UTF-16 that was converted", text("'UTF-16'").into_bytes()),
    ] {
        let run = import(&bytes);
        assert!(run.code == 0 && run.json()["robot"] == "Prüfling", "{what}: {}", run.transcript());
    }
    for (bytes, says, remedy) in [
        (latin1("'UTF-8'"), "a.urdf:2: this is no UTF-8 text", "UTF-8"),
        (latin1("'klingon'"), "a.urdf:1: unknown encoding `klingon`", "say encoding=\"UTF-8\""),
        (utf16(&text("'UTF-16'"), false)[2..].to_vec(), "a.urdf:1: a zero byte", "byte order mark"),
    ] {
        let run = import(&bytes);
        let said = run.stderr.replace("\n  │ ", " ");
        assert!(run.code == 2 && said.contains(says) && said.contains(remedy), "{says}: {}", run.transcript());
    }
}

#[test]
fn the_files_that_people_reported_are_read_or_refused_with_advice() {
    let Some(cases) = real_data("cases") else { return };
    let folder = TempDir::new().expect("a temporary folder");
    let path = |name: &str| cases.join(name).canonicalize().expect("a case").display().to_string();
    for (file, code, says) in [
        ("semi.csv", 0, ""),
        ("trail_empty.csv", 0, ""),
        ("utf16.csv", 0, ""),
        ("latin1.csv", 2, "latin1.csv:1: this is no UTF-8 text"),
        ("esc-sphere.csv", 2, "unknown sphere `\\u{1b}]0;pwned\\u{7}\\u{1b}[31m`"),
        ("esc-column.csv", 2, "esc-column.csv:1: "),
    ] {
        let file = path(&format!("csv_odd/{file}"));
        // Of the robot only the number of joints matters here.
        let run = host_cal_in(folder.path(), &["validate", "--robot", "puma560", "--rig", "triangles", &file]);
        let said = run.stderr.replace("\n  │ ", " ").replace('\n', "");
        assert!(run.code == code && said.contains(says) && !said.contains('\u{1b}'), "{file}: {}", run.transcript());
    }
    for (file, says) in [
        ("calib.urdf", "calib.urdf:2: joint `j1`: <calibration> is not read"),
        ("degree_limits.urdf", "degree_limits.urdf:2: joint `j1`: <limit> is -170 to 170 radians"),
        ("limit_zero.urdf", "limit_zero.urdf:2: joint `j1`: a <limit> from 0 to 0 is none"),
        ("iso.urdf", ""),
        ("utf16.urdf", ""),
        ("quat.urdf", ""),
        ("quat11.urdf", ""),
    ] {
        let import = ["import", &path(&format!("urdf_odd/{file}")), "--out", "two.toml"];
        let run = host_cal_in(folder.path(), &import);
        assert!(
            run.code == 0 && run.stderr.contains(says) && run.stderr.is_empty() == says.is_empty(),
            "{file}: {}",
            run.transcript()
        );
        let position =
            host_cal_in(folder.path(), &["fk", "--robot", "two.toml", "--q", "20,30", "--json"]).json()["position_mm"].clone();
        for (axis, expected) in [496.234, 166.357, 400.0].into_iter().enumerate() {
            let found = position[axis].as_f64().expect("a number");
            assert!((found - expected).abs() < 1e-3, "{file}: {position}");
        }
    }
}

fn good() -> (Robot, Rig) {
    let source = |text| Source::new("good", text);
    (parse_robot(&source(ROBOT)).expect("a good robot"), parse_rig(&source(RIG)).expect("a good rig"))
}

#[test]
fn a_rig_has_a_hundred_chucks_spheres_and_lengths_at_most() {
    let points = |kind: &str, count: usize| -> String {
        (0..count).map(|i| format!("[[{kind}]]\nname = \"{kind}{i}\"\nposition_mm = [{i}, 0, 0]\n")).collect()
    };
    let lengths = |count: usize| (0..count).map(|i| format!("{}", i + 400)).collect::<Vec<_>>().join(", ");
    let rig = |chucks: usize, spheres: usize, bars: usize| {
        let bar = format!("[bar]\nlengths_mm = [{}]\ntravel_mm = 75\n", lengths(bars));
        parse_rig(&Source::new("rig.toml", &(points("chucks", chucks) + &points("spheres", spheres) + &bar)))
    };
    assert_eq!(rig(100, 100, 100).expect("at the bound").all_pairings().len(), 10_000);
    for (counts, says) in [((101, 1, 1), "101 chucks"), ((1, 101, 1), "101 spheres"), ((1, 1, 101), "101 bar lengths")] {
        let error = rig(counts.0, counts.1, counts.2).expect_err("beyond the bound").to_string();
        assert_eq!(error, format!("rig.toml: {says}, expected at most 100"));
    }
}

#[test]
fn files_of_rows_beyond_the_bound_are_not_read() {
    const BOUND: u64 = 128 << 20;
    let folder = TempDir::new().expect("a temporary folder");
    // Sparse: it takes no room, and only its length is looked at.
    let path = folder.path().join("long.csv");
    fs::File::create(&path).and_then(|file| file.set_len(BOUND + 1)).expect("a sparse file");
    let commands: [&[&str]; 3] = [
        &["fit", "--robot", "puma560", "--rig", "triangles", "long.csv"],
        &["plan", "--robot", "puma560", "--rig", "triangles", "--check", "long.csv"],
        &["compensate", "--robot", "puma560", "--nominal", "puma560", "long.csv"],
    ];
    // The command is built, if need be, before the time is taken.
    host_cal_in(folder.path(), &["--version"]);
    for command in commands {
        let began = Instant::now();
        let run = host_cal_in(folder.path(), command);
        assert!(run.code == 2 && run.stderr.contains("long.csv: longer than 134217728 bytes"), "{}", run.transcript());
        assert!(began.elapsed() < Duration::from_secs(10), "{command:?} took {:?}", began.elapsed());
    }
    #[cfg(unix)]
    for endless in [&["fit", "--robot", "puma560", "--rig", "triangles", "/dev/zero"][..], &["import", "/dev/zero"]] {
        let run = host_cal_in(folder.path(), endless);
        assert!(run.code == 2 && run.stderr.contains("/dev/zero: longer than"), "{}", run.transcript());
    }
    fs::File::create(&path).and_then(|file| file.set_len(1 << 20)).expect("a sparse file");
    let run = host_cal_in(folder.path(), commands[0]);
    assert!(run.code == 2 && run.stderr.contains("long.csv:1: a zero byte"), "{}", run.transcript());
}

#[test]
fn the_time_to_refuse_a_header_grows_with_its_length_and_not_with_its_square() {
    let (robot, rig) = good();
    let header = |columns: usize| {
        let names = (0..columns).map(|i| format!("c{i}")).collect::<Vec<_>>().join(",");
        Source::new("wide.csv", &format!("chuck,sphere,q1_deg,q2_mm,length_mm,{names}\n"))
    };
    let took = |columns: usize| {
        let source = header(columns);
        let began = Instant::now();
        assert!(append_poses(&mut Dataset::default(), &source, &robot, &rig).is_err());
        assert!(read_plan(&source, &robot, &rig).is_err() && read_targets(&source, &robot).is_err());
        began.elapsed()
    };
    // Every column compared with all before it takes minutes, even on a machine that does nothing else.
    let long = took(300_000);
    assert!(long < Duration::from_secs(30), "300,000 columns take {long:?}");
    let twice = Source::new("wide.csv", &header(200_000).text().replacen("c0", "c199999", 1));
    let error = append_poses(&mut Dataset::default(), &twice, &robot, &rig).expect_err("a column twice").to_string();
    assert_eq!(error, "wide.csv:1: column `c199999` stands there twice");
}

#[test]
fn a_long_file_of_keys_is_refused_soon() {
    let many = |line: &dyn Fn(usize) -> String| (0..40_000).map(line).collect::<String>();
    let texts = [
        many(&|i| format!("key{i} = 1\n")),
        many(&|i| format!("[t{i}]\n")),
        many(&|_| "[[links]]\n".to_owned()),
        format!("a = {}", "[".repeat(500_000)),
        format!("{} = 1", "a.".repeat(300_000)),
    ];
    for text in texts {
        let began = Instant::now();
        let source = Source::new("long.toml", &text);
        assert!(parse_robot(&source).is_err() && parse_rig(&source).is_err());
        assert!(began.elapsed() < Duration::from_secs(10), "{:.40}… took {:?}", text, began.elapsed());
    }
}
