//! Small readers of the five languages: they accept what a program of moves may contain by the language's grammar, and nothing else.

use std::collections::BTreeMap;

use host_cal::robot_link::program::{Dialect, ProgramFile};

/// A step as a controller would carry it out.
#[derive(Debug)]
pub(crate) struct Read {
    /// Degrees and millimetres.
    pub(crate) values: Vec<f64>,
    /// How long the robot stands after the move, if it is told to.
    pub(crate) stand_s: Option<f64>,
}

pub(crate) fn read(dialect: Dialect, files: &[ProgramFile]) -> Vec<Read> {
    match dialect {
        Dialect::Val => val(&files[0]),
        Dialect::UrScript => urscript(&files[0]),
        Dialect::Krl => krl(&files[0], &files[1]),
        Dialect::Rapid => rapid(&files[0]),
        Dialect::FanucLs => fanuc(files),
    }
}

fn number(text: &str) -> f64 {
    let text = text.trim();
    assert!(text.bytes().all(|byte| byte.is_ascii_digit() || b"+-.".contains(&byte)), "no plain number: `{text}`");
    text.parse().unwrap_or_else(|_| panic!("no number: `{text}`"))
}

fn whole(text: &str, least: u32, most: u32) -> u32 {
    let value = text.parse().unwrap_or_else(|_| panic!("no whole number: `{text}`"));
    assert!((least..=most).contains(&value), "{value} is out of {least}..={most}");
    value
}

fn between<'a>(text: &'a str, begin: &str, end: &str) -> Option<&'a str> {
    text.strip_prefix(begin)?.strip_suffix(end)
}

fn stem<'a>(file: &'a ProgramFile, extension: &str) -> &'a str {
    file.name.strip_suffix(extension).unwrap_or_else(|| panic!("{} does not end with {extension}", file.name))
}

fn stand(steps: &mut [Read], seconds: &str) {
    let step = steps.last_mut().expect("a wait after a move");
    assert!(step.stand_s.replace(number(seconds)).is_none(), "two waits after a move");
}

fn val(file: &ProgramFile) -> Vec<Read> {
    assert!(file.text.lines().all(|line| line.len() <= 80), "a line is longer than a terminal's");
    let (program, locations) = file.text.split_once(".LOCATIONS\n").expect("locations");
    let mut points = BTreeMap::new();
    let mut rows = locations.lines();
    for row in rows.by_ref().take_while(|row| *row != ".END") {
        let (name, values) = row.split_once(' ').expect("a name and values");
        assert!(name.starts_with("#P") && name.len() <= 6, "{name}");
        assert!(points.insert(name, values.split(' ').map(number).collect::<Vec<_>>()).is_none(), "{name} twice");
    }
    assert_eq!(rows.next(), None);
    let mut lines = program.lines().filter(|line| !line.starts_with(';'));
    assert_eq!(lines.next(), Some(format!(".PROGRAM {}()", stem(file, ".LC")).as_str()));
    let speed = lines.next().and_then(|line| between(line, "  SPEED ", " ALWAYS")).expect("a speed");
    whole(speed, 1, 100);
    assert_eq!(lines.next(), Some("  FINE ALWAYS"));
    let mut steps: Vec<Read> = Vec::new();
    while let Some(line) = lines.next() {
        if let Some(name) = line.strip_prefix("  MOVE ") {
            assert_eq!(lines.next(), Some("  BREAK"), "a move that is blended");
            steps.push(Read { values: points.remove(name).expect("a point once"), stand_s: None });
        } else if let Some(seconds) = line.strip_prefix("  DELAY ") {
            stand(&mut steps, seconds);
        } else {
            assert_eq!(line, ".END");
            assert_eq!(lines.next(), None);
        }
    }
    assert!(points.is_empty());
    steps
}

