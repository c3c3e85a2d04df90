//! The command's words for what is wrong with a session and the files beside it.

use miette::{Report, miette};

use super::outcome::CommandError;
use crate::session::{MeasuredError, SessionFile, SessionInputError};

fn flag(what: SessionFile) -> &'static str {
    match what {
        SessionFile::Plan => "--plan",
        SessionFile::Robot => "--robot",
        SessionFile::Rig => "--rig",
    }
}

fn bad_input(report: Report) -> CommandError {
    CommandError { report, exit_code: 2 }
}

impl From<SessionInputError> for CommandError {
    fn from(error: SessionInputError) -> Self {
        match error {
            SessionInputError::Input(error) => error.into(),
            SessionInputError::Write(error) => Self::output(error),
            SessionInputError::Other { what, given, session } => bad_input(miette!(
                help = format!(
                    "Leave {} out to go on with {}, or record into another directory.",
                    flag(what),
                    session.join(what.name()).display()
                ),
                "{} {given}: the session `{}` was begun with another one",
                flag(what),
                session.display()
            )),
            SessionInputError::Missing { what, session } => bad_input(miette!(
                help = "A new session needs --plan, --robot and --rig.",
                "{} is missing, and {} holds no {}",
                flag(what),
                session.display(),
                what.name()
            )),
            SessionInputError::BegunMeanwhile { .. } => {
                bad_input(miette!(help = "Run the same command again to go on with it.", "{error}"))
            }
        }
    }
}

impl From<MeasuredError> for CommandError {
    fn from(error: MeasuredError) -> Self {
        match error {
            MeasuredError::Input(error) => error.into(),
            MeasuredError::Missing(what) => bad_input(miette!(
                help = format!("Give it: {} FILE. Sessions that `host-cal collect` recorded hold theirs.", flag(what)),
                "{} is missing, and no session among the poses holds a {}",
                flag(what),
                what.name()
            )),
            MeasuredError::SessionsDiffer(what) => {
                bad_input(miette!(help = format!("Say which one to use: {} FILE", flag(what)), "{error}"))
            }
            MeasuredError::NoPosesYet(_) => {
                bad_input(miette!(help = "Give a file of poses, or a session into which poses were recorded.", "{error}"))
            }
        }
    }
}
