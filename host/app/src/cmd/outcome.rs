//! How a command ends.

use std::process::ExitCode;

use miette::{Diagnostic, Report};

use crate::files::WriteError;
use crate::session::{LockError, RecordError};

/// How a command that ran to its end ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Exit code 0.
    Good,
    /// The report was printed, but its result is not to be trusted as it is: exit code 1.
    Doubtful,
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Good => Self::SUCCESS,
            Outcome::Doubtful => Self::from(1),
        }
    }
}

/// Why a command did not run to its end.
#[derive(Debug)]
pub struct CommandError {
    /// What to show.
    pub report: Report,
    /// 2 for bad input or usage, 3 for output that could not be written, 130 for the user's wish to end.
    pub exit_code: u8,
}

impl CommandError {
    /// Output that could not be written.
    pub(super) fn output(diagnostic: impl Diagnostic + Send + Sync + 'static) -> Self {
        Self { report: Report::new(diagnostic), exit_code: 3 }
    }

    /// A file that was not written: what stands in its place is the user's to change, as other input is.
    pub(super) fn not_written(error: WriteError) -> Self {
        if error.is_refusal() { error.into() } else { Self::output(error) }
    }
}

/// What a command meets on its way is bad input, unless it says otherwise.
impl<E: Diagnostic + Send + Sync + 'static> From<E> for CommandError {
    fn from(error: E) -> Self {
        Self { report: Report::new(error), exit_code: 2 }
    }
}

/// What is there and cannot be read is bad input; what cannot be written is not.
pub(super) fn record_error(error: RecordError) -> CommandError {
    if error.is_of_input() { error.into() } else { CommandError::output(error) }
}

/// Another writer is no failure to write.
pub(super) fn lock_error(error: LockError) -> CommandError {
    match error {
        LockError::InUse { .. } => error.into(),
        error => CommandError::output(error),
    }
}
