//! Robot controllers for tests: they hold to the published syntax and timing, and fail when told to.

mod arm;
pub mod ur;
mod ur_dashboard;
mod ur_rtde;
mod ur_script;
#[cfg(unix)]
pub mod val;

pub use arm::{Arm, JOINTS, JointsAt};

/// What goes wrong with the next move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mishap {
    /// The controller does not begin it.
    Refuses,
    /// A protective stop, or an envelope error, half way.
    FaultsHalfWay,
    /// Somebody stops it half way at the controller, without a fault.
    EndsHalfWay,
    /// It is carried out, but the controller says nothing any more.
    GoesSilent,
    /// The connection breaks half way; the robot finishes its move.
    DropsTheLine,
    /// The controller claims to be there, and the robot stands elsewhere by as much, radians of joint 1 in thousandths.
    StandsElsewhereByMrad(u16),
    /// The controller sends what no such controller sends.
    TalksGarbage,
}
