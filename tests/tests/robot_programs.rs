//! Programs for controllers: text, values read back by parsers that know each language's grammar, and what a language cannot hold.

use ballbar::{JointKind, JointVector};
use host_cal::robot_link::JointSpeed;
use host_cal::robot_link::program::{Dialect, Program, ProgramError, ProgramFile, ProgramStep, write_program};
use proptest::prelude::*;

#[path = "robot_programs/parsers.rs"]
mod parsers;

use parsers::Read;

fn joint_vector(values: &[f64], kinds: &[JointKind]) -> JointVector<f64> {
    let mut q = JointVector::zero();
    for ((q, value), kind) in q.as_array_mut().iter_mut().zip(values).zip(kinds) {
        *q = if *kind == JointKind::Revolute { value.to_radians() } else { value * 1e-3 };
    }
    q
}

/// Two measured poses with a via between them; degrees and millimetres.
fn program(kinds: &[JointKind]) -> Program {
    let step = |values: [f64; 8], is_measured, comment: &str| ProgramStep {
        q: joint_vector(&values, kinds),
        is_measured,
        comment: comment.to_owned(),
    };
    Program {
        name: "shell".into(),
        kinds: kinds.to_vec(),
        steps: vec![
            step([0.0, -90.0, 90.0, 0.0, 0.0, 0.0, 100.0, 0.0], true, "A:1 row 1"),
            step([12.3456, -75.5, 80.25, 10.0, -30.0, 5.0, 150.5, 0.0], false, "around; \"the\"\nbar ü"),
            step([45.0, -60.125, 70.0, -100.0, 99.999, -200.0, -0.25, 0.0], true, ""),
        ],
        speed: JointSpeed::default(),
        stand_s: 2.0,
    }
}

const SIX: [JointKind; 6] = [JointKind::Revolute; 6];

fn files(dialect: Dialect, program: &Program) -> Vec<ProgramFile> {
    write_program(dialect, program).unwrap_or_else(|error| panic!("{dialect}: {error}"))
}

#[test]
fn a_short_program_in_every_language() {
    for dialect in Dialect::ALL {
        let files = files(dialect, &program(&SIX));
        let text: String = files.iter().map(|file| format!("==== {}\n{}", file.name, file.text)).collect();
        insta::assert_snapshot!(format!("program_{dialect}"), text);
    }
}

/// What a controller reads is what was planned, to the language's resolution.
fn check_read_back(dialect: Dialect, program: &Program) {
    let files = files(dialect, program);
    let steps: Vec<Read> = parsers::read(dialect, &files);
    assert_eq!(steps.len(), program.steps.len());
    let resolution = match dialect {
        // Half a thousandth, and the rounding of what is read.
        Dialect::Val => 0.000_501,
        // Three decimals each of q3 - q2, and of q2.
        Dialect::FanucLs => 0.001_01,
        _ => 1e-5,
    };
    for (number, (read, step)) in (1..).zip(steps.iter().zip(&program.steps)) {
        assert_eq!(read.values.len(), program.kinds.len(), "{dialect} {number}");
        for ((value, kind), q) in read.values.iter().zip(&program.kinds).zip(step.q.as_array()) {
            let planned = if *kind == JointKind::Revolute { q.to_degrees() } else { q * 1e3 };
            assert!((value - planned).abs() <= resolution, "{dialect} {number}: {value} for {planned}");
        }
        assert_eq!(read.stand_s.is_some(), step.is_measured, "{dialect} {number}");
        assert!((read.stand_s.unwrap_or(program.stand_s) - program.stand_s).abs() < 1e-6, "{dialect} {number}");
    }
}

#[test]
fn the_values_of_the_short_program_are_read_back() {
    for dialect in Dialect::ALL {
        check_read_back(dialect, &program(&SIX));
    }
}

#[test]
fn linear_axes_are_millimetres() {
    use JointKind::{Prismatic, Revolute};
    let with_track = [Revolute, Revolute, Revolute, Revolute, Revolute, Revolute, Prismatic];
    for dialect in [Dialect::Krl, Dialect::Rapid, Dialect::FanucLs] {
        check_read_back(dialect, &program(&with_track));
    }
    for dialect in [Dialect::Krl, Dialect::FanucLs] {
        check_read_back(dialect, &program(&[Revolute, Revolute, Prismatic, Revolute]));
    }
    let text = files(Dialect::FanucLs, &program(&with_track))[0].text.clone();
    assert!(text.contains("\tE1=   100.000  mm\n}"), "{text}");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(60) })]

    #[test]
    fn any_values_are_read_back(
        rows in prop::collection::vec((prop::array::uniform6(-400.0..400.0_f64), any::<bool>(), ".{0,60}"), 1..8),
        stand_s in 0..3000_u32,
        speed_deg_s in 1.0..200.0_f64,
    ) {
        let steps = rows.iter().map(|(values, is_measured, comment)| ProgramStep {
            q: joint_vector(values, &SIX), is_measured: *is_measured, comment: comment.clone(),
        });
        let program = Program {
            name: "shell".into(),
            kinds: SIX.to_vec(),
            steps: steps.collect(),
            speed: JointSpeed { revolute_rad_s: speed_deg_s.to_radians(), prismatic_m_s: 0.1 },
            stand_s: f64::from(stand_s) * 0.1,
        };
        for dialect in Dialect::ALL {
            check_read_back(dialect, &program);
        }
    }
}

