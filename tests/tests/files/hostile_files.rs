//! Files with bytes changed at random: a reader takes them or says what is wrong, and never panics.

use ballbar_calib::model::{Calibration, CalibrationVerdict, Dataset, Rig, Robot};
use ballbar_tests::at_length::at_length;
use ballbar_tests::workbench::{POSES, RIG, ROBOT, Workbench};
use host_cal::files::{
    InputError, Source, UrdfEnds, append_poses, calibrated_toml, parse_rig, parse_robot, parse_urdf, read_targets, write_poses,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const MUTANTS: usize = 2_000;

/// Neither are all mutants refused, nor hardly any.
fn is_mixed(taken: usize) -> bool {
    let mutants = at_length(MUTANTS);
    (mutants / 20..mutants * 3 / 4).contains(&taken)
}

/// What means something to a parser of TOML, CSV or numbers.
const TOKENS: [&str; 30] = [
    ",",
    "\n",
    "\r",
    "\r\n",
    "\"",
    "\"\"\"",
    "'",
    "#",
    "=",
    "[",
    "]",
    "[[",
    "{",
    "}",
    ".",
    "-",
    "e9",
    "nan",
    "inf",
    "1e999",
    "-0.0",
    "0x1F",
    "1979-05-27",
    "true",
    "\t",
    "\0",
    "ä",
    "\u{feff}",
    "\u{202e}",
    "18446744073709551616",
];

/// A text with one or two changes.
fn mutant(rng: &mut ChaCha8Rng, text: &str) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..rng.random_range(1..=2) {
        let at = rng.random_range(0..=bytes.len());
        let length = if rng.random_bool(0.8) { rng.random_range(1..6) } else { rng.random_range(6..80) };
        let end = (at + length).min(bytes.len());
        let token = TOKENS[rng.random_range(0..TOKENS.len())].bytes();
        match rng.random_range(0..8) {
            0 => bytes.splice(at..at, token).for_each(drop),
            1 => bytes.splice(at..end, token).for_each(drop),
            2 => bytes.drain(at..end).for_each(drop),
            3 => bytes.splice(at..at, bytes[at..end].to_vec()).for_each(drop),
            4 => bytes.truncate(end.max(1)),
            5 => bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte = rng.random_range(0..=255)),
            6 => bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= 1 << rng.random_range(0..8)),
            _ => {
                let digits = bytes.iter_mut().skip(at).filter(|byte| byte.is_ascii_digit());
                digits.take(length).for_each(|digit| *digit = rng.random_range(b'0'..=b'9'));
            }
        }
    }
    bytes
}

/// Reads mutants of a text; an error must name the file, and what is read must be sound. Says how many were read.
fn read_mutants<T>(text: &str, read: impl Fn(&Source) -> Result<T, InputError>, is_sound: impl Fn(&T)) -> usize {
    let mut rng = ChaCha8Rng::seed_from_u64(1993);
    let mut taken = 0;
    for _ in 0..at_length(MUTANTS) {
        let source = Source::new("mutant", &String::from_utf8_lossy(&mutant(&mut rng, text)));
        match read(&source) {
            Ok(value) => {
                is_sound(&value);
                taken += 1;
            }
            Err(error) => assert!(error.to_string().starts_with("mutant"), "{error}"),
        }
    }
    taken
}

fn good() -> (Robot, Rig) {
    let source = |text| Source::new("good", text);
    (parse_robot(&source(ROBOT)).expect("a good robot"), parse_rig(&source(RIG)).expect("a good rig"))
}

/// Puts text before or behind a place in a good file.
fn with(text: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "the good file has no {from}");
        text.replacen(from, to, 1)
    })
}

