//! A session: a directory that says what was recorded with what, and holds what the board sent and the poses that settled.
//!
//! | file | |
//! | --- | --- |
//! | `session.toml` | robot, rig, bar, board, versions and times of every run; written by rename |
//! | `stream.bbl` | the frames exactly as they came and were found whole; append-only |
//! | `poses.csv` | the settled poses as [`crate::files`] reads them; written by rename |
//! | `plan.csv`, `robot.toml`, `rig.toml` | what a plan was walked with, copied |

mod description;
mod export;
mod log;
mod pose_file;
mod recorder;
mod segments;
mod summary;

pub use description::{BoardDescription, Description, DescriptionError, RobotDescription, Run};
pub use export::{LogExportError, LogFormat, export_log};
pub use log::{LogError, LogReader, LogWriter, Record};
pub use pose_file::{Erased, PoseFile, PoseFileError, SettledRow};
pub use recorder::{Connection, MeasuredPose, RecordError, Recorder};
pub use summary::LogSummary;

/// Names of the files in a session: no command writes anything else under them.
pub(crate) const FILE_NAMES: [&str; 6] = [LOG_NAME, DESCRIPTION_NAME, POSES_NAME, PLAN_NAME, ROBOT_NAME, RIG_NAME];
/// Folder of a session for programs of the robot's controller.
pub const PROGRAMS_NAME: &str = "programs";
/// Name of the log in a session.
pub const LOG_NAME: &str = "stream.bbl";
/// Name of the description in a session.
pub const DESCRIPTION_NAME: &str = "session.toml";
/// Name of the poses in a session.
pub const POSES_NAME: &str = "poses.csv";
/// Name of the plan in a session.
pub const PLAN_NAME: &str = "plan.csv";
/// Name of the robot that a plan was made for, in a session.
pub const ROBOT_NAME: &str = "robot.toml";
/// Name of the rig in a session.
pub const RIG_NAME: &str = "rig.toml";
