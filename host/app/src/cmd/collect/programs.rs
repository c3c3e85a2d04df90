//! A plan's programs, in the session.

use std::path::Path;

use ballbar_calib::plan::CheckedPlan;

use crate::cmd::outcome::CommandError;
use crate::cmd::report::{make_folder, write_session_file};
use crate::collect::{ProgramOptions, ShellPrograms, plan_programs};
use crate::robot_link::program::{Dialect, Program, ProgramError, ProgramFile, write_program};
use crate::session::PROGRAMS_NAME;

/// The programs of all shells.
pub(super) struct Programs {
    /// In the order of the plan.
    pub(super) names: Vec<ShellPrograms>,
    files: Vec<ProgramFile>,
}

impl Programs {
    pub(super) fn of_plan(plan: &CheckedPlan<'_>, dialect: Dialect, options: &ProgramOptions) -> Result<Self, ProgramError> {
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

    pub(super) fn write(&self, session: &Path) -> Result<(), CommandError> {
        let folder = session.join(PROGRAMS_NAME);
        make_folder(&folder)?;
        for ProgramFile { name, text } in &self.files {
            write_session_file(&folder.join(name), text)?;
        }
        Ok(())
    }
}
