//! The commands with a board, against a virtual one: what they do, and what they refuse.

use std::path::Path;

use ballbar::JointVector;
use ballbar_tests::command::{Run, host_cal_in};
use host_cal::board::{BAUD, BoardLink, RobotOnBoard, nominal_lvdt, parameter_set};
use host_cal::files::{open_rig, open_robot};
use host_cal::robot_link::JointSpeed;
use host_cal::virtual_board::{AttachedBar, Pace, Plant, Script, Station, VirtualBoard, VirtualBoardOptions};
use tempfile::TempDir;

mod ports;

/// A board at `port` in the folder, with nothing in flash and nothing homed.
fn bare_board(folder: &Path) -> VirtualBoard {
    let plant = Plant::new(&open_robot("puma560-optimised").unwrap(), 0.075, 7).unwrap();
    let port_name = Some(folder.join("port"));
    VirtualBoard::start(VirtualBoardOptions { port_name, ..VirtualBoardOptions::new(plant, Pace::Real) }).unwrap()
}

fn run(folder: &Path, args: &[&str]) -> Run {
    host_cal_in(folder, args)
}

/// A run that ends well.
fn good(folder: &Path, args: &[&str]) -> Run {
    let run = run(folder, args);
    assert_eq!(run.code, 0, "{args:?}: {}{}", run.stdout, run.stderr);
    run
}

/// A run that is refused, with words of its message.
fn refused(folder: &Path, args: &[&str], words: &[&str]) {
    let run = run(folder, args);
    let message = run.stderr.split_whitespace().collect::<Vec<_>>().join(" ").replace("│ ", "");
    assert!(run.code == 2 && words.iter().all(|word| message.contains(word)), "{args:?}: exit code {}: {message}", run.code);
    assert_eq!(run.stdout, "", "{args:?}");
}

/// The built-in PUMA with a `[calibration]`, as a fit writes it.
fn calibrated(folder: &Path) {
    let simulate = ["simulate", "--robot", "puma560-optimised", "--plan-robot", "puma560", "--rig", "triangles"];
    let simulate = [&simulate[..], &["--bar", "460", "--per-pair", "12", "--sigma-mm", "0.084", "--out", "poses.csv"]].concat();
    good(folder, &simulate);
    good(folder, &["fit", "--robot", "puma560", "--rig", "triangles", "poses.csv", "--out", "calibrated.toml"]);
}

#[test]
fn apply_uploads_a_calibrated_robot_and_the_board_computes_with_it_after_a_reset() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let _board = bare_board(folder);
    calibrated(folder);

    let empty = run(folder, &["status", "port", "--json"]);
    assert_eq!((empty.code, empty.json()["robot"].is_null()), (1, true), "a bare board fails the tests of parameters");
    let applied = good(folder, &["apply", "port", "--robot", "calibrated.toml", "--json"]);
    let report = applied.json();
    assert_eq!((report["vectors"].as_u64(), report["lvdt"].as_str()), (Some(1000), Some("nominal")));
    assert!(applied.stderr.contains("host-cal lvdt"), "says what is missing: {}", applied.stderr);
    let largest_um = report["max_position_difference_um"].as_f64().unwrap();
    assert!(largest_um > 0.01 && largest_um < 1.0, "{largest_um} µm");

    // Over a reset, the parameters stay and the homing goes.
    let before = run(folder, &["status", "port", "--json"]).json();
    let after = run(folder, &["status", "port", "--reset", "--json"]).json();
    assert_eq!(after["robot"], before["robot"]);
    assert_eq!((after["started_by"].as_str(), &after["robot"]["crc"]), (Some("a reset that was asked for"), &report["crc"]));
    let unhomed = run(folder, &["pose", "port", "--json"]);
    assert_eq!((unhomed.code, unhomed.json()["homed"].as_bool()), (1, Some(false)));

    // Homed where `fk` is asked, board and host give the same pose.
    let q = "10,-40,100,20,-30,50";
    good(folder, &["home", "port", "--q", q]);
    let pose = good(folder, &["pose", "port", "--json"]).json();
    let fk = good(folder, &["fk", "--robot", "calibrated.toml", "--q", q, "--json"]).json();
    for axis in 0..3 {
        let [board, host] = [&pose, &fk].map(|document| document["position_mm"][axis].as_f64().unwrap());
        // The encoders hold whole counts: half of one is 0.003 degrees, at a metre 0.06 mm.
        assert!((board - host).abs() < 0.1, "axis {axis}: {board} and {host} mm");
    }
    assert_eq!(pose["calibrated"], true);
}