/// A good robot that says of everything how well it is known.
fn robot_with_tolerances() -> String {
    let slide = "offset_mm = 10.0\n";
    let changes = [
        ("[[links]]", "[tolerances]\nlink_mm = 0.5\nlink_deg = 0.1\noffset_deg = 0.2\noffset_mm = 2\nscale = 1e-4\n\n[[links]]"),
        ("rotation_deg = [0.0, 90.0, 0.0]\n", "rotation_deg = [0.0, 90.0, 0.0]\ntolerance_mm = 0.25\ntolerance_deg = 0\n"),
        ("offset_deg = -90.0\n", "offset_deg = -90.0\ntolerance_deg = 0.75 # by eye\nscale_tolerance = 0\n"),
        (slide, "offset_mm = 10.0\ntolerance_mm = 1.5\n"),
    ];
    with(ROBOT, &changes)
}

/// A good rig that says of everything how well it is known.
fn rig_with_tolerances() -> String {
    let own = "name = \"B\"\ntolerance_mm = 2\n";
    let bar = "travel_mm = 75.0\nzero_tolerance_mm = [0.2, 0]\ngain_tolerance = 2e-3\n";
    let changes = [("[[chucks]]", "tolerance_mm = 0.1\n\n[[chucks]]"), ("name = \"B\"\n", own), ("travel_mm = 75.0\n", bar)];
    with(RIG, &changes)
}

/// A good file of poses with every optional column.
fn full_poses() -> String {
    let mut lines = POSES.lines();
    let header = lines.next().expect("a header");
    let rows: String =
        lines.map(|row| if row.starts_with('#') { format!("{row}\n") } else { format!("{row},0.1,a,2.5\n") }).collect();
    format!("{header},sigma_mm,set,t_s\n{rows}")
}

#[test]
fn a_mutant_of_a_robot_is_refused_or_has_sound_numbers_that_survive_a_rewrite() {
    let calibration = Calibration {
        when: "now".to_owned(),
        by: "a test".to_owned(),
        verdict: Some(CalibrationVerdict::Reserved),
        reasons: vec!["A \"length\"\nstands out.".to_owned()],
        from_robot: "mutant".to_owned(),
        from_poses: vec!["poses.csv".to_owned()],
        poses: 3,
        free_parameters: 2,
        rms_initial_mm: 9.5,
        rms_mm: 0.25,
        held_out_rms_mm: None,
    };
    let is_sound = |(source, robot): &(Source, Robot)| {
        assert!(robot.chain.parameters().iter().all(|value| value.is_finite()));
        assert_eq!((robot.limits.len(), robot.encoders.len()), (robot.chain.joints(), robot.chain.joints()));
        assert!(robot.limits.iter().all(|limits| limits.min < limits.max));
        assert!(robot.tolerances.are_of(robot.chain.joints()), "{:?}", robot.tolerances);
        let text = calibrated_toml(source, &robot.chain, &robot.terms, &calibration).expect("a file that was read can be edited");
        let again = parse_robot(&Source::new("rewritten", &text)).unwrap_or_else(|error| panic!("{error}\n{text}"));
        for (before, after) in robot.chain.parameters().iter().zip(again.chain.parameters()) {
            assert!((before - after).abs() <= 1e-12 * before.abs(), "{before} became {after}\n{text}");
        }
        assert_eq!(again.calibration.as_ref(), Some(&calibration));
        assert_eq!(again.tolerances, robot.tolerances);
    };
    for text in [ROBOT, &robot_with_tolerances()] {
        let taken = read_mutants(text, |source| Ok((source.clone(), parse_robot(source)?)), is_sound);
        assert!(is_mixed(taken), "{taken} robots taken: the mutants are too mild or too wild");
    }
}

#[test]
fn a_mutant_of_a_rig_is_refused_or_has_points_with_names() {
    let is_tolerance = |tolerance: &f64| tolerance.is_finite() && *tolerance >= 0.0;
    let is_sound = |rig: &Rig| {
        for points in [&rig.chucks, &rig.spheres] {
            assert!(!points.is_empty());
            for (i, point) in points.iter().enumerate() {
                assert!(!point.name.is_empty() && point.position_m.iter().all(|metres| metres.is_finite()));
                assert!(points[..i].iter().all(|other| other.name != point.name));
                assert!(point.tolerance_m.iter().all(is_tolerance));
            }
        }
        let Some(bar) = &rig.bar else { return };
        assert!(bar.travel_m > 0.0 && bar.lengths_m.iter().all(|&length| length > 0.0));
        assert!(
            bar.zero_tolerances_m.iter().all(|zeros_m| zeros_m.len() == bar.lengths_m.len() && zeros_m.iter().all(is_tolerance))
        );
        assert!(bar.gain_tolerance.iter().all(is_tolerance));
    };
    for text in [RIG, &rig_with_tolerances()] {
        let taken = read_mutants(text, parse_rig, is_sound);
        assert!(is_mixed(taken), "{taken} rigs taken: the mutants are too mild or too wild");
    }
}

