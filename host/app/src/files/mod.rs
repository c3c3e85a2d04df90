//! Robots, rigs and measured poses: the project's files (see `docs/files.md`).
//!
//! A file is read whole and checked whole; whatever is wrong with it is an [`InputError`] that names the file, the line and
//! the field, what was found and what was expected. Files are written under a temporary name and renamed.

mod builtin;
mod calibrated;
mod csv_rows;
mod encoding;
mod kind;
mod numbers;
mod plan_rows;
mod poses;
mod problem;
mod protect;
mod read_poses;
mod reading;
mod rig;
mod robot;
mod robot_terms;
pub mod session_names;
mod solids;
mod source;
mod targets;
mod temporary;
mod together;
mod urdf;
mod write;

pub use builtin::{RIGS, ROBOTS};
pub use calibrated::{CalibratedError, calibration, write_calibrated};
pub use kind::FileKind;
pub use plan_rows::{read_plan, write_plan};
pub use poses::{approach_text, pose_header, pose_record, write_poses};
pub use problem::Problem;
pub use protect::Refusal;
pub use read_poses::{append_poses, read_poses};
pub use rig::{fitted_rig_toml, open_rig, parse_rig, rig_source};
pub use robot::{MOST_NAME_BYTES, calibrated_toml, open_robot, parse_robot, robot_source};
pub use source::{InputError, Source};
pub use targets::{Target, compensated_csv, joints_as_written, pose_as_written, read_targets};
pub use together::{FilesError, FolderError, NamedFile, make_folder, write_files};
pub use urdf::{ENCODER_ELEMENT, Imported, UrdfEnds, parse_urdf, read_urdf};
pub use write::{Output, WriteError, write_atomically, write_atomically_with};
pub(crate) use write::{PendingFile, commit_all};
