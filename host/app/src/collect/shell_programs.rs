//! A plan as programs of a controller: for each shell one that brings the robot there, without the bar, and one that measures. Their
//! files are kept in the session.

use ballbar_calib::plan::{CheckedPlan, PlanRow, RowKind};

use super::follow::ShellPrograms;
use super::ledger::shells;
use crate::files::{FilesError, make_folder, write_atomically};
use crate::robot_link::JointSpeed;
use crate::robot_link::program::{ControllerSetup, Dialect, Program, ProgramError, ProgramFile, ProgramStep, write_program};
use crate::session::{Connection, PROGRAMS_NAME, SessionLock};

/// How a plan's programs go over its rows.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgramOptions {
    /// No joint is faster.
    pub speed: JointSpeed,
    /// How long the robot stands at a measured row, seconds.
    pub stand_s: f64,
    /// Of the controller.
    pub setup: ControllerSetup,
}

/// The two programs of a shell.
#[derive(Clone, Debug, PartialEq)]
pub struct ShellProgram {
    /// `TOnn`: from where the shell before ends to where the bar is attached.
    pub approach: Program,
    /// `BARnn`: from there over the shell.
    pub measure: Program,
}

/// The programs of all shells of a plan, in its order. Each begins where the one before it ends.
pub fn plan_programs(plan: &CheckedPlan<'_>, options: &ProgramOptions) -> Vec<ShellProgram> {
    let (rows, rig, kinds) = (plan.rows(), plan.cell().rig, plan.cell().robot.chain.joint_kinds());
    let program = |name: String, steps, before, after| {
        let ProgramOptions { speed, stand_s, setup } = options.clone();
        Program { name, kinds: kinds.to_vec(), steps, speed, stand_s, before, after, setup }
    };
    let step = |row: &PlanRow| ProgramStep {
        q: row.q,
        is_measured: row.kind == RowKind::Measure,
        comment: format!("line {}, {}", row.line, rig.pairing_name(row.pairing)),
    };
    let on_the_way = |row: &PlanRow| ProgramStep { is_measured: false, ..step(row) };
    let shell_program = |(number, shell): (usize, std::ops::Range<usize>)| {
        let attached = shell.clone().find(|&row| rows[row].bar.is_some()).unwrap_or(shell.start);
        let way = &rows[shell.start.saturating_sub(1)..=attached];
        let PlanRow { pairing, bar_m, .. } = rows[attached];
        let (chuck, sphere) = (rig.chucks[pairing.chuck].name.clone(), rig.spheres[pairing.sphere].name.clone());
        let bar = Connection { chuck, sphere, bar_m };
        let (to, over) = (format!("TO{number:02}"), format!("BAR{number:02}"));
        ShellProgram {
            approach: program(
                to,
                way.iter().map(on_the_way).collect(),
                "take the bar OFF".into(),
                format!("attach the bar {bar}, next is {over}"),
            ),
            measure: program(
                over,
                rows[attached..shell.end].iter().map(step).collect(),
                format!("the bar has to be ON: {bar}"),
                "all poses done, take the bar OFF".into(),
            ),
        }
    };
    (1..).zip(shells(rows)).map(shell_program).collect()
}

/// The programs of all shells of a plan in a controller's language.
pub struct Programs {
    /// What they are called, in the order of the plan.
    pub names: Vec<ShellPrograms>,
    files: Vec<ProgramFile>,
}

impl Programs {
    /// Writes nothing yet.
    ///
    /// # Errors
    /// [`ProgramError`] where the language cannot hold one of them.
    pub fn of_plan(plan: &CheckedPlan<'_>, dialect: Dialect, options: &ProgramOptions) -> Result<Self, ProgramError> {
        let mut files = Vec::new();
        let mut text = |program: &Program| -> Result<String, ProgramError> {
            let written = write_program(dialect, program)?;
            let first = written.first().map_or_else(String::new, |file| file.name.clone());
            files.extend(written);
            Ok(first)
        };
        let mut names = Vec::new();
        for shell in plan_programs(plan, options) {
            names.push(ShellPrograms { approach: text(&shell.approach)?, measure: text(&shell.measure)? });
        }
        Ok(Self { names, files })
    }

    /// Writes them into the session's folder of programs, which is made where it is missing.
    ///
    /// # Errors
    /// [`FilesError`].
    pub fn write(&self, lock: &SessionLock) -> Result<(), FilesError> {
        let folder = lock.session().join(PROGRAMS_NAME);
        make_folder(&folder)?;
        for ProgramFile { name, text } in &self.files {
            write_atomically(&folder.join(name), text)?;
        }
        Ok(())
    }
}
