//! Limits of joints, and joints beyond them.

use std::fmt;

use ballbar::JointKind;

use crate::units::{ScreenUnit, tidy};

/// Limits of a joint's encoder output q, radians or metres.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct JointLimits {
    /// Lower limit.
    pub min: f64,
    /// Upper limit.
    pub max: f64,
}

impl JointLimits {
    /// Whether there is anything between them.
    pub(super) fn are_a_range(&self) -> bool {
        self.min.is_finite() && self.max.is_finite() && self.min < self.max
    }

    /// Whether `q` lies within, limits included.
    pub fn contain(&self, q: f64) -> bool {
        (self.min..=self.max).contains(&q)
    }
}

/// A joint that stands beyond its limits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BeyondLimits {
    /// Number of the joint, from 1.
    pub joint: usize,
    /// Its kind.
    pub kind: JointKind,
    /// Encoder output, radians or metres.
    pub q: f64,
    /// Its limits.
    pub limits: JointLimits,
}

impl fmt::Display for BeyondLimits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = ScreenUnit::from(self.kind);
        let [q, min, max] = [self.q, self.limits.min, self.limits.max].map(|value| tidy(unit.from_si(value)));
        write!(f, "joint {} at {q} {} is beyond its limits, {min} to {max}", self.joint, unit.name())
    }
}
