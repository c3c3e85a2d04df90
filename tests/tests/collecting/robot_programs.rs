//! Programs for controllers, carried out by interpreters that know each language's grammar: what moves, from where, how fast, what the
//! operator is told, what a language cannot hold, and that the programs of a plan do not know one another's names.
#![cfg(unix)]

use ballbar::{JointKind, JointVector};
use host_cal::robot_link::JointSpeed;
use host_cal::robot_link::program::{
    ControllerSetup, Dialect, Program, ProgramFile, ProgramStep, START_TOLERANCE_DEG, START_TOLERANCE_MM, write_program,
};
use proptest::prelude::*;

mod interpreters;
mod languages;
mod plans;

use interpreters::{Event, Machine, doubles, expected_axes, global_names, judge, run};

const R: JointKind = JointKind::Revolute;
const P: JointKind = JointKind::Prismatic;
const SIX: [JointKind; 6] = [R; 6];

fn joint_vector(values: &[f64], kinds: &[JointKind]) -> JointVector<f64> {
    let mut q = JointVector::zero();
    for ((q, value), kind) in q.as_array_mut().iter_mut().zip(values).zip(kinds) {
        *q = if *kind == R { value.to_radians() } else { value * 1e-3 };
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
            step([1.5, -90.0, 90.0, 0.0, 0.0, 0.0, 100.0, 0.0], true, "A:1 row 1"),
            step([12.3456, -75.5, 80.25, 10.0, -30.0, 5.0, 150.5, 0.0], false, "around; \"the\"\nbar ü"),
            step([45.0, -60.125, 70.0, -100.0, 99.999, -200.0, -0.25, 0.0], true, ""),
        ],
        speed: JointSpeed::default(),
        stand_s: 2.0,
        before: "the bar has to be ON: A:1, 460 mm".into(),
        after: "all poses done, take the bar OFF".into(),
        setup: ControllerSetup { j23: Some(-1), ..ControllerSetup::default() },
    }
}

fn files(dialect: Dialect, program: &Program) -> Vec<ProgramFile> {
    write_program(dialect, program).unwrap_or_else(|error| panic!("{dialect}: {error}"))
}

fn check(dialect: Dialect, program: &Program) {
    if let Err(why) = judge(dialect, &files(dialect, program), program) {
        panic!("{dialect}: {why}");
    }
}

#[test]
fn a_short_program_in_every_language() {
    for dialect in Dialect::ALL {
        let files = files(dialect, &program(&SIX));
        let text: String = files.iter().map(|file| format!("==== {}\n{}", file.name, file.text.replace("\r\n", "\n"))).collect();
        insta::assert_snapshot!(format!("program_{dialect}"), text);
    }
}

#[test]
fn the_short_program_does_what_it_should_from_its_first_pose_and_nothing_from_elsewhere() {
    for dialect in Dialect::ALL {
        check(dialect, &program(&SIX));
    }
    assert!((START_TOLERANCE_DEG, START_TOLERANCE_MM) == (0.5, 1.0), "as docs/robots.md has it");
}

/// A line that people read, and no machine.
fn is_comment(dialect: Dialect, line: &str) -> bool {
    let code = match dialect {
        Dialect::FanucLs => line.get(5..).unwrap_or(line),
        _ => line,
    };
    let begin = match dialect {
        Dialect::Val | Dialect::Krl => "; ",
        Dialect::UrScript => "# ",
        Dialect::Rapid => "! ",
        Dialect::FanucLs => "!",
    };
    code.trim_start().starts_with(begin)
}

/// Programs with one mistake: a line left out, or another digit. What was changed, and the text.
fn mutants(dialect: Dialect, text: &str) -> Vec<(String, String)> {
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    let mut mutants = Vec::new();
    for (index, line) in lines.iter().enumerate().filter(|(_, line)| !is_comment(dialect, line) && !line.trim().is_empty()) {
        let with = |line: &str| format!("{}{line}{}", lines[..index].concat(), lines[index + 1..].concat());
        mutants.push((format!("without `{}`", line.trim_end()), with("")));
        for (at, digit) in line.char_indices().filter(|(_, c)| c.is_ascii_digit()) {
            let other = char::from_digit((digit.to_digit(10).expect("a digit") + 5) % 10, 10).expect("a digit");
            let line = format!("{}{other}{}", &line[..at], &line[at + 1..]);
            mutants.push((format!("`{}`", line.trim_end()), with(&line)));
        }
    }
    mutants
}

#[test]
fn every_mistake_in_a_program_is_found() {
    for dialect in Dialect::ALL {
        let program = program(&SIX);
        let [file] = &files(dialect, &program)[..] else { panic!("{dialect}: one file") };
        let mutants = mutants(dialect, &file.text);
        assert!(mutants.len() > 150, "{dialect}: {}", mutants.len());
        for (what, text) in mutants {
            let mutant = ProgramFile { text, ..file.clone() };
            let found = judge(dialect, std::slice::from_ref(&mutant), &program);
            assert!(found.is_err(), "{dialect}: not found: {what}");
        }
    }
}

