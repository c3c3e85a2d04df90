//! `session.toml`: what was recorded with what.

use std::path::{Path, PathBuf};

use ballbar::wire::{BoardHello, SetIdentity};
use miette::Diagnostic;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::own_file::{ForeignChange, OwnFile, ReplaceError};
use crate::files::WriteError;

/// A session's description; one run for every time that a program recorded into it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// The runs, in order.
    #[serde(default)]
    pub runs: Vec<Run>,
}

/// One recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// When it began, RFC 3339.
    pub started: String,
    /// When it ended; missing when the program was killed.
    pub ended: Option<String>,
    /// The program and its version.
    pub by: String,
    /// The port.
    pub port: String,
    /// The rig's file or built-in.
    pub rig: Option<String>,
    /// `chuck:sphere` that the bar joined.
    pub pairing: Option<String>,
    /// The bar's length at mid travel, millimetres; poses.csv has it where it changed.
    pub bar_mm: Option<f64>,
    /// Kind and address of the robot's controller, where a plan was walked.
    pub robot_link: Option<String>,
    /// Lines of plan.csv that the operator skipped.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub skipped: Vec<usize>,
    /// Temperature, where somebody gave it, degrees Celsius.
    pub temperature_c: Option<f64>,
    /// Sampling rate, Hz.
    pub rate_hz: u16,
    /// Settled poses written to poses.csv in this run.
    pub poses: usize,
    /// The board.
    pub board: BoardDescription,
    /// The robot whose parameters the board used.
    pub robot: Option<RobotDescription>,
}

/// A board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardDescription {
    /// Its kind.
    pub kind: String,
    /// Its number.
    pub unique_id: String,
    /// Version of its firmware.
    pub firmware: String,
    /// Number of the protocol.
    pub protocol: u16,
    /// From the first to the last encoder of a latch, at most, nanoseconds.
    pub encoder_skew_ns: u32,
    /// From the encoders' latch to the middle of the LVDT's scan, nanoseconds.
    pub lvdt_delay_ns: u32,
}

/// Parameters of a board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotDescription {
    /// The robot's name.
    pub name: String,
    /// Whether a fit made the parameters.
    pub is_calibrated: bool,
    /// CRC-32 of the set.
    pub crc: String,
}

/// Why a session's description cannot be read or written.
#[derive(Debug, Error, Diagnostic)]
pub enum DescriptionError {
    /// It cannot be read.
    #[error("{}{}: {reason}", path.display(), line.map_or(String::new(), |line| format!(":{line}")))]
    #[diagnostic(help(
        "Nothing was changed. The file is written by `host-cal stream` and `collect`, and says what was recorded with what. Mend it, or move it away; or give another directory."
    ))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The line, from 1, where it is known.
        line: Option<usize>,
        /// Why not.
        reason: String,
    },
    /// Another program has changed it.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Changed(#[from] ForeignChange),
    /// It cannot be written.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Write(#[from] WriteError),
}

impl From<ReplaceError> for DescriptionError {
    fn from(error: ReplaceError) -> Self {
        match error {
            ReplaceError::Changed(error) => error.into(),
            ReplaceError::Write(error) => error.into(),
        }
    }
}

impl Description {
    /// Reads the description in a session's directory; an empty one when there is none yet.
    ///
    /// # Errors
    /// [`DescriptionError::Unreadable`].
    pub fn read(session: &Path) -> Result<Self, DescriptionError> {
        DescriptionFile::open(session).map(|file| file.description)
    }

    fn parse(path: &Path, text: &str) -> Result<Self, DescriptionError> {
        let unreadable = |line, reason| Err(DescriptionError::Unreadable { path: path.to_owned(), line, reason });
        match toml::from_str::<Self>(text) {
            Ok(description) if description.runs.is_empty() => unreadable(None, "no [[runs]], expected one at least".to_owned()),
            Ok(description) => Ok(description),
            Err(error) => {
                let line = error.span().map(|span| 1 + text.bytes().take(span.start).filter(|&byte| byte == b'\n').count());
                let reason = error.message().chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
                unreadable(line, reason)
            }
        }
    }
}

/// A session's description while somebody records.
#[derive(Debug)]
pub(super) struct DescriptionFile {
    pub(super) description: Description,
    file: OwnFile,
}

impl DescriptionFile {
    /// Reads the description in a session's directory; an empty one when there is none yet.
    pub(super) fn open(session: &Path) -> Result<Self, DescriptionError> {
        let path = session.join(super::DESCRIPTION_NAME);
        let file = OwnFile::read(&path).map_err(|error| DescriptionError::Unreadable {
            path: path.clone(),
            line: None,
            reason: error.to_string(),
        })?;
        let description = file.text().map_or(Ok(Description::default()), |text| Description::parse(&path, text))?;
        Ok(Self { description, file })
    }

    /// Writes it, unless somebody else has changed the file.
    pub(super) fn write(&mut self) -> Result<(), DescriptionError> {
        let text = toml::to_string(&self.description).map_err(|error| DescriptionError::Unreadable {
            path: self.file.path().to_owned(),
            line: None,
            reason: error.to_string(),
        })?;
        Ok(self.file.replace(text)?)
    }
}

impl From<&BoardHello> for BoardDescription {
    fn from(hello: &BoardHello) -> Self {
        Self {
            kind: hello.board.as_str().to_owned(),
            unique_id: hello.unique_id.iter().map(|byte| format!("{byte:02x}")).collect(),
            firmware: hello.firmware.as_str().to_owned(),
            protocol: hello.version.number,
            encoder_skew_ns: hello.encoder_skew_ns,
            lvdt_delay_ns: hello.lvdt_delay_ns,
        }
    }
}

impl From<&SetIdentity> for RobotDescription {
    fn from(identity: &SetIdentity) -> Self {
        Self {
            name: identity.name.as_str().to_owned(),
            is_calibrated: identity.is_calibrated,
            crc: format!("{:08x}", identity.crc),
        }
    }
}
