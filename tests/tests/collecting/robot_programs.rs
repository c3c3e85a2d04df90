//! Programs for controllers, carried out by interpreters that know each language's grammar: what moves, from where, how fast, what the
//! operator is told, what a language cannot hold, and that the programs of a plan do not know one another's names.
#![cfg(unix)]

use ballbar::{JointKind, JointVector};
use ballbar_calib::model::{Rig, Robot};
use ballbar_calib::plan::{Cell, CheckedPlan, Margins, Pace};
use ballbar_tests::simulated_cell::{SHORT_PLAN, SimulatedCell, TRAVEL_M, design, plant, rig};
use host_cal::collect::{ProgramOptions, plan_programs};
use host_cal::files::{Source, read_plan};
use host_cal::robot_link::JointSpeed;
use host_cal::robot_link::program::{
    ControllerSetup, Dialect, Program, ProgramError, ProgramFile, ProgramStep, START_TOLERANCE_DEG, START_TOLERANCE_MM,
    write_program,
};
use proptest::prelude::*;

mod interpreters;

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
fn a_rail_is_an_external_axis_in_millimetres() {
    let languages = [Dialect::Krl, Dialect::Rapid, Dialect::FanucLs];
    for kinds in [
        &[P, R, R, R, R, R, R][..],
        &[R, R, R, R, R, R, P],
        &[P, P, R, R, R, R, R, R],
        &[P, R, R, R, R, R, R, R],
        &[P, R, R, R, R, R],
    ] {
        for dialect in languages {
            check(dialect, &program(kinds));
        }
    }
    let rail = program(&[P, R, R, R, R, R, R]);
    let first = |dialect| files(dialect, &rail)[0].text.clone();
    assert!(
        first(Dialect::Krl).contains("PTP {A1 -90.00000,A2 90.00000,A3 0.00000,A4 0.00000,A5 0.00000,A6 100.00000,E1 1.50000}")
    );
    assert!(first(Dialect::Rapid).contains(",100.00000],[1.50000,9E9,9E9,9E9,9E9,9E9]];"));
    assert!(first(Dialect::FanucLs).contains("\tE1=     1.500  mm\n}"), "{}", first(Dialect::FanucLs));
    // A quill stays where it is.
    let no_j23 = ControllerSetup::default();
    for dialect in [Dialect::Krl, Dialect::FanucLs] {
        check(dialect, &Program { setup: no_j23.clone(), ..program(&[R, R, P, R]) });
    }
}

#[test]
fn j3_is_counted_as_it_is_said() {
    for (j23, j3_deg) in [(-1, "180.000"), (0, " 90.000"), (1, "  0.000")] {
        for joints in [3, 5, 6] {
            let kinds = &SIX[..joints];
            let program = Program { setup: ControllerSetup { j23: Some(j23), ..ControllerSetup::default() }, ..program(kinds) };
            check(Dialect::FanucLs, &program);
            let text = &files(Dialect::FanucLs, &program)[0].text;
            assert!(text.contains(&format!("J2=   -90.000 deg,\tJ3=   {j3_deg} deg")), "{j23}: {text}");
        }
    }
    let rail = program(&[P, R, R, R, R, R, R]);
    check(Dialect::FanucLs, &rail);
    let error = |kinds: &[JointKind], j23| {
        let setup = ControllerSetup { j23, ..ControllerSetup::default() };
        write_program(Dialect::FanucLs, &Program { setup, ..program(kinds) }).unwrap_err()
    };
    assert_eq!(error(&SIX, None), ProgramError::J23Missing);
    assert_eq!(error(&SIX[..5], None), ProgramError::J23Missing);
    assert_eq!(error(&SIX, Some(2)), ProgramError::J23Value { found: 2 });
    assert_eq!(error(&[R, R, P, R], Some(1)), ProgramError::J23Needless { found: 1 });
    // None of the others asks.
    for dialect in [Dialect::Val, Dialect::UrScript, Dialect::Krl, Dialect::Rapid] {
        check(dialect, &Program { setup: ControllerSetup::default(), ..program(&SIX) });
    }
}

