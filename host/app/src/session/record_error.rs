//! Why a recording cannot begin or go on.

use miette::Diagnostic;
use thiserror::Error;

use super::description::DescriptionError;
use super::log::LogError;
use super::pose_file_error::PoseFileError;

/// Why a recording cannot begin or go on.
#[derive(Debug, Error, Diagnostic)]
pub enum RecordError {
    /// The log.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Log(#[from] LogError),
    /// The description.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Description(#[from] DescriptionError),
    /// The poses.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Poses(#[from] PoseFileError),
    /// Poses while nobody has said what the bar joins.
    #[error("a pose was to be kept without a connection of the bar")]
    NotConnected,
    /// A chuck and a sphere have names that a log has no room for.
    #[error("the names of the chuck and the sphere have {bytes} bytes, which the log has no room for")]
    #[diagnostic(help("A session's log holds what the bar joins. Give the chuck and the sphere shorter names."))]
    LongNames {
        /// Both together.
        bytes: usize,
    },
}

impl RecordError {
    /// Whether it is what is there that cannot be used, and not what was to be written that could not be.
    pub fn is_of_input(&self) -> bool {
        matches!(
            self,
            Self::Log(LogError::NotALog { .. } | LogError::OtherVersion { .. })
                | Self::Description(DescriptionError::Unreadable { .. })
                | Self::Poses(
                    PoseFileError::OtherColumns { .. } | PoseFileError::Unreadable { .. } | PoseFileError::Damaged { .. },
                )
                | Self::LongNames { .. }
        )
    }
}
