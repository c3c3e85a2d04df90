//! Of procedures with a board.

use std::borrow::Cow;

use ballbar::wire::WhichSet;

use super::{Remedy, own_help};
use crate::board::{HomeError, LvdtError, OtherRobot, ResetError, UploadError};

impl Remedy for HomeError {
    fn remedy(&self) -> Option<Cow<'static, str>> {
        let words = match self {
            Self::Board(error) => return own_help(error),
            Self::OtherRobot(error) => return error.remedy(),
            Self::NoParameters => "Upload a robot first: host-cal apply PORT --robot robot.toml",
            Self::Joints { .. } => "Give one value a joint.",
            Self::OutOfRange { .. } => "Is the value in degrees or millimetres? Nothing was changed.",
        };
        Some(words.into())
    }
}

impl Remedy for LvdtError {
    fn remedy(&self) -> Option<Cow<'static, str>> {
        let words = match self {
            Self::Board(error) => return own_help(error),
            Self::NoParameters => "Upload a robot first: host-cal apply PORT --robot robot.toml",
            Self::Ended { .. } | Self::TooFarOff { .. } => "Nothing was changed on the board.",
            Self::NotStreaming => "Was it started again? Nothing was changed on the board.",
        };
        Some(words.into())
    }
}

impl Remedy for OtherRobot {
    fn remedy(&self) -> Option<Cow<'static, str>> {
        Some("Give the robot that the board holds: `host-cal status PORT` names it.".into())
    }
}

impl Remedy for ResetError {
    fn remedy(&self) -> Option<Cow<'static, str>> {
        match self {
            Self::Board(error) => own_help(error),
            Self::NotBack { .. } => Some("Switch it off and on.".into()),
        }
    }
}

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
            Self::TooManyJoints { .. } | Self::TooLong => "Nothing was changed on the board.",
            Self::Coarse { .. } => {
                "Nothing was changed on the board. Links that are far longer than the arm reaches cost digits: are their lengths right?"
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
