//! The programs of a plan: all can be loaded beside one another, and `collect` writes them.

use ballbar_calib::model::{Rig, Robot};
use ballbar_calib::plan::{Cell, CheckedPlan, Margins, Pace};
use ballbar_tests::simulated_cell::{SHORT_PLAN, SimulatedCell, TRAVEL_M, design, plant, rig};
use host_cal::collect::{ProgramOptions, plan_programs};
use host_cal::files::{Source, read_plan};
use host_cal::robot_link::JointSpeed;
use host_cal::robot_link::program::{ControllerSetup, Dialect, Program, ProgramFile};

use super::files;
use super::interpreters::{doubles, global_names, judge};

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
