//! What no output takes the place of.

use std::path::Path;

use same_file::is_same_file;
use thiserror::Error;

use super::kind::{FileKind, Found, recognise};
use super::reading;
use super::session_names::{DESCRIPTION_NAME, FILE_NAMES, LOG_NAME, PROGRAMS_NAME};

/// Why a file is not replaced.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Refusal {
    /// This process has read it.
    #[error("is read by this command, and its output would take the place of it")]
    Input,
    /// In the folder of a session, under a name that the session has for its own.
    #[error("is a file of a session, which no output replaces")]
    OfSession,
    /// A log that was recorded.
    #[error("is the recording of a session, which no output replaces")]
    Recording,
    /// A file of another kind.
    #[error("is {found}, and {written} is to be written")]
    OtherKind {
        /// What stands there.
        found: String,
        /// What would take its place.
        written: FileKind,
    },
    /// Two outputs of one command.
    #[error("is named twice, for two outputs")]
    Twice,
}

impl Refusal {
    /// What to do about it.
    pub(super) fn help(&self) -> &'static str {
        match self {
            Self::Input | Self::Recording => "Nothing was written. Give the output a name of its own.",
            Self::OfSession => "Nothing was written. Give the output another name, or another folder.",
            Self::OtherKind { .. } => "Nothing was written. Give the output another name, or replace the file: --force",
            Self::Twice => "Nothing was written. Give every output a name of its own.",
        }
    }
}

/// Checks what stands under the name of an output, as it was given and with its links followed. With `force` a file of another kind may
/// be replaced; nothing allows the others.
pub(super) fn check(given: &Path, followed: &Path, written: FileKind, force: bool) -> Result<(), Refusal> {
    if is_of_session(given) || is_of_session(followed) {
        return Err(Refusal::OfSession);
    }
    if !followed.exists() {
        return Ok(());
    }
    if reading::was_read(followed) {
        return Err(Refusal::Input);
    }
    match reading::look_at(followed).and_then(recognise).unwrap_or(Found::Other("a file that cannot be read")) {
        Found::Recording => Err(Refusal::Recording),
        Found::Empty => Ok(()),
        Found::Ours(kind) if kind == written || force => Ok(()),
        Found::Ours(kind) => Err(Refusal::OtherKind { found: kind.to_string(), written }),
        Found::Other(_) if force => Ok(()),
        Found::Other(found) => Err(Refusal::OtherKind { found: found.to_owned(), written }),
    }
}

/// Whether a name is one of those that a session has for its files, there already or not; on some disks letter case is none.
fn is_of_session(path: &Path) -> bool {
    let Some(name) = path.file_name() else { return false };
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let is_session = |folder: &Path| [LOG_NAME, DESCRIPTION_NAME].iter().any(|name| folder.join(name).is_file());
    let is_programs = folder.file_name().is_some_and(|name| name.eq_ignore_ascii_case(PROGRAMS_NAME));
    if is_programs && folder.parent().is_some_and(is_session) {
        return true;
    }
    let is_own = |own: &&str| name.eq_ignore_ascii_case(own) || is_same_file(folder.join(own), path).unwrap_or(false);
    is_session(folder) && FILE_NAMES.iter().any(is_own)
}
