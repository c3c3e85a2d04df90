//! Whether a program does what it was written for, from its first pose, and nothing from elsewhere.

use std::collections::BTreeMap;

use ballbar::JointKind;
use host_cal::robot_link::program::{Dialect, Program, ProgramFile, ProgramStep};

use super::machine::Speed;
use super::{Axis, Complaint, Event, Machine, run};

/// How far the joints may be from the first pose, as the documents have it.
const START_DEG: f64 = 0.5;
const START_MM: f64 = 1.0;
const AWAY: &str = "NOT AT THE FIRST POSE: nothing is moved";

/// Half of the last digit that a language's goals have, and what a second one would be found by.
fn resolution_deg(dialect: Dialect) -> (f64, f64) {
    let half = match dialect {
        Dialect::Val | Dialect::FanucLs => 0.5e-3,
        Dialect::Krl | Dialect::Rapid => 0.5e-5,
        Dialect::UrScript => 0.5e-8_f64.to_degrees(),
    };
    (half * (1.0 + 1e-6), 4.0 * half)
}

/// A step as the controller counts it: degrees, millimetres.
pub(crate) fn expected_axes(dialect: Dialect, program: &Program, step: &ProgramStep) -> BTreeMap<Axis, f64> {
    let rails = program.kinds.iter().take_while(|kind| **kind == JointKind::Prismatic).count();
    let mut axes = BTreeMap::new();
    for (joint, (kind, q)) in program.kinds.iter().zip(step.q.as_array()).enumerate() {
        let value = if *kind == JointKind::Revolute { q.to_degrees() } else { q * 1e3 };
        let axis = match joint {
            joint if joint < rails => Axis::External(1 + joint),
            joint if joint < rails + 6 => Axis::Arm(1 + joint - rails),
            joint => Axis::External(joint - 5),
        };
        axes.insert(axis, value);
    }
    if let (Dialect::FanucLs, Some(j23), Some(q2)) = (dialect, program.setup.j23, axes.get(&Axis::Arm(2)).copied()) {
        *axes.get_mut(&Axis::Arm(3)).expect("an arm of three axes") += f64::from(j23) * q2;
    }
    axes
}

fn kind_of(program: &Program, axis: Axis) -> JointKind {
    let rails = program.kinds.iter().take_while(|kind| **kind == JointKind::Prismatic).count();
    match axis {
        Axis::Arm(number) => program.kinds[rails + number - 1],
        Axis::External(number) if number <= rails => program.kinds[number - 1],
        Axis::External(number) => program.kinds[number + 5],
    }
}

fn expected_speed(dialect: Dialect, program: &Program, index: usize) -> Speed {
    let (deg_s, mm_s) = (program.speed.revolute_rad_s.to_degrees(), program.speed.prismatic_m_s * 1e3);
    let full_deg_s = match dialect {
        Dialect::Val => 240.0,
        Dialect::Krl => 600.0,
        _ => 1000.0,
    };
    let full_deg_s = program.setup.fastest_rad_s.map_or(full_deg_s, f64::to_degrees);
    let percent = |axis: Axis| {
        let share = if kind_of(program, axis) == JointKind::Revolute { deg_s / full_deg_s } else { mm_s / 2500.0 };
        ((100.0 * share + 1e-6).floor() as usize).min(100)
    };
    let axes = expected_axes(dialect, program, &program.steps[index]);
    let percents: BTreeMap<Axis, usize> = axes.keys().map(|axis| (*axis, percent(*axis))).collect();
    match dialect {
        Dialect::Krl => Speed::Percent(percents),
        // One for all.
        Dialect::Val | Dialect::FanucLs => {
            let least = percents.values().copied().min().expect("an axis");
            Speed::Percent(percents.into_keys().map(|axis| (axis, least)).collect())
        }
        Dialect::UrScript => Speed::Leading { rad_s: program.speed.revolute_rad_s, rad_s2: 1.4 },
        Dialect::Rapid => {
            let before = expected_axes(dialect, program, &program.steps[index.saturating_sub(1)]);
            let alone_s = |axis: &Axis| {
                let (speed, tolerance) = match kind_of(program, *axis) {
                    JointKind::Revolute => (deg_s, START_DEG),
                    JointKind::Prismatic => (mm_s, START_MM),
                };
                let way = if index == 0 { tolerance } else { (axes[axis] - before[axis]).abs() };
                1.5 * way / speed
            };
            Speed::Seconds(axes.keys().map(alone_s).fold(if index == 0 { 2.0 } else { 0.1 }, f64::max))
        }
    }
}