#[test]
fn apply_refuses_what_should_not_be_on_a_board_and_keeps_what_is_there() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let _board = bare_board(folder);
    good(folder, &["apply", "port", "--robot", "puma560", "--uncalibrated", "--vectors", "20"]);
    let before = run(folder, &["status", "port", "--json"]).json();

    refused(folder, &["apply", "port", "--robot", "puma560"], &["puma560 (built in) has no [calibration]", "--uncalibrated"]);
    let without = ["apply", "port", "--robot", "irb120", "--uncalibrated"];
    refused(folder, &without, &["joint 1 has no `counts_per_rev`"]);
    std::fs::write(folder.join("seven.toml"), robot_of_joints(7)).unwrap();
    let seven = ["apply", "port", "--robot", "seven.toml", "--uncalibrated"];
    refused(folder, &seven, &["seven.toml has 7 joints, but the board counts 6 encoders"]);
    refused(folder, &["apply", "port", "--robot", "nowhere.toml"], &["nowhere.toml"]);

    // What the fit was found to be stands in the file: an older one does not say, and another word is no verdict.
    calibrated(folder);
    let text = std::fs::read_to_string(folder.join("calibrated.toml")).unwrap();
    let verdict = text.lines().find(|line| line.starts_with("verdict = ")).expect("a verdict");
    std::fs::write(folder.join("older.toml"), text.replace(&format!("{verdict}\n"), "")).unwrap();
    refused(
        folder,
        &["apply", "port", "--robot", "older.toml"],
        &["older.toml", "has no verdict", "host-cal fit", "--uncalibrated"],
    );
    for word in ["not_trusted", "unchanged", "Calibrated", ""] {
        std::fs::write(folder.join("odd.toml"), text.replace(verdict, &format!("verdict = \"{word}\""))).unwrap();
        refused(folder, &["apply", "port", "--robot", "odd.toml"], &["odd.toml:", "expected `calibrated` or `reserved`"]);
    }

    let after = run(folder, &["status", "port", "--json"]).json();
    for what in ["robot", "slots", "staged_crc"] {
        assert_eq!(after[what], before[what], "{what}");
    }
}

#[test]
fn apply_previous_brings_back_what_the_last_commit_replaced_and_again_undoes_it() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let _board = bare_board(folder);
    refused(
        folder,
        &["apply", "port", "--previous"],
        &["holds no parameters other than those in use", "host-cal apply PORT --robot"],
    );
    let design = good(folder, &["apply", "port", "--robot", "puma560", "--uncalibrated", "--json"]).json();
    assert!(run(folder, &["status", "port", "--json"]).json()["previous"].is_null(), "both places hold the same");
    refused(folder, &["apply", "port", "--previous"], &["holds no parameters other than those in use"]);

    calibrated(folder);
    let new = good(folder, &["apply", "port", "--robot", "calibrated.toml", "--json"]).json();
    // The same once more costs nothing.
    good(folder, &["apply", "port", "--robot", "calibrated.toml"]);
    let status = run(folder, &["status", "port", "--json"]).json();
    assert_eq!((&status["previous"]["crc"], &status["previous"]["calibrated"]), (&design["crc"], &false.into()));
    assert!(run(folder, &["status", "port"]).stdout.contains("host-cal apply PORT --previous"));

    for i in 0..3 {
        let (back, away) = if i % 2 == 0 { (&design, &new) } else { (&new, &design) };
        let report = good(folder, &["apply", "port", "--previous", "--json"]).json();
        assert_eq!((&report["crc"], &report["calibrated"]), (&back["crc"], &back["calibrated"]));
        assert_eq!((&report["replaced_crc"], &report["replaced_calibrated"]), (&away["crc"], &away["calibrated"]));
        assert!(report["vectors"] == 1000 && report["max_position_difference_um"].as_f64().unwrap() < 1.0, "{report}");
        let status = run(folder, &["status", "port", "--reset", "--json"]).json();
        assert_eq!((&status["robot"]["crc"], &status["previous"]["crc"]), (&back["crc"], &away["crc"]));
        assert_eq!(status["robot"]["sequence"], report["sequence"]);
        assert_eq!(status["staged_crc"], serde_json::Value::Null);
    }
    let text = good(folder, &["apply", "port", "--previous", "--vectors", "5"]).stdout;
    assert!(text.contains("calibrated robot") && text.contains("in place of UNCALIBRATED"), "{text}");
    for with in ["--robot=puma560", "--uncalibrated"] {
        refused(folder, &["apply", "port", "--previous", with], &["cannot be used with"]);
    }
    refused(folder, &["apply", "port"], &["--robot"]);
}

