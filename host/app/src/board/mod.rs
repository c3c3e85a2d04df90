//! The host's end of the wire: the serial port, requests and their replies, what is believed of a stream and what it lost.

mod approach_watch;
mod current_pose;
mod encoders;
mod errors;
mod filter;
mod home;
mod link;
mod lvdt;
mod lvdt_fit;
mod plausible;
mod port;
mod ports;
mod reset;
mod robot_on_board;
mod tally;
mod upload;
mod verify;

pub use approach_watch::ApproachWatch;
pub use current_pose::current_pose;
pub use encoders::{NoEncoders, joint_encoders};
pub use errors::{BoardError, PortError};
pub use filter::MessageFilter;
pub use home::{HomeError, Homed, Homing, OtherRobot, check_kinds};
pub use link::{BoardLink, Frame};
pub use lvdt::{LengthSet, LengthSetter, LvdtError, measure_lvdt, store_lvdt};
pub use lvdt_fit::{LvdtFit, LvdtFitError, LvdtPoint, check_lvdt_points, fit_lvdt};
pub use plausible::Implausible;
pub use port::{BAUD, Port};
pub use ports::{PortDescription, PortsError, serial_ports};
pub use reset::{ResetError, reset};
pub use robot_on_board::{NOMINAL_TRAVEL_M, RobotOnBoard, SetError, nominal_lvdt, parameter_set};
pub use tally::{Refusals, RefusedMessages, StreamLosses};
pub use upload::{Admission, LvdtOrigin, SetSummary, Upload, UploadError, UploadStep, Uploaded, bring_back};
pub use verify::{KinematicsDifference, rms_kinematics, rounding_of_kinematics, verify_kinematics};
