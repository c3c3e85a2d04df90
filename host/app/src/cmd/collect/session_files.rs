//! What a collection is made with: its plan, robot and rig, as the session keeps them.

use std::path::{Path, PathBuf};

use ballbar_calib::model::{Rig, Robot};
use ballbar_calib::plan::PlanRow;
use miette::Diagnostic;
use thiserror::Error;

use crate::cmd::outcome::CommandError;
use crate::cmd::report::write_session_file;
use crate::files::{RIGS, ROBOTS, Source, parse_rig, parse_robot, read_plan};
use crate::session::{PLAN_NAME, RIG_NAME, ROBOT_NAME};

/// Plan, robot and rig.
pub(super) struct SessionFiles {
    pub(super) robot: Robot,
    pub(super) rig: Rig,
    pub(super) rows: Vec<PlanRow>,
    /// Files that the session does not hold yet.
    new: Vec<(PathBuf, Source)>,
}

#[derive(Debug, Error, Diagnostic)]
enum SessionFileError {
    #[error("{flag} {given}: the session `{}` was begun with another one", session.display())]
    #[diagnostic(help("Leave {flag} out to go on with {}, or record into another directory.", session.join(name).display()))]
    Other { flag: &'static str, given: String, session: PathBuf, name: &'static str },
    #[error("{flag} is missing, and {} holds no {name}", session.display())]
    #[diagnostic(help("A new session needs --plan, --robot and --rig."))]
    Missing { flag: &'static str, session: PathBuf, name: &'static str },
    #[error("{}: another program has begun this session just now", path.display())]
    #[diagnostic(help("Run the same command again to go on with it."))]
    BegunMeanwhile { path: PathBuf },
    #[error("{}: cannot be made: {error}", path.display())]
    Directory { path: PathBuf, error: std::io::Error },
}

impl SessionFiles {
    /// What the session holds, or, for a new one, what is given.
    pub(super) fn open(
        session: &Path,
        plan: Option<&Path>,
        robot: Option<&str>,
        rig: Option<&str>,
    ) -> Result<Self, CommandError> {
        let plan = plan.map(|path| path.display().to_string());
        let mut new = Vec::new();
        let robot_source = choose(session, "--robot", robot, ROBOT_NAME, &ROBOTS, &mut new)?;
        let rig_source = choose(session, "--rig", rig, RIG_NAME, &RIGS, &mut new)?;
        let plan_source = choose(session, "--plan", plan.as_deref(), PLAN_NAME, &[], &mut new)?;
        let (robot, rig) = (parse_robot(&robot_source)?, parse_rig(&rig_source)?);
        let rows = read_plan(&plan_source, &robot, &rig)?;
        Ok(Self { robot, rig, rows, new })
    }

    /// Copies into the session, which nobody else writes into now, what it does not hold yet.
    pub(super) fn write(&self) -> Result<(), CommandError> {
        for (path, source) in &self.new {
            if path.exists() {
                return Err(SessionFileError::BegunMeanwhile { path: path.clone() }.into());
            }
            if let Some(folder) = path.parent() {
                let failed = |error| CommandError::output(SessionFileError::Directory { path: folder.to_owned(), error });
                std::fs::create_dir_all(folder).map_err(failed)?;
            }
            write_session_file(path, source.text())?;
        }
        Ok(())
    }
}

/// The session's file, which has to be the given one, if both are there.
fn choose(
    session: &Path,
    flag: &'static str,
    given: Option<&str>,
    name: &'static str,
    builtins: &[(&str, &str)],
    new: &mut Vec<(PathBuf, Source)>,
) -> Result<Source, CommandError> {
    let what = name.trim_end_matches(".toml");
    let kept_path = session.join(name);
    let read = |given| match builtins {
        [] => Source::read_rows(Path::new(given)),
        _ => Source::named_or_read(given, builtins, what),
    };
    let given_source = given.map(read).transpose()?;
    let kept = if kept_path.is_file() { Some(Source::read_rows(&kept_path)?) } else { None };
    match (given_source, kept) {
        (Some(given_source), Some(kept)) if given_source.text() != kept.text() => {
            let given = given.unwrap_or_default().to_owned();
            Err(SessionFileError::Other { flag, given, session: session.to_owned(), name }.into())
        }
        (_, Some(kept)) => Ok(kept),
        (Some(source), None) => {
            new.push((kept_path, source.clone()));
            Ok(source)
        }
        (None, None) => Err(SessionFileError::Missing { flag, session: session.to_owned(), name }.into()),
    }
}
