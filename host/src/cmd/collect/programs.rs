//! A plan as programs of a controller: for each shell one that brings the robot there, without the bar, and one that measures.

use std::path::Path;

use super::session_files::SessionFiles;
use crate::cmd::outcome::CommandError;
use crate::cmd::report::write_file;
use crate::collect::{ShellPrograms, shells};
use crate::files::{PlanRow, RowKind};
use crate::plan::CheckedPlan;
use crate::robot_link::JointSpeed;
use crate::robot_link::program::{Dialect, Program, ProgramStep, write_program};

/// Folder in a session.
const FOLDER: &str = "programs";

/// Writes the programs of all shells into the session; their names, in the order of the plan.
pub(super) fn write_programs(
    session: &Path,
    files: &SessionFiles,
    plan: &CheckedPlan<'_>,
    dialect: Dialect,
    speed: JointSpeed,
    stand_s: f64,
) -> Result<Vec<ShellPrograms>, CommandError> {
    let kinds = files.robot.chain.joint_kinds();
    let program = |name: String, rows: &[PlanRow]| -> Result<(String, Vec<(String, String)>), CommandError> {
        let steps = rows.iter().map(|row| step(row, files)).collect();
        let program = Program { name, kinds: kinds.to_vec(), steps, speed, stand_s };
        let texts: Vec<_> = write_program(dialect, &program)?.into_iter().map(|file| (file.name, file.text)).collect();
        Ok((texts.first().map_or_else(String::new, |(name, _)| name.clone()), texts))
    };
    let mut written = Vec::new();
    let mut names = Vec::new();
    for (number, shell) in (1..).zip(shells(plan.rows())) {
        let rows = &plan.rows()[shell];
        let first = rows.iter().position(|row| row.bar.is_some()).unwrap_or(0);
        let without_measuring: Vec<PlanRow> =
            rows[..=first].iter().map(|row| PlanRow { kind: RowKind::Via, ..row.clone() }).collect();
        let (approach, approach_files) = program(format!("TO{number:02}"), &without_measuring)?;
        let (measure, measure_files) = program(format!("BAR{number:02}"), &rows[first..])?;
        written.extend(approach_files.into_iter().chain(measure_files));
        names.push(ShellPrograms { approach, measure });
    }
    let folder = session.join(FOLDER);
    std::fs::create_dir_all(&folder)
        .map_err(|error| CommandError::output(super::FolderError { folder: folder.clone(), error }))?;
    for (name, text) in &written {
        write_file(&folder.join(name), text)?;
    }
    Ok(names)
}

fn step(row: &PlanRow, files: &SessionFiles) -> ProgramStep {
    let comment = format!("line {}, {}", row.line, files.rig.pairing_name(row.pairing));
    ProgramStep { q: row.q, is_measured: row.kind == RowKind::Measure, comment }
}
