//! What the languages have of their own: external axes, counting of J3, tools, percentages, sizes, and what they cannot hold.

use ballbar::JointKind;
use host_cal::robot_link::JointSpeed;
use host_cal::robot_link::program::{ControllerSetup, Dialect, Program, ProgramError, write_program};

use super::interpreters::{Event, Machine, doubles, expected_axes, global_names, run};
use super::{P, R, SIX, check, files, program};

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