fn expected_setup(dialect: Dialect, program: &Program) -> String {
    let tool = program.setup.tool.as_deref();
    match dialect {
        Dialect::Val | Dialect::UrScript => String::new(),
        Dialect::Krl => {
            let tool = tool.unwrap_or("1");
            let mut settings = BTreeMap::from([
                ("init".to_owned(), String::new()),
                ("$ADVANCE".into(), "0".into()),
                ("$BASE".into(), "$NULLFRAME".into()),
                ("$TOOL".into(), format!("TOOL_DATA[{tool}]")),
                ("$LOAD".into(), format!("LOAD_DATA[{tool}]")),
            ]);
            for axis in expected_axes(dialect, program, &program.steps[0]).keys() {
                let name = match axis {
                    Axis::Arm(number) => format!("$ACC_AXIS[{number}]"),
                    Axis::External(number) => format!("$ACC_EXTAX[{number}]"),
                };
                settings.insert(name, "50".into());
            }
            format!("{settings:?}")
        }
        Dialect::Rapid => format!("{} [50,5,50,5]", tool.unwrap_or("tool0")),
        Dialect::FanucLs => {
            let tool = tool.unwrap_or("1");
            format!("frame 0, tool {tool}, load Some({tool})")
        }
    }
}

/// What is shown of a text: printable ASCII without what would end it, one space between words.
fn shown(text: &str) -> String {
    let text: String =
        text.chars().map(|c| if c.is_ascii_alphanumeric() || " .,:+-=()/#_".contains(c) { c } else { ' ' }).collect();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Before the moves, at their end, and instead of them.
fn expected_words(dialect: Dialect, program: &Program) -> [String; 3] {
    let (name, key) = match dialect {
        Dialect::Val => (format!("{}: ", program.name.to_uppercase()), "PROCEED"),
        // The popup's title.
        Dialect::UrScript => (String::new(), "Continue"),
        Dialect::Krl => (format!("{}: ", program.name), "start key"),
        Dialect::Rapid => (format!("{}: ", program.name), "start"),
        Dialect::FanucLs => (format!("{}: ", program.name.to_uppercase()), "start"),
    };
    [format!("{name}{}, then {key}", program.before), format!("{name}{}", program.after), format!("{name}{AWAY}")]
        .map(|text| shown(&text))
}

/// Lines that follow one another are one text.
fn merged(events: Vec<Event>) -> Vec<Event> {
    let mut merged: Vec<Event> = Vec::new();
    for event in events {
        match (merged.last_mut(), event) {
            (Some(Event::Say(before)), Event::Say(words)) => *before += &format!(" {words}"),
            (_, event) => merged.push(event),
        }
    }
    merged
}

fn near(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance
}

/// Carries a program out from each of many places.
///
/// # Errors
/// The first thing that is not as it has to be.
pub(crate) fn judge(dialect: Dialect, files: &[ProgramFile], program: &Program) -> Result<(), Complaint> {
    let first = expected_axes(dialect, program, &program.steps[0]);
    let from = |axis: Option<(Axis, f64)>, jog: Option<(Axis, f64)>| -> Result<Vec<Event>, Complaint> {
        let mut machine = Machine::at(first.clone());
        if let Some((axis, by)) = axis {
            *machine.axes.get_mut(&axis).expect("the axis is there") += by;
        }
        machine.jog = jog;
        run(dialect, files, &mut machine)?;
        Ok(merged(machine.events))
    };
    whole(dialect, program, &from(None, None)?)?;
    let (_, more) = resolution_deg(dialect);
    for axis in first.keys() {
        let tolerance = if kind_of(program, *axis) == JointKind::Revolute { START_DEG } else { START_MM };
        for sign in [-1.0, 1.0] {
            let off = |by: f64| Some((*axis, sign * by));
            whole(dialect, program, &from(off(tolerance - more), None)?).map_err(|why| format!("{axis:?} nearly off: {why}"))?;
            for (start, jog) in [(off(tolerance + more), None), (off(30.0), None), (None, off(tolerance + more))] {
                refused(dialect, program, &from(start, jog)?).map_err(|why| format!("{axis:?} off: {why}"))?;
            }
        }
    }
    Ok(())
}

/// All of the program was carried out.
fn whole(dialect: Dialect, program: &Program, events: &[Event]) -> Result<(), Complaint> {
    let (half_deg, _) = resolution_deg(dialect);
    let [before, after, _] = expected_words(dialect, program);
    let mut events = events.iter();
    let mut next = || events.next().ok_or("the program ends too early");
    let is_shown = |event: &Event, words: &str| *event == Event::Say(words.to_owned());
    if !is_shown(next()?, &before) || *next()? != Event::Pause {
        return Err("the operator is not asked".into());
    }
    for (index, step) in program.steps.iter().enumerate() {
        let mut event = next()?;
        // A part of a Fanuc program begins where the one before ends.
        if let (Event::Move { to, .. }, Some(last)) =
            (event, index.checked_sub(1).filter(|_| dialect == Dialect::FanucLs && index % 998 == 0))
        {
            let last = expected_axes(dialect, program, &program.steps[last]);
            if !to.iter().all(|(axis, value)| near(*value, last[axis], half_deg)) {
                return Err("a part begins elsewhere".into());
            }
            event = next()?;
        }
        let Event::Move { to, speed, setup } = event else { return Err(format!("no move but {event:?}")) };
        let goal = expected_axes(dialect, program, step);
        if let Some((axis, value)) = to.iter().find(|(axis, value)| !near(**value, goal[axis], half_deg)) {
            return Err(format!("step {index}: {axis:?} to {value} and not {}", goal[axis]));
        }
        let is_as_asked = match (speed, expected_speed(dialect, program, index)) {
            (Speed::Percent(found), Speed::Percent(expected)) => {
                *found == expected && expected.values().all(|percent| *percent > 0)
            }
            (Speed::Leading { rad_s, rad_s2 }, Speed::Leading { rad_s: v, rad_s2: a }) => {
                near(*rad_s, v, 0.6e-6) && near(*rad_s2, a, 1e-9)
            }
            // Rounded up to hundredths.
            (Speed::Seconds(found), Speed::Seconds(expected)) => (expected - 1e-6..expected + 0.010_001).contains(found),
            _ => false,
        };
        if !is_as_asked {
            return Err(format!("step {index}: {speed:?} and not {:?}", expected_speed(dialect, program, index)));
        }
        if *setup != expected_setup(dialect, program) {
            return Err(format!("step {index}: {setup} and not {}", expected_setup(dialect, program)));
        }
        if step.is_measured {
            match next()? {
                Event::Stand(seconds) if near(*seconds, program.stand_s, 1e-9) => {}
                other => return Err(format!("step {index}: {other:?} where the robot stands")),
            }
        }
    }
    if !is_shown(next()?, &after) {
        return Err("the operator is not told what to do with the bar".into());
    }
    match events.collect::<Vec<_>>()[..] {
        [] => Ok(()),
        [Event::Pause] if dialect == Dialect::UrScript => Ok(()),
        ref more => Err(format!("more than there should be: {more:?}")),
    }
}

/// The operator was told, and nothing has moved.
fn refused(dialect: Dialect, program: &Program, events: &[Event]) -> Result<(), Complaint> {
    let [before, _, away] = expected_words(dialect, program).map(Event::Say);
    let mut events = events.to_vec();
    if matches!(dialect, Dialect::UrScript | Dialect::Krl) && events.pop() != Some(Event::Pause) {
        return Err("the message does not stay".into());
    }
    if events == [before, Event::Pause, away] { Ok(()) } else { Err(format!("not refused: {events:?}")) }
}
