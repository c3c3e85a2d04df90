//! What a collection is made with: its plan, robot and rig, as the session keeps them.

use std::path::{Path, PathBuf};

use ballbar_calib::model::{Rig, Robot};
use ballbar_calib::plan::PlanRow;
use thiserror::Error;

use super::lock::SessionLock;
use super::{PLAN_NAME, RIG_NAME, ROBOT_NAME};
use crate::files::{InputError, RIGS, ROBOTS, Source, WriteError, parse_rig, parse_robot, read_plan, write_atomically};

/// A file that a session keeps a copy of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SessionFile {
    /// The plan that is walked.
    Plan,
    /// The robot that it was made for.
    Robot,
    /// The rig.
    Rig,
}

impl SessionFile {
    /// Its name in the session.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plan => PLAN_NAME,
            Self::Robot => ROBOT_NAME,
            Self::Rig => RIG_NAME,
        }
    }

    /// Reads what was given: a file, or a built-in.
    fn read(self, given: &str) -> Result<Source, InputError> {
        match self {
            Self::Plan => Source::read_rows(Path::new(given)),
            Self::Robot => Source::named_or_read(given, &ROBOTS, "robot"),
            Self::Rig => Source::named_or_read(given, &RIGS, "rig"),
        }
    }
}

/// What a collection is to be made with, as far as anybody has said.
#[derive(Clone, Copy, Debug, Default)]
pub struct Given<'a> {
    /// The plan's file.
    pub plan: Option<&'a Path>,
    /// The robot's file, or a built-in.
    pub robot: Option<&'a str>,
    /// The rig's file, or a built-in.
    pub rig: Option<&'a str>,
}

/// Plan, robot and rig.
#[derive(Debug)]
pub struct SessionInputs {
    /// The robot.
    pub robot: Robot,
    /// The rig.
    pub rig: Rig,
    /// The plan.
    pub rows: Vec<PlanRow>,
    /// What the session does not hold yet.
    new: Vec<(SessionFile, Source)>,
}

/// Why a session cannot be begun, or gone on with.
#[derive(Debug, Error)]
pub enum SessionInputError {
    /// A file cannot be used.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The session was begun with another file than the given one.
    #[error("{given}: the session `{}` was begun with another {}", session.display(), what.name())]
    Other {
        /// Which.
        what: SessionFile,
        /// The given one.
        given: String,
        /// The session.
        session: PathBuf,
    },
    /// Neither given nor in the session.
    #[error("{}: holds no {}", session.display(), what.name())]
    Missing {
        /// Which.
        what: SessionFile,
        /// The session.
        session: PathBuf,
    },
    /// Another program has written the file since.
    #[error("{}: another program has begun this session just now", path.display())]
    BegunMeanwhile {
        /// The file.
        path: PathBuf,
    },
    /// A copy cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

impl SessionInputs {
    /// What the session holds, or, for a new one, what is given.
    ///
    /// # Errors
    /// [`SessionInputError`]; nothing is written yet.
    pub fn open(session: &Path, given: Given<'_>) -> Result<Self, SessionInputError> {
        let plan = given.plan.map(|path| path.display().to_string());
        let mut new = Vec::new();
        let robot = choose(session, SessionFile::Robot, given.robot, &mut new)?;
        let rig = choose(session, SessionFile::Rig, given.rig, &mut new)?;
        let plan = choose(session, SessionFile::Plan, plan.as_deref(), &mut new)?;
        let (robot, rig) = (parse_robot(&robot)?, parse_rig(&rig)?);
        let rows = read_plan(&plan, &robot, &rig)?;
        Ok(Self { robot, rig, rows, new })
    }

    /// Copies into the session what it does not hold yet.
    ///
    /// # Errors
    /// [`SessionInputError::BegunMeanwhile`], [`SessionInputError::Write`].
    pub fn write(&self, lock: &SessionLock) -> Result<(), SessionInputError> {
        for (what, source) in &self.new {
            let path = lock.session().join(what.name());
            if path.exists() {
                return Err(SessionInputError::BegunMeanwhile { path });
            }
            write_atomically(&path, source.text())?;
        }
        Ok(())
    }
}

/// The session's file, which has to be the given one, if both are there.
fn choose(
    session: &Path,
    what: SessionFile,
    given: Option<&str>,
    new: &mut Vec<(SessionFile, Source)>,
) -> Result<Source, SessionInputError> {
    let kept_path = session.join(what.name());
    let given_source = given.map(|given| what.read(given)).transpose()?;
    let kept = if kept_path.is_file() { Some(Source::read_rows(&kept_path)?) } else { None };
    match (given_source, kept) {
        (Some(given_source), Some(kept)) if given_source.text() != kept.text() => {
            let given = given.unwrap_or_default().to_owned();
            Err(SessionInputError::Other { what, given, session: session.to_owned() })
        }
        (_, Some(kept)) => Ok(kept),
        (Some(source), None) => {
            new.push((what, source.clone()));
            Ok(source)
        }
        (None, None) => Err(SessionInputError::Missing { what, session: session.to_owned() }),
    }
}