#[test]
fn tools_are_the_controllers() {
    let with = |tool: &str| Program {
        setup: ControllerSetup { tool: Some(tool.into()), j23: Some(0), ..ControllerSetup::default() },
        ..program(&SIX)
    };
    check(Dialect::Krl, &with("12"));
    check(Dialect::FanucLs, &with("9"));
    check(Dialect::Rapid, &with("tBall_plate"));
    for (dialect, tool) in [
        (Dialect::Val, "1"),
        (Dialect::UrScript, "1"),
        (Dialect::Krl, "0"),
        (Dialect::Krl, "17"),
        (Dialect::Krl, "plate"),
        (Dialect::FanucLs, "10"),
        (Dialect::Rapid, "1"),
        (Dialect::Rapid, "a;Stop"),
        (Dialect::Rapid, "a_name_of_17_char"),
        (Dialect::Rapid, ""),
    ] {
        let error = write_program(dialect, &with(tool)).unwrap_err();
        assert!(matches!(&error, ProgramError::Tool { found, .. } if found == tool), "{dialect} {tool}: {error}");
    }
}

fn cell_of<'a>(robot: &'a Robot, rig: &'a Rig) -> Cell<'a> {
    Cell::new(robot, rig, TRAVEL_M, Margins::default(), Pace::default()).unwrap()
}

#[test]
fn the_programs_of_a_plan_can_all_be_loaded() {
    let (robot, rig) = (design(), rig());
    let rows = read_plan(&Source::new("plan.csv", &SHORT_PLAN), &robot, &rig).unwrap();
    let setup = ControllerSetup { j23: Some(-1), ..ControllerSetup::default() };
    let options = ProgramOptions { speed: JointSpeed::default(), stand_s: 3.0, setup };
    let cell = cell_of(&robot, &rig);
    let shells = plan_programs(&CheckedPlan::new(&cell, &rows).unwrap(), &options);
    assert_eq!(shells.len(), 3);
    // One begins where another ends, the first one at the plan's first row.
    let programs: Vec<&Program> = shells.iter().flat_map(|shell| [&shell.approach, &shell.measure]).collect();
    assert_eq!(programs[0].steps[0].q, rows[0].q);
    for pair in programs.windows(2) {
        assert_eq!(pair[0].steps.last().unwrap().q, pair[1].steps[0].q, "{} and {}", pair[0].name, pair[1].name);
    }
    let measured: Vec<_> =
        programs.iter().flat_map(|program| &program.steps).filter(|step| step.is_measured).map(|step| step.q).collect();
    let planned: Vec<_> = rows.iter().filter(|row| row.kind == ballbar_calib::plan::RowKind::Measure).map(|row| row.q).collect();
    assert_eq!(measured, planned);
    for shell in &shells {
        assert!(shell.approach.steps.iter().all(|step| !step.is_measured) && shell.approach.before.contains("OFF"));
        assert!(shell.approach.after.contains("attach the bar") && shell.measure.before.contains("ON"));
        assert!(shell.measure.after.contains("OFF"));
    }
    for dialect in Dialect::ALL {
        let mut names = Vec::new();
        for program in &programs {
            let files = files(dialect, program);
            judge(dialect, &files, program).unwrap_or_else(|why| panic!("{dialect} {}: {why}", program.name));
            names.extend(global_names(dialect, &files));
            for step in &program.steps {
                let is_within = robot.limits.iter().zip(step.q.as_array()).all(|(limits, q)| limits.contain(*q));
                assert!(is_within, "{}: {:?}", program.name, step.q);
            }
        }
        assert!(names.len() >= 12, "{dialect}: {names:?}");
        assert_eq!(doubles(&names), [""; 0], "{dialect}");
    }
}

