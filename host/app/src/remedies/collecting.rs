//! Of collecting.

use std::borrow::Cow;

use super::{Remedy, own_help};
use crate::robot_link::OpenError;

impl Remedy for OpenError {
    fn words(&self) -> Option<String> {
        match self {
            Self::Joints { .. } => Some(format!("--robot-link {self}")),
            Self::Link(_) => None,
        }
    }

    fn remedy(&self) -> Option<Cow<'static, str>> {
        match self {
            Self::Link(error) => own_help(error),
            Self::Joints { .. } => None,
        }
    }
}