#[test]
fn apply_refuses_numbers_that_no_robot_has_before_it_speaks_to_the_board() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let robot = robot_of_joints(6);
    let cases = [
        // Millimetres of millimetres; a slip of the decimal point of an encoder.
        (robot.replace("100.0]", "432000.0]"), "the tool comes more than 100 m away from the base; the largest length is z"),
        (robot.replace("counts_per_rev = 8192", "counts_per_rev = 1e12"), "joint 1: counts per radian or metre must be"),
        (robot.replace("offset_deg = 0.0", "offset_deg = 9e5"), "offset1 is out of range"),
    ];
    for (text, words) in cases {
        std::fs::write(folder.join("odd.toml"), text).unwrap();
        refused(folder, &["apply", "no-such-port", "--robot", "odd.toml", "--uncalibrated"], &["odd.toml", words]);
    }
    // Half a kilometre that cancels is no part of the robot: only the port is wrong.
    std::fs::write(folder.join("slid.toml"), slid_by_half_a_kilometre()).unwrap();
    let said = run(folder, &["apply", "no-such-port", "--robot", "slid.toml", "--uncalibrated"]).stderr;
    assert!(said.contains("no-such-port") && !said.contains("slid.toml"), "{said}");
}

/// The same robot twice: joint 2's frame stands where it is, or 574 m along its axis.
fn slid_by_half_a_kilometre() -> String {
    let (near, axis) = (robot_of_joints(6), "translation_mm = [10.0, 0.0, 100.0]");
    let mut links = near.splitn(4, axis);
    let parts: Vec<&str> = links.by_ref().collect();
    let moved = ["translation_mm = [574010.0, 0.0, 100.0]", "translation_mm = [10.0, 0.0, -573900.0]"];
    [parts[0], axis, parts[1], moved[0], parts[2], moved[1], parts[3]].concat()
}

/// A robot file of equal revolute joints with encoders.
fn robot_of_joints(joints: usize) -> String {
    let link = "[[links]]\ntranslation_mm = [10.0, 0.0, 100.0]\nrotation_deg = [0.0, 90.0, 0.0]\n";
    let joint = "[[joints]]\ntype = \"revolute\"\noffset_deg = 0.0\nscale = 1.0\nmin_deg = -90.0\nmax_deg = 90.0\ncounts_per_rev = 8192\n";
    link.repeat(joints + 1) + &joint.repeat(joints)
}

#[test]
fn home_and_pose_refuse_a_board_without_parameters_and_wrong_joint_values() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let _board = bare_board(folder);
    refused(folder, &["home", "port", "--q", "0,0,0,0,0,0"], &["the board holds no parameters", "host-cal apply PORT"]);
    refused(folder, &["pose", "port"], &["the board refuses `current pose`: it holds no parameters"]);
    refused(folder, &["stream", "port", "--pose"], &["the board holds no parameters"]);
    good(folder, &["apply", "port", "--robot", "puma560", "--uncalibrated", "--vectors", "20"]);
    refused(folder, &["home", "port", "--q", "0,0,0"], &["--q has 3 values, but the robot has 6 joints"]);
    refused(folder, &["home", "port", "--q", "nan,0,0,0,0,0"], &["--q is NaN"]);
    refused(folder, &["home", "port", "--q", "1e9,0,0,0,0,0"], &["joint 1", "more than the board can hold"]);
    let counts = good(folder, &["home", "port", "--q", "90,0,0,0,90,0", "--json"]).json()["counts"].clone();
    // Joint 6 is turned along by 13/72 of joint 5, which its own encoder does not see.
    assert_eq!(counts, serde_json::json!([-15653, 0, 0, 0, 17981, -3462]));
}

