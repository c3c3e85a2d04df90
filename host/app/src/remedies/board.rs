//! Of procedures with a board.

use std::borrow::Cow;

use ballbar::wire::WhichSet;

use super::{Remedy, own_help};
use crate::board::UploadError;

impl Remedy for UploadError {
    fn remedy(&self) -> Option<Cow<'static, str>> {
        let words = match self {
            Self::Board(error) => return own_help(error),
            Self::Set(error) => return own_help(error),
            Self::NotCalibrated { .. } => {
                "Fit it first: host-cal fit … --out calibrated.toml. To upload it as it is: --uncalibrated"
            }
            Self::NotJudged { .. } => {
                "An older host-cal wrote it, or somebody changed it. Fit the design to the poses again: host-cal fit … --out \
                 calibrated.toml. To upload it as it is: --uncalibrated"
            }
            Self::TooManyJoints { .. } => "Nothing was changed on the board.",
            Self::Coarse { .. } => {
                "Nothing was changed on the board. Large lengths that cancel cost digits: describe the robot by frames near the arm."
            }
            Self::ReadBack(WhichSet::Staged) => "Nothing was stored; the board keeps the parameters that it had.",
            Self::ReadBack(WhichSet::Active) => {
                "They were stored, and the flash gives back something else: do not trust the board. Try again."
            }
            Self::Kinematics(_) => {
                "Nothing was stored; the board keeps the parameters that it had. Is its firmware sound? `host-cal status PORT`"
            }
            Self::Unusable { .. } => {
                "Nothing was changed on the board. Upload a robot's file: host-cal apply PORT --robot robot.toml"
            }
        };
        Some(words.into())
    }
}
