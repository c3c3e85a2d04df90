//! Robots, rigs and measured poses: the project's files (see `docs/files.md`).
//!
//! A file is read whole and checked whole; whatever is wrong with it is an [`InputError`] that names the file, the line and
//! the field, what was found and what was expected. Files are written under a temporary name and renamed.

mod builtin;
mod csv_rows;
mod encoding;
mod kind;
mod limits;
mod numbers;
mod plan_rows;
mod poses;
mod problem;
mod protect;
mod read_poses;
mod reading;
mod rig;
mod robot;
mod solids;
mod source;
mod targets;
mod temporary;
mod urdf;
mod write;

pub use builtin::{RIGS, ROBOTS};
pub use kind::FileKind;
pub use limits::BeyondLimits;
pub use plan_rows::{BarAt, PlanRow, RowKind, RowMargins, read_plan, write_plan};
pub use poses::{Dataset, Motion, PoseRow, RowWarning, pose_header, pose_record, write_poses};
pub use problem::Problem;
pub use protect::Refusal;
pub use rig::{Bar, NamedPoint, PairingId, Rig};
pub use robot::{Calibration, CalibrationVerdict, EncoderFacts, JointLimits, MOST_NAME_BYTES, NoEncoders, Robot};
pub use solids::Solids;
pub use source::{InputError, Source};
pub use targets::{Goal, Target, compensated_csv, pose_as_written, read_targets};
pub use urdf::{ENCODER_ELEMENT, Imported, UrdfEnds, parse_urdf, read_urdf};
pub use write::{Output, WriteError, write_atomically, write_atomically_with};
pub(crate) use write::{PendingFile, commit_all};