/// The programs of the short plan as `collect` writes them, with an operator who leaves when the bar is asked for.
#[test]
fn collect_writes_programs_that_do_what_they_should() {
    let cell = SimulatedCell::start(plant(3), 0.0, &SHORT_PLAN);
    let collect = |dialect: &str, more: &[&str]| {
        let session = format!("session_{dialect}");
        let args = ["collect", "port", "--session", &session, "--plan", "plan.csv", "--robot", "puma560", "--rig", "triangles"];
        let run = cell.host_cal(&[&args[..], &["--robot-link", "file", "--dialect", dialect], more].concat());
        assert!(run.code == 1 && run.stderr.contains("Take off"), "{dialect}: {}", run.transcript());
        let mut files: Vec<ProgramFile> = std::fs::read_dir(cell.path(&session).join("programs"))
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .map(|path| ProgramFile {
                name: path.file_name().unwrap().to_str().unwrap().to_owned(),
                text: std::fs::read_to_string(path).unwrap(),
            })
            .collect();
        files.sort_by_key(|file| file.name.clone());
        files
    };
    let (robot, rig) = (design(), rig());
    let rows = read_plan(&Source::new("plan.csv", &SHORT_PLAN), &robot, &rig).unwrap();
    let cell = cell_of(&robot, &rig);
    let plan = CheckedPlan::new(&cell, &rows).unwrap();
    for (dialect, more, fastest_deg_s) in [
        (Dialect::Val, &["--robot-fastest-deg-s", "300"][..], 300.0),
        (Dialect::Krl, &["--robot-tool", "7", "--robot-fastest-deg-s", "250"], 250.0),
        (Dialect::Rapid, &["--robot-tool", "tPlate"], 0.0),
        (Dialect::FanucLs, &["--robot-tool", "3", "--fanuc-j23", "-1"], 0.0),
        (Dialect::UrScript, &["--speed-deg-s", "30"], 0.0),
    ] {
        let files = collect(dialect.name(), more);
        let tool = more.iter().position(|word| *word == "--robot-tool").map(|at| more[at + 1].to_owned());
        let fastest_rad_s = Some(fastest_deg_s).filter(|deg_s| *deg_s > 0.0).map(f64::to_radians);
        let setup = ControllerSetup { tool, fastest_rad_s, j23: Some(-1) };
        let speed = JointSpeed { revolute_rad_s: 30_f64.to_radians(), prismatic_m_s: 0.1 };
        let options = ProgramOptions { speed, stand_s: 3.0, setup };
        let shells = plan_programs(&plan, &options);
        let programs: Vec<&Program> = shells.iter().flat_map(|shell| [&shell.approach, &shell.measure]).collect();
        assert_eq!(files.len(), programs.len(), "{dialect}");
        for program in programs {
            let file = files.iter().find(|file| file.name.starts_with(&program.name)).unwrap();
            judge(dialect, std::slice::from_ref(file), program).unwrap_or_else(|why| panic!("{dialect} {}: {why}", file.name));
        }
        assert_eq!(doubles(&global_names(dialect, &files)), [""; 0], "{dialect}");
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
fn percentages_never_exceed_the_speed() {
    let slow = Program { speed: JointSpeed { revolute_rad_s: 0.3, prismatic_m_s: 0.1 }, ..program(&SIX) };
    // 0.3 rad/s are 17.2 degrees per second: 7.2 % of 240, 2.9 % of 600, 1.7 % of 1000.
    assert!(files(Dialect::Val, &slow)[0].text.contains("SPEED 7 ALWAYS"));
    assert!(files(Dialect::Krl, &slow)[0].text.contains("$VEL_AXIS[6]=2\r\n"));
    assert!(files(Dialect::FanucLs, &slow)[0].text.contains("J P[1] 1% FINE"));
    // A rail of a tenth of a metre per second, of two and a half, is slower than the arm at 60 of 300 degrees per second.
    let rail = program(&[P, R, R, R, R, R, R]);
    let setup = ControllerSetup { fastest_rad_s: Some(300_f64.to_radians()), ..rail.setup.clone() };
    let rail = Program { setup, speed: JointSpeed { prismatic_m_s: 0.1, ..JointSpeed::default() }, ..rail };
    assert!(files(Dialect::FanucLs, &rail)[0].text.contains("J P[1] 4% FINE"));
    for dialect in [Dialect::Krl, Dialect::FanucLs] {
        check(dialect, &rail);
    }
    // Below one percent a program would be faster than what was asked for.
    for (dialect, deg_s) in [(Dialect::Val, 2.4), (Dialect::Krl, 6.0), (Dialect::FanucLs, 10.0)] {
        let at = |deg_s: f64| Program {
            speed: JointSpeed { revolute_rad_s: deg_s.to_radians(), prismatic_m_s: 0.1 },
            ..program(&SIX)
        };
        check(dialect, &at(deg_s));
        let error = write_program(dialect, &at(deg_s * 0.99)).unwrap_err();
        assert!(matches!(error, ProgramError::Slow { unit: "deg", .. }), "{dialect}: {error}");
    }
}

#[test]
fn a_long_fanuc_program_is_split_and_called() {
    let one = program(&SIX);
    let long = Program { steps: one.steps.iter().cycle().take(2000).cloned().collect(), ..one };
    let files = files(Dialect::FanucLs, &long);
    let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
    assert_eq!(names, ["SHELL.LS", "SHELL01.LS", "SHELL02.LS", "SHELL03.LS"]);
    for file in &files {
        assert!(file.text.matches("\nP[").count() <= 999, "{}", file.name);
    }
    assert_eq!(doubles(&global_names(Dialect::FanucLs, &files)), [""; 0]);
    check(Dialect::FanucLs, &long);
    // A part that is started by itself looks at the joints, too.
    let mut machine = Machine::at(expected_axes(Dialect::FanucLs, &long, &long.steps[0]));
    run(Dialect::FanucLs, &files[2..3], &mut machine).unwrap();
    assert!(machine.events.iter().all(|event| matches!(event, Event::Say(_))), "{:?}", machine.events);
}

#[test]
fn what_a_language_cannot_hold_is_refused() {
    let six = program(&SIX);
    let error = |dialect, program: &Program| write_program(dialect, program).unwrap_err();

    for (dialect, joints) in [(Dialect::Val, 7), (Dialect::UrScript, 7), (Dialect::UrScript, 5), (Dialect::Krl, 0)] {
        let found = error(dialect, &program(&[R; 8][..joints]));
        assert!(matches!(found, ProgramError::Joints { found, .. } if found == joints), "{dialect}: {found}");
    }
    let stanford = program(&[R, R, P, R, R, R]);
    for dialect in [Dialect::Val, Dialect::UrScript, Dialect::Rapid] {
        assert_eq!(error(dialect, &stanford), ProgramError::Prismatic { dialect, joint: 3 });
    }
    for dialect in [Dialect::Val, Dialect::UrScript] {
        assert_eq!(error(dialect, &program(&[P, R, R, R, R, R])), ProgramError::Prismatic { dialect, joint: 1 });
    }
    for dialect in [Dialect::Krl, Dialect::Rapid, Dialect::FanucLs] {
        assert_eq!(error(dialect, &program(&[P, P])), ProgramError::Prismatic { dialect, joint: 1 }, "rails alone");
    }
    let found = error(Dialect::FanucLs, &program(&[P, P, P, P, R, R]));
    assert_eq!(found, ProgramError::External { dialect: Dialect::FanucLs, found: 4, at_most: 3 });
    for (dialect, name) in [
        (Dialect::Val, "shells"),
        (Dialect::Val, "a_b"),
        (Dialect::Rapid, "name_of_9"),
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
        for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let speed = JointSpeed { revolute_rad_s: value, ..JointSpeed::default() };
            assert_eq!(error(dialect, &Program { speed, ..six.clone() }), ProgramError::Speed);
            let setup = ControllerSetup { fastest_rad_s: Some(value), ..six.setup.clone() };
            assert_eq!(error(dialect, &Program { setup, ..six.clone() }), ProgramError::Speed);
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
