//! Names of the files in a session. They stand here since whatever else is written takes none of them.

/// Names of the files in a session: no command writes anything else under them.
pub(crate) const FILE_NAMES: [&str; 7] = [LOG_NAME, DESCRIPTION_NAME, POSES_NAME, PLAN_NAME, ROBOT_NAME, RIG_NAME, LOCK_NAME];
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
/// Name of what a session's writer locks.
pub const LOCK_NAME: &str = "session.lock";
