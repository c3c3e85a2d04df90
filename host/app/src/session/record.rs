//! One entry of a log.

use ballbar::wire::ToHost;

use super::pose_mark::PoseMark;
use crate::board::Implausible;

/// One entry of a log.
#[derive(Clone, Debug)]
pub enum Record {
    /// A whole frame, whose message is believed.
    Message(Box<ToHost>),
    /// A whole frame, whose message is not to be believed.
    Refused(Implausible),
    /// What the host noted of poses.
    Mark(PoseMark),
    /// A frame that is torn or damaged.
    Damaged,
}
