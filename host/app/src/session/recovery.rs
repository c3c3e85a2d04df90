//! Poses that a session's log holds and its poses.csv lacks.

use std::path::Path;

use ballbar::JointKind;

use super::POSES_NAME;
use super::lock::SessionLock;
use super::logged_poses::{LoggedPose, LoggedPoses};
use super::pose_file::{PoseFile, SettledRow};
use super::pose_file_error::PoseFileError;
use super::record_error::RecordError;

/// What there is to write into poses.csv; nothing is written yet.
pub(super) struct Recovery {
    file: Option<PoseFile>,
    missing: Vec<LoggedPose>,
}

/// Writes the poses that a session's log holds and its poses.csv lacks; how many.
///
/// # Errors
/// [`RecordError`]; nothing was changed then.
pub fn recover(lock: &SessionLock) -> Result<usize, RecordError> {
    let (_, recovered) = Recovery::find(lock.session(), None)?.write()?;
    Ok(recovered)
}

/// The poses that the log of a session holds and its poses.csv lacks.
///
/// # Errors
/// [`PoseFileError`] when poses.csv is no file of poses.
pub fn missing_poses(session: &Path, logged: &LoggedPoses) -> Result<Vec<LoggedPose>, PoseFileError> {
    Ok(Recovery::of(session, logged, None)?.missing)
}

impl Recovery {
    /// Compares a session's log with its poses.csv, for a robot with joints of these kinds, or else for the one that the log has poses
    /// of.
    pub(super) fn find(session: &Path, kinds: Option<&[JointKind]>) -> Result<Self, RecordError> {
        Ok(Self::of(session, &LoggedPoses::read(session)?, kinds)?)
    }

    fn of(session: &Path, logged: &LoggedPoses, kinds: Option<&[JointKind]>) -> Result<Self, PoseFileError> {
        let Some(kinds) = kinds.or(logged.kinds()) else { return Ok(Self { file: None, missing: Vec::new() }) };
        let file = PoseFile::open(&session.join(POSES_NAME), kinds)?;
        let mut missing = logged.missing_among(file.times_us());
        // Poses of another robot have another file.
        missing.retain(|logged| logged.kinds.as_ref().is_none_or(|of| **of == *kinds));
        Ok(Self { file: Some(file), missing })
    }

    /// Writes what is missing; the file, and how many.
    pub(super) fn write(self) -> Result<(Option<PoseFile>, usize), PoseFileError> {
        let Self { mut file, missing } = self;
        if let (Some(file), false) = (&mut file, missing.is_empty()) {
            file.add_earlier(missing.iter().map(|logged| SettledRow::new(&logged.connection, &logged.pose)))?;
        }
        Ok((file, missing.len()))
    }
}