#[test]
fn a_mutant_of_poses_is_refused_or_has_sound_rows_that_can_be_written_and_read_again() {
    let (robot, rig) = good();
    let read = |source: &Source| {
        let mut dataset = Dataset::default();
        append_poses(&mut dataset, source, &robot, &rig)?;
        Ok(dataset)
    };
    let is_sound = |dataset: &Dataset| {
        assert!(!dataset.rows.is_empty());
        for (i, row) in dataset.rows.iter().enumerate() {
            assert!(row.measurement.length_m > 0.0 && row.measurement.length_m.is_finite());
            assert!(row.measurement.weight > 0.0 && row.measurement.weight.is_finite());
            assert!(row.measurement.q.as_array().iter().all(|q| q.is_finite()));
            assert!(dataset.place(i).starts_with("mutant:"));
        }
        assert!(
            dataset
                .warnings(&robot, &rig)
                .iter()
                .all(|(row, warning)| *row < dataset.rows.len() && !warning.to_string().is_empty())
        );
        let plain = |set: &String| !set.contains([',', '"', '\n', '\r']);
        if dataset.rows.iter().all(|row| row.set.as_ref().is_none_or(plain)) {
            let text = write_poses(&robot, &rig, &dataset.rows);
            let again = read(&Source::new("rewritten", &text)).unwrap_or_else(|error| panic!("{error}\n{text}"));
            assert_eq!(again.rows.len(), dataset.rows.len());
        }
    };
    let taken = read_mutants(&full_poses(), read, is_sound);
    assert!(is_mixed(taken), "{taken} files taken: the mutants are too mild or too wild");
}

#[test]
fn a_mutant_of_a_urdf_is_refused_or_becomes_a_robot_file() {
    let ends = UrdfEnds { base: None, tip: Some("gripper") };
    let read = |source: &Source| parse_urdf(source, ends);
    let is_sound = |imported: &host_cal::files::Imported| {
        let again = parse_robot(&Source::new("imported", &imported.toml)).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(again.chain.parameters(), imported.robot.chain.parameters());
        assert!(again.limits.iter().all(|limits| limits.min < limits.max));
    };
    let taken = read_mutants(include_str!("../../urdf/scara.urdf"), read, is_sound);
    assert!(is_mixed(taken), "{taken} files taken: the mutants are too mild or too wild");
}

#[test]
fn a_mutant_of_targets_is_refused_or_has_sound_numbers() {
    let (robot, _) = good();
    let text =
        "q1_deg,q2_mm,x_mm,y_mm,z_mm,alpha_deg,beta_deg,gamma_deg\n10,100.5,400,-20.5,30,0,90,-180\n-20,150,1e2,0,3,1,2,3\n";
    let read = |source: &Source| read_targets(source, &robot);
    let taken = read_mutants(text, read, |targets| {
        assert!(!targets.is_empty() && targets.iter().all(|target| target.line > 1 && !format!("{target:?}").contains("NaN")));
    });
    assert!(is_mixed(taken), "{taken} files taken: the mutants are too mild or too wild");
}