#[test]
fn lvdt_finds_the_curve_of_the_simulated_lvdt_from_known_lengths() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let truth = open_robot("puma560-optimised").unwrap();
    let rig = open_rig("triangles").unwrap();
    let plant = Plant::new(&truth, 0.075, 7).unwrap();
    let true_curve = plant.lvdt();
    let parameters = Some(parameter_set(&truth, nominal_lvdt(0.075)).unwrap());
    let port_name = Some(folder.join("port"));
    let options = VirtualBoardOptions { parameters, port_name, ..VirtualBoardOptions::new(plant, Pace::Real) };
    let mut board = VirtualBoard::start(options).unwrap();

    // The arm stands; a micrometer sets the bar. Seen from the board, the length is off by as much.
    let q = JointVector::zero();
    let pairing = rig.pairing(rig.all_pairings()[0]);
    let mid_m = ballbar::Kinematics::new(&truth.chain).length(&q, &pairing);
    let bar = Some(AttachedBar { pairing, mid_m });
    let offsets_mm = [-35.0, -25.0, -15.0, -5.0, 5.0, 15.0, 25.0, 35.0];
    let station = |&mm: &f64| Station { q, bar, dwell_s: 0.9, length_error_m: mm / 1e3 };
    let stations = offsets_mm.iter().map(station).collect();
    board.play_with_stream(Script { stations, speed: JointSpeed::default() });

    let lengths = offsets_mm.map(|mm| (460.0 + mm).to_string()).join(",");
    let args = ["lvdt", "port", "--bar", "460", "--lengths", &lengths, "--hold-ms", "300", "--json"];
    let report = good(folder, &args).json();
    assert_eq!((report["outcome"].as_str(), report["points"].as_array().map(Vec::len)), (Some("stored"), Some(8)));
    assert!(report["max_abs_mm"].as_f64().unwrap() < 0.003, "{report}");
    let found_mm: Vec<f64> = report["coefficients_mm"].as_array().unwrap().iter().map(|c| c.as_f64().unwrap()).collect();
    for (power, (found, expected)) in found_mm.iter().zip(true_curve.coefficients_m).enumerate() {
        assert!((found - f64::from(expected) * 1e3).abs() < 0.02, "c{power}: {found} and {} mm", expected * 1e3);
    }
    let mut link = BoardLink::connect(board.port(), BAUD).unwrap();
    let (robot, _) = RobotOnBoard::read(&mut link).unwrap().unwrap();
    assert!((f64::from(robot.set().lvdt.coefficients_m[1]) * 1e3 - found_mm[1]).abs() < 1e-9, "it is in flash");
}

#[test]
fn a_hostile_name_on_the_board_is_shown_harmless_by_every_command() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let _board = bare_board(folder);
    let (name, puma) = ("\u{202e}lmot\u{2028}\u{200b}", host_cal::files::ROBOTS[0].1);
    std::fs::write(folder.join("robot.toml"), puma.replacen("name = ", &format!("name = \"{name}\" #"), 1)).unwrap();
    let apply: &[&str] = &["apply", "port", "--robot", "robot.toml", "--uncalibrated", "--vectors", "20"];
    let home: &[&str] = &["home", "port", "--q", "0,-90,90,0,0,0"];
    let commands: [&[&str]; 7] = [
        apply,
        apply,
        home,
        &["status", "port"],
        &["pose", "port"],
        &["stream", "port", "--for", "1s"],
        &["stream", "port", "--for", "1s", "--session", "s"],
    ];
    for command in commands.iter().flat_map(|command| [command.to_vec(), [command, &["--json"][..]].concat()]) {
        let run = run(folder, &command);
        // Without a bar the LVDT has no signal, which the self-test says.
        assert!(run.code == 0 || (run.code, command[0]) == (1, "status"), "{command:?}: {}", run.transcript());
        let hidden = |text: &String| text.chars().find(|&c| c != '\n' && host_cal::text::is_hidden(c));
        assert_eq!((hidden(&run.stdout), hidden(&run.stderr)), (None, None), "{command:?}: {}", run.transcript());
    }
    assert_eq!(good(folder, &["pose", "port", "--json"]).json()["robot"], name);
    let status = run(folder, &["status", "port"]).stdout;
    assert!(status.contains("\\u{202e}lmot\\u{2028}\\u{200b}"), "{status}");
}