#[test]
fn mistakes_that_a_person_would_make_are_found() {
    let found = |dialect, from: &str, to: &str| {
        let program = program(&SIX);
        let [file] = &files(dialect, &program)[..] else { panic!("{dialect}: one file") };
        assert!(file.text.contains(from), "{dialect}: {from}");
        let mutant = ProgramFile { text: file.text.replace(from, to), ..file.clone() };
        assert!(judge(dialect, &[mutant], &program).is_err(), "{dialect}: {to} for {from}");
    };
    found(Dialect::Val, "MOVE #", "MOVES #");
    found(Dialect::Val, "ABS(QSHELL[2]+90.000)", "(QSHELL[2]+90.000)");
    found(Dialect::Val, " > ", " < ");
    found(Dialect::UrScript, " or ", " and ");
    found(Dialect::UrScript, "v=1.047198", "v=1.047198, r=0.01");
    found(Dialect::UrScript, "blocking=True", "blocking=False");
    found(Dialect::Krl, "PTP $AXIS_ACT\r\n", "");
    found(Dialect::Krl, "}", "} C_PTP");
    found(Dialect::Krl, "IF ATSTART", "IF NOT ATSTART");
    found(Dialect::Rapid, ",fine,", ",z10,");
    found(Dialect::Rapid, "vbb\\T:=seconds", "v50");
    found(Dialect::Rapid, "IF NOT", "IF");
    found(Dialect::Rapid, "\r\n", "\n");
    found(Dialect::FanucLs, "FINE", "CNT100");
    found(Dialect::FanucLs, "<(-0.5)", "<0.5");
    found(Dialect::FanucLs, "UT : 1", "UT : 2");
    found(Dialect::FanucLs, "J3=   180.000", "J3=    90.000");
}

#[test]
fn no_step_of_a_rapid_program_is_gone_to_from_elsewhere() {
    // As when somebody puts the program pointer into the middle of the routine.
    let program = program(&SIX);
    let [file] = &files(Dialect::Rapid, &program)[..] else { panic!("one file") };
    let begin = file.text.find("    TPWrite").expect("a message");
    let third = file.text.find("    bbgo jbb2,jbb3").expect("a third step");
    let middle = ProgramFile { text: format!("{}{}", &file.text[..begin], &file.text[third..]), ..file.clone() };
    for (at, moves) in [(0, 0), (1, 1), (2, 0)] {
        let mut machine = Machine::at(expected_axes(Dialect::Rapid, &program, &program.steps[at]));
        run(Dialect::Rapid, std::slice::from_ref(&middle), &mut machine).unwrap();
        let found = machine.events.iter().filter(|event| matches!(event, Event::Move { .. })).count();
        assert_eq!(found, moves, "from step {at}");
    }
}

#[test]
fn names_that_are_there_twice_are_found() {
    let two = [program(&SIX), Program { name: "SHELL".into(), ..program(&SIX) }];
    for dialect in Dialect::ALL {
        let names: Vec<String> = two.iter().flat_map(|program| global_names(dialect, &files(dialect, program))).collect();
        assert!(doubles(&names).contains(&"SHELL".to_owned()), "{dialect}: {names:?}");
    }
    // As the programs were that this replaces: points of the same names in each.
    let old = |name: &str| ProgramFile {
        name: format!("{name}.PG"),
        text: format!(".PROGRAM {name}()\n  SPEED 25 ALWAYS\n  MOVE #P1\n  BREAK\n.END\n"),
    };
    let names: Vec<String> = ["TO01", "BAR01"].iter().flat_map(|name| global_names(Dialect::Val, &[old(name)])).collect();
    assert_eq!(doubles(&names), ["#P1"]);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(60) })]

    #[test]
    fn any_program_does_what_it_should(
        rows in prop::collection::vec((prop::array::uniform6(-400.0..400.0_f64), any::<bool>(), ".{0,60}"), 1..8),
        stand_s in 0..3000_u32,
        speed_deg_s in 10.0..200.0_f64,
        words in ".{0,60}",
        j23 in -1..=1_i8,
    ) {
        let steps = rows.iter().map(|(values, is_measured, comment)| ProgramStep {
            q: joint_vector(values, &SIX), is_measured: *is_measured, comment: comment.clone(),
        });
        let program = Program {
            steps: steps.collect(),
            speed: JointSpeed { revolute_rad_s: speed_deg_s.to_radians(), prismatic_m_s: 0.1 },
            stand_s: f64::from(stand_s) * 0.1,
            before: format!("bar ON: {}", words.split_whitespace().map(|word| word.chars().take(20).collect::<String>()).collect::<Vec<_>>().join(" ")),
            setup: ControllerSetup { j23: Some(j23), ..ControllerSetup::default() },
            ..program(&SIX)
        };
        for dialect in Dialect::ALL {
            check(dialect, &program);
        }
    }
}

#[test]
fn no_text_can_become_an_instruction() {
    let hostile = "x\nMOVE #P2\r\n/END ;}\"]\u{2028}end\u{0}";
    let mut program = program(&SIX);
    program.steps[0].comment = hostile.into();
    program.before = format!("bar ON: {hostile}");
    program.after = hostile.into();
    for dialect in Dialect::ALL {
        check(dialect, &program);
        for file in files(dialect, &program) {
            assert!(file.text.bytes().all(|byte| b"\r\n\t".contains(&byte) || (b' '..=b'~').contains(&byte)), "{dialect}");
        }
    }
}