fn urscript(file: &ProgramFile) -> Vec<Read> {
    let mut lines = file.text.lines();
    assert_eq!(lines.next(), Some(format!("def {}():", stem(file, ".script")).as_str()));
    let mut steps: Vec<Read> = Vec::new();
    for line in lines.by_ref().take_while(|line| *line != "end") {
        let line = line.strip_prefix("  ").expect("an indented line");
        if let Some(arguments) = between(line, "movej([", ")") {
            let (joints, rest) = arguments.split_once("], a=").expect("joints and an acceleration");
            let (a, v) = rest.split_once(", v=").expect("a speed");
            assert!(number(a) > 0.0 && number(v) > 0.0);
            let values: Vec<f64> = joints.split(", ").map(|value| number(value).to_degrees()).collect();
            assert_eq!(values.len(), 6);
            steps.push(Read { values, stand_s: None });
        } else if let Some(seconds) = between(line, "sleep(", ")") {
            stand(&mut steps, seconds);
        } else {
            assert!(line.starts_with("# "), "{line}");
        }
    }
    assert_eq!(lines.next(), None);
    steps
}

fn krl(source: &ProgramFile, data: &ProgramFile) -> Vec<Read> {
    let name = stem(source, ".src");
    assert_eq!(stem(data, ".dat"), name);
    let head = "&ACCESS RVP\n&REL 1\n";
    let body = between(&data.text, &format!("{head}DEFDAT {name}\n"), "ENDDAT\n").expect("a data list");
    let mut points = BTreeMap::new();
    for line in body.lines() {
        let (point, axes) = between(line, "DECL E6AXIS ", "}").and_then(|rest| rest.split_once("={")).expect("a position");
        let values = axes.split(',').enumerate().map(|(index, axis)| {
            let (axis, value) = axis.split_once(' ').expect("an axis and its value");
            assert_eq!(axis, if index < 6 { format!("A{}", index + 1) } else { format!("E{}", index - 5) });
            number(value)
        });
        assert!(points.insert(point, values.collect::<Vec<_>>()).is_none());
    }
    let body = between(&source.text, &format!("{head}DEF {name}( )\n"), "END\n").expect("a program");
    let mut lines = body.lines().filter(|line| !line.starts_with(';'));
    assert_eq!(lines.next(), Some("BAS(#INITMOV,0)"));
    assert_eq!(lines.next(), Some("$ADVANCE=0"));
    let mut steps: Vec<Read> = Vec::new();
    for line in lines {
        if let Some(point) = line.strip_prefix("PTP ") {
            steps.push(Read { values: points.remove(point).expect("a position once, not approximated"), stand_s: None });
        } else if let Some(seconds) = line.strip_prefix("WAIT SEC ") {
            stand(&mut steps, seconds);
        } else {
            let (variable, value) = line.split_once("]=").expect("an assignment");
            let known = ["$VEL_AXIS[", "$ACC_AXIS[", "$VEL_EXTAX[", "$ACC_EXTAX["];
            let axis = known.iter().find_map(|known| variable.strip_prefix(known)).expect("a known variable");
            whole(axis, 1, 6);
            whole(value, 1, 100);
            assert!(steps.is_empty());
        }
    }
    assert!(points.is_empty());
    steps
}

fn rapid(file: &ProgramFile) -> Vec<Read> {
    let name = stem(file, ".mod");
    let body = between(&file.text, &format!("MODULE {name}\n"), "  ENDPROC\nENDMODULE\n").expect("a module");
    let (declarations, routine) = body.split_once(&format!("  PROC {name}_run()\n")).expect("a routine");
    assert!(name.len() + "_run".len() <= 16, "a name longer than sixteen characters");
    let mut targets = BTreeMap::new();
    for line in declarations.lines().filter(|line| !line.starts_with("  ! ")) {
        let (target, value) = between(line, "  CONST jointtarget ", "]];").and_then(|rest| rest.split_once(":=[[")).unwrap();
        let (robot, external) = value.split_once("],[").expect("robot and external axes");
        let robot: Vec<f64> = robot.split(',').map(number).collect();
        let external: Vec<&str> = external.split(',').collect();
        assert_eq!([robot.len(), external.len()], [6, 6]);
        let external = external.into_iter().filter(|value| *value != "9E9").map(number);
        assert!(targets.insert(target, robot.into_iter().chain(external).collect::<Vec<_>>()).is_none());
    }
    let mut steps: Vec<Read> = Vec::new();
    for line in routine.lines().map(|line| line.strip_prefix("    ").expect("an indented line")) {
        if let Some(arguments) = between(line, "MoveAbsJ ", ";") {
            let [target, speed, zone, tool] = arguments.split(',').collect::<Vec<_>>()[..] else { panic!("{line}") };
            assert_eq!([zone, tool], ["fine", "tool0"]);
            match speed.strip_prefix("v1000\\T:=") {
                Some(seconds) => assert!(number(seconds) >= 0.1),
                None => assert_eq!((speed, steps.len()), ("v50", 0), "only the first has no time"),
            }
            let target = target.strip_suffix("\\NoEOffs").expect("no offsets");
            steps.push(Read { values: targets.remove(target).expect("a target once"), stand_s: None });
        } else if let Some(seconds) = between(line, "WaitTime\\InPos,", ";") {
            stand(&mut steps, seconds);
        } else {
            assert!(line.starts_with("! ") && line.len() <= 80, "{line}");
        }
    }
    assert!(targets.is_empty());
    steps
}

