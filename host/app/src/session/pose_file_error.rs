//! Why poses cannot be added to a session's file.

use std::fmt;
use std::path::PathBuf;

use miette::Diagnostic;
use thiserror::Error;

use super::own_file::{ForeignChange, ReplaceError};
use crate::files::WriteError;

/// Why poses cannot be added.
#[derive(Debug, Error, Diagnostic)]
pub enum PoseFileError {
    /// The file is there and cannot be read.
    #[error("{}: cannot be read: {error}", path.display())]
    #[diagnostic(help(
        "Nothing was changed. Mend the file, or move it away, and the poses that the log holds are written anew."
    ))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        error: std::io::Error,
    },
    /// The file has other columns.
    #[error("{}:{line}: the columns are `{found}`, expected `{expected}`", path.display())]
    #[diagnostic(help(
        "The file is of another robot, or was not written by this program. Record into another directory; or move the file away, and the poses that the log holds are written anew."
    ))]
    OtherColumns {
        /// The file.
        path: PathBuf,
        /// Line of its header.
        line: usize,
        /// Its header.
        found: String,
        /// The header of this robot's poses.
        expected: String,
    },
    /// A line of the file is no pose.
    #[error("{}:{line}: {damage}", path.display())]
    #[diagnostic(help(
        "Nothing was added to the file or changed. Mend the line, or delete it: a pose that the log holds is then written again. To take a pose out, put # before its line."
    ))]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong with it.
        damage: Damage,
    },
    /// Another program has changed the file.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Changed(#[from] ForeignChange),
    /// The file cannot be written.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Write(#[from] WriteError),
}

impl From<ReplaceError> for PoseFileError {
    fn from(error: ReplaceError) -> Self {
        match error {
            ReplaceError::Changed(error) => error.into(),
            ReplaceError::Write(error) => error.into(),
        }
    }
}

/// What is wrong with a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Damage {
    /// The file ends within it.
    CutOff,
    /// It has more or fewer fields than the header.
    FieldCount {
        /// Fields of the line.
        found: usize,
        /// Fields of the header.
        expected: usize,
    },
    /// It is the header again.
    HeaderAgain,
    /// A field holds something else than it should.
    Field {
        /// The column.
        column: String,
        /// What stands there.
        found: String,
        /// What may.
        expected: &'static str,
    },
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::CutOff => f.write_str("the file ends within this line, expected the end of a line: was it cut off?"),
            Self::FieldCount { found, expected } => write!(f, "{found} fields, expected {expected} as in the header"),
            Self::HeaderAgain => f.write_str("the header stands here again, expected a pose"),
            Self::Field { column, found, expected } => write!(f, "column `{column}`: `{found}`, expected {expected}"),
        }
    }
}
