//! A session: a directory that says what was recorded with what, and holds what the board sent and the poses that settled.
//!
//! | file | |
//! | --- | --- |
//! | `session.toml` | robot, rig, bar, board, versions and times of every run; written by rename |
//! | `stream.bbl` | the frames exactly as they came and were found whole; append-only |
//! | `poses.csv` | the settled poses as [`crate::files`] reads them; written by rename |
//! | `session.lock` | held by who writes; says who |
//! | `plan.csv`, `robot.toml`, `rig.toml` | what a plan was walked with, copied |

mod comparison;
mod description;
mod export;
mod inputs;
mod lock;
mod log;
mod logged_poses;
mod measured;
mod measured_pose;
mod own_file;
mod pose_file;
mod pose_file_error;
mod pose_lines;
mod pose_mark;
mod record;
mod record_error;
mod recorder;
mod recovery;
mod segments;
mod settled_rule;
mod summary;

pub use comparison::{Comparison, MissingPose, session_of};
pub use description::{BoardDescription, Description, DescriptionError, RobotDescription, Run};
pub use export::{LogExportError, LogFormat, export_log};
pub use inputs::{Given, SessionFile, SessionInputError, SessionInputs};
pub use lock::{Holder, LockError, SessionLock};
pub use log::{LogError, LogReader, LogWriter};
pub use logged_poses::{LoggedPose, LoggedPoses};
pub use measured::{MeasuredError, MeasuredInputs, Named, poses_of};
pub use measured_pose::{Connection, MeasuredPose};
pub use own_file::{ForeignChange, ReplaceError};
pub use pose_file::{Erased, PoseFile, SettledRow};
pub use pose_file_error::{Damage, PoseFileError};
pub use pose_mark::{MarkedPose, PoseMark};
pub use record::Record;
pub use record_error::RecordError;
pub use recorder::Recorder;
pub use recovery::{missing_poses, recover};
pub use settled_rule::{SettledFate, SettledRule};
pub use summary::LogSummary;

pub use crate::files::session_names::{
    DESCRIPTION_NAME, LOCK_NAME, LOG_NAME, PLAN_NAME, POSES_NAME, PROGRAMS_NAME, RIG_NAME, ROBOT_NAME,
};

/// RFC 3339, to the second.
fn now() -> String {
    let now = jiff::Timestamp::now();
    now.round(jiff::Unit::Second).unwrap_or(now).to_string()
}