#[test]
fn the_command_shows_what_is_wrong_with_a_mutant_without_a_panic() {
    let mut rng = ChaCha8Rng::seed_from_u64(560);
    let args = ["validate", "--robot", "robot.toml", "--rig", "rig.toml", "poses.csv"];
    let (robot, rig) = (robot_with_tolerances(), rig_with_tolerances());
    for (file, text) in [("robot.toml", &robot), ("rig.toml", &rig), ("poses.csv", &full_poses())] {
        let bench = Workbench::new();
        for _ in 0..100 {
            let bytes = mutant(&mut rng, text);
            bench.put(file, &bytes);
            let run = bench.run(&args);
            assert!([0, 2].contains(&run.code), "{}\n{}", run.transcript(), String::from_utf8_lossy(&bytes));
            assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
            assert!(run.code == 0 || (run.stdout.is_empty() && run.stderr.contains(".csv") | run.stderr.contains(".toml")));
        }
    }
}

#[test]
fn a_robots_name_is_a_line_of_a_screen_and_a_file_of_no_end_is_not_read_to_it() {
    let long = "n".repeat(201);
    let text = |name: &str| format!("name = {name}\n{}", ROBOT.split_once('\n').expect("a name").1);
    for (name, says) in [
        ("\"\\u001b[31mred\"", "robot.toml:1: `name` is `\\u{1b}[31mred`, 8 bytes long"),
        ("\"one\\ntwo\"", "robot.toml:1: `name` is `one\\ntwo`, 7 bytes long"),
        (&format!("\"{long}\""), "201 bytes long, expected at most 200 bytes"),
        ("\"\u{1b}[31mred\"", "robot.toml:1: "),
        (&format!("\"{}\"", "n".repeat(1 << 20)), "robot.toml: longer than 1048576 bytes"),
    ] {
        let bench = Workbench::new();
        bench.put("robot.toml", text(name));
        let run = bench.run(&["fk", "--robot", "robot.toml", "--q", "0,0"]);
        // Long messages are broken into lines.
        let said = run.stderr.replace("\n  │ ", " ");
        assert!(run.code == 2 && said.contains(says) && said.len() < 2_000, "{says}: {}", run.transcript());
        assert!(!run.stderr.contains('\u{1b}'), "{:?}", run.stderr);
    }
    assert!(parse_robot(&Source::new("robot", &text("\"\u{2028} é\""))).is_ok());
    #[cfg(unix)]
    for arguments in
        [&["fk", "--robot", "/dev/zero", "--q", "0,0"][..], &["compensate", "--robot", "ur5e", "--nominal", "ur5e", "/dev/zero"]]
    {
        let run = Workbench::new().run(arguments);
        assert!(run.code == 2 && run.stderr.contains("/dev/zero: longer than"), "{}", run.transcript());
    }
}

#[test]
fn a_set_that_needs_quotes_is_written_with_them() {
    let (robot, rig) = good();
    for set in ["left, then right", "the \"second\" one", "# 2"] {
        let quoted = set.replace('"', "\"\"");
        let text = format!("set,chuck,sphere,q1_deg,q2_mm,length_mm\n\"{quoted}\",A,1,10.0,100.0,455.5\n");
        let read = |text: &str| {
            let mut dataset = Dataset::default();
            append_poses(&mut dataset, &Source::new("poses.csv", text), &robot, &rig)
                .unwrap_or_else(|error| panic!("{error}\n{text}"));
            dataset
        };
        let again = read(&write_poses(&robot, &rig, &read(&text).rows));
        assert_eq!(again.rows[0].set.as_deref(), Some(set));
    }
}

#[test]
fn weights_stay_finite_however_small_or_large_sigma_is() {
    let (robot, rig) = good();
    for sigma in ["1e-200", "1e-160", "1e200"] {
        let rows = format!("A,1,10.0,100.0,455.5,{sigma}\nA,1,11.0,100.0,455.5,0.1\n");
        let source = Source::new("poses.csv", &format!("chuck,sphere,q1_deg,q2_mm,length_mm,sigma_mm\n{rows}"));
        let mut dataset = Dataset::default();
        if append_poses(&mut dataset, &source, &robot, &rig).is_ok() {
            let weights: Vec<f64> = dataset.rows.iter().map(|row| row.measurement.weight).collect();
            assert!(weights.iter().all(|&weight| weight > 0.0 && weight.is_finite()), "sigma_mm {sigma}: {weights:?}");
        }
    }
}