#[test]
fn a_move_of_a_given_time_keeps_the_speed_in_its_middle() {
    // From the first to the second step joint 5 has the longest way, 30 degrees; at 60 degrees per second throughout, half a second.
    for (dialect, given) in [(Dialect::Rapid, "v1000\\T:=0.75"), (Dialect::FanucLs, " 0.8sec FINE")] {
        let text = &files(dialect, &program(&SIX))[0].text;
        assert!(text.contains(given), "{text}");
    }
}

#[test]
fn percentages_never_exceed_the_speed() {
    let slow = Program { speed: JointSpeed { revolute_rad_s: 0.3, prismatic_m_s: 0.1 }, ..program(&SIX) };
    // 0.3 rad/s are 17.2 degrees per second: 7.2 % of 240, 2.9 % of 600.
    assert!(files(Dialect::Val, &slow)[0].text.contains("SPEED 7 ALWAYS"));
    assert!(files(Dialect::Krl, &slow)[0].text.contains("$VEL_AXIS[6]=2\n"));
}

#[test]
fn a_long_fanuc_program_is_split_and_called() {
    let one = program(&SIX);
    let long = Program { steps: one.steps.iter().cycle().take(2000).cloned().collect(), ..one };
    let files = files(Dialect::FanucLs, &long);
    let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
    assert_eq!(names, ["SHELL.LS", "SHELL01.LS", "SHELL02.LS", "SHELL03.LS"]);
    assert!(files[0].text.contains("   1:  CALL SHELL01    ;\n   2:  CALL SHELL02    ;\n   3:  CALL SHELL03    ;\n/POS\n/END\n"));
    for file in &files {
        assert!(file.text.matches("\nP[").count() <= 999, "{}", file.name);
    }
    check_read_back(Dialect::FanucLs, &long);
}

#[test]
fn what_a_language_cannot_hold_is_refused() {
    use JointKind::{Prismatic, Revolute};
    let six = program(&SIX);
    let error = |dialect, program: &Program| write_program(dialect, program).unwrap_err();

    for (dialect, joints) in [(Dialect::Val, 7), (Dialect::UrScript, 7), (Dialect::UrScript, 5), (Dialect::Krl, 0)] {
        let found = error(dialect, &program(&[Revolute; 8][..joints]));
        assert!(matches!(found, ProgramError::Joints { found, .. } if found == joints), "{dialect}: {found}");
    }
    let stanford = program(&[Revolute, Revolute, Prismatic, Revolute, Revolute, Revolute]);
    for dialect in [Dialect::Val, Dialect::UrScript, Dialect::Rapid] {
        assert_eq!(error(dialect, &stanford), ProgramError::Prismatic { dialect, joint: 3 });
    }
    for (dialect, name) in [
        (Dialect::Val, "shells1"),
        (Dialect::Val, "a_b"),
        (Dialect::Rapid, "a_name_of_13_"),
        (Dialect::Krl, "1st"),
        (Dialect::FanucLs, "shells1"),
        (Dialect::UrScript, ""),
        (Dialect::UrScript, "a b"),
        (Dialect::Krl, "schürze"),
    ] {
        let found = error(dialect, &Program { name: name.into(), ..six.clone() });
        assert!(matches!(&found, ProgramError::Name { found, .. } if found == name), "{dialect}: {found}");
    }
    for dialect in Dialect::ALL {
        assert_eq!(error(dialect, &Program { steps: vec![], ..six.clone() }), ProgramError::NoSteps);
        for revolute_rad_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let speed = JointSpeed { revolute_rad_s, ..JointSpeed::default() };
            assert_eq!(error(dialect, &Program { speed, ..six.clone() }), ProgramError::Speed);
        }
        for stand_s in [-1.0, 301.0] {
            let found = error(dialect, &Program { stand_s, ..six.clone() });
            assert_eq!(found, ProgramError::Stand { found_s: stand_s, at_most_s: 300.0 });
        }
        for value in [f64::NAN, f64::INFINITY, 1e9] {
            let mut broken = six.clone();
            broken.steps[1].q.as_array_mut()[3] = value;
            assert_eq!(error(dialect, &broken), ProgramError::Value { step: 2, joint: 4 });
        }
    }
    let endless = Program { steps: six.steps.iter().cycle().take(10_000).cloned().collect(), ..six };
    assert!(matches!(error(Dialect::Val, &endless), ProgramError::Steps { found: 10_000, .. }));
}

#[test]
fn a_comment_cannot_become_a_line() {
    let mut hostile = program(&SIX);
    hostile.steps[0].comment = "x\nMOVE #P2\r\n/END ;}\"]\u{2028}end\u{0}".into();
    for dialect in Dialect::ALL {
        check_read_back(dialect, &hostile);
        for file in files(dialect, &hostile) {
            assert!(file.text.bytes().all(|byte| byte == b'\n' || byte == b'\t' || (b' '..=b'~').contains(&byte)), "{dialect}");
        }
    }
}