fn fanuc(files: &[ProgramFile]) -> Vec<Read> {
    if files.len() == 1 {
        return fanuc_part(&files[0]);
    }
    let (main, parts) = files.split_first().unwrap();
    let calls: Vec<&str> = main.text.lines().filter_map(|line| between(line.get(7..)?, "CALL ", "    ;")).collect();
    assert_eq!(calls, parts.iter().map(|part| stem(part, ".LS")).collect::<Vec<_>>());
    parts.iter().flat_map(fanuc_part).collect()
}

fn fanuc_part(file: &ProgramFile) -> Vec<Read> {
    let name = stem(file, ".LS");
    assert!(name.len() <= 8);
    let body = between(&file.text, &format!("/PROG  {name}\n/ATTR\n"), "/END\n").expect("a program");
    let (attributes, rest) = body.split_once("/MN\n").expect("attributes");
    let (instructions, positions) = rest.split_once("/POS\n").expect("positions");
    assert!(attributes.ends_with("CONTROL_CODE\t= 00000000 00000000;\n"));
    let count = attributes.lines().find_map(|line| between(line, "LINE_COUNT\t= ", ";")).expect("a line count");
    assert_eq!(count, instructions.lines().count().to_string());
    let is_linked = instructions.contains("!J3 is q3-q2");
    let mut points = BTreeMap::new();
    for entry in positions.split_terminator("};\n") {
        let (number_, axes) = entry
            .strip_prefix("P[")
            .and_then(|entry| entry.split_once("]{\n   GP1:\n\tUF : 0, UT : 1,\t\n"))
            .expect("a position");
        let mut values = Vec::new();
        for (index, axis) in axes.split(',').enumerate() {
            let axis = axis.trim();
            let label = if index < 6 { format!("J{}", index + 1) } else { format!("E{}", index - 5) };
            let value = axis.strip_prefix(&format!("{label}=")).unwrap_or_else(|| panic!("{axis} for {label}"));
            let value = value.strip_suffix(" deg").or_else(|| value.strip_suffix("  mm")).expect("a unit");
            values.push(number(value));
        }
        if is_linked {
            values[2] += values[1];
        }
        assert!(points.insert(number_.to_owned(), values).is_none());
    }
    let mut steps: Vec<Read> = Vec::new();
    for (index, line) in instructions.lines().enumerate() {
        let (line_number, line) = line.split_at(5);
        assert_eq!(line_number, format!("{:4}:", index + 1));
        if let Some(motion) = between(line, "J P[", " FINE    ;") {
            let (point, speed) = motion.split_once("] ").expect("a position and a speed");
            match speed.strip_suffix("sec") {
                Some(seconds) => assert!((0.1..=3200.0).contains(&number(seconds))),
                None => assert!((1..=100).contains(&whole(speed.strip_suffix('%').expect("percent"), 1, 100))),
            }
            steps.push(Read { values: points.remove(point).expect("a position once"), stand_s: None });
        } else if let Some(seconds) = between(line, "  WAIT ", "(sec) ;") {
            stand(&mut steps, seconds);
        } else if let Some(remark) = between(line, "  !", " ;") {
            assert!(remark.len() <= 32 && !remark.contains(';'), "{remark}");
        } else {
            assert!(["  UFRAME_NUM=0 ;", "  UTOOL_NUM=1 ;"].contains(&line), "{line}");
        }
    }
    assert!(points.is_empty());
    steps
}
