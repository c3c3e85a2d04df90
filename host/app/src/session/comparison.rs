//! The poses of a session's log beside those of its poses.csv.

use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::Serialize;

use super::logged_poses::{LoggedPose, LoggedPoses};
use super::pose_file_error::PoseFileError;
use super::recovery::missing_poses;
use super::{DESCRIPTION_NAME, LOG_NAME};
use crate::units::{mm_from_m, tidy};

/// What was measured, and what of it poses.csv lacks.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// The session.
    pub session: String,
    /// Measured, those erased again not counted.
    pub poses_measured: usize,
    /// Measured and erased again.
    pub poses_erased: usize,
    /// Not in poses.csv.
    pub poses_missing: Vec<MissingPose>,
}

/// A pose that poses.csv lacks.
#[derive(Clone, Debug, Serialize)]
pub struct MissingPose {
    /// Time of its middle by the board's clock, seconds.
    pub t_s: f64,
    /// Name of the chuck.
    pub chuck: String,
    /// Name of the sphere.
    pub sphere: String,
    /// Length of the bar at mid travel.
    pub bar_mm: f64,
    /// Line of plan.csv that it was measured for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plan_row: Option<usize>,
}

/// From a pose's way into the log to its way into poses.csv, at most, on a slow disk.
const ON_ITS_WAY: Duration = Duration::from_millis(300);

impl Comparison {
    /// Of a session, which may be being recorded, and what its log was found to hold.
    ///
    /// # Errors
    /// [`PoseFileError`] when poses.csv is no file of poses.
    pub fn new(session: &Path, logged: &LoggedPoses) -> Result<Self, PoseFileError> {
        let mut missing = missing_poses(session, logged)?;
        if !missing.is_empty() {
            // In a session that is being recorded the latest pose may have been on its way.
            std::thread::sleep(ON_ITS_WAY);
            missing = missing_poses(session, logged)?;
        }
        Ok(Self {
            session: session.display().to_string(),
            poses_measured: logged.count(),
            poses_erased: logged.erased(),
            poses_missing: missing.into_iter().map(Into::into).collect(),
        })
    }

    /// Whether poses.csv lacks nothing.
    pub fn is_whole(&self) -> bool {
        self.poses_missing.is_empty()
    }
}

impl From<LoggedPose> for MissingPose {
    fn from(LoggedPose { connection, pose, .. }: LoggedPose) -> Self {
        Self {
            t_s: pose.t_s,
            chuck: connection.chuck.clone(),
            sphere: connection.sphere.clone(),
            bar_mm: tidy(mm_from_m(connection.bar_m)),
            plan_row: pose.plan_row,
        }
    }
}

/// The session that a log is the log of.
pub fn session_of(log: &Path) -> Option<PathBuf> {
    let session = log.parent()?;
    let is_session = log.file_name().is_some_and(|name| name == LOG_NAME) && session.join(DESCRIPTION_NAME).is_file();
    is_session.then(|| session.to_owned())
}
