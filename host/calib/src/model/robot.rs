//! A robot: a chain, its limits and encoders, and when and from what it was calibrated.

use std::fmt;

use ballbar::{Chain, Coupling, Encoder, JointTerms, Kinematics, TermsError};
use thiserror::Error;

use super::calibration::{Calibration, CalibrationVerdict};
use super::limits::{BeyondLimits, JointLimits};
use super::tolerances::Tolerances;

/// A robot as it is believed to be. [`Robot::new`] makes one from numbers.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "super::stored::RobotParts"))]
pub struct Robot {
    /// What people call it.
    pub name: String,
    /// What it was read or made from: a file, or a word that a message can name.
    pub source: String,
    /// Links, joints and their parameters, SI units.
    pub chain: Chain<f64>,
    /// What the joints' angles have beside offset and scale, and the masses that they bear; none of a design that says nothing.
    pub terms: JointTerms<f64>,
    /// How well links and joints are known.
    pub tolerances: Tolerances,
    /// Limits of each joint's encoder output, radians or metres.
    pub limits: Vec<JointLimits>,
    /// What is known of each joint's encoder.
    pub encoders: Vec<EncoderFacts>,
    /// What a fit left with it; `None` for a design.
    pub calibration: Option<Calibration>,
}

/// How a joint's encoder counts.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EncoderFacts {
    /// Counts per radian or metre, and from index to index; `None` where the file does not say.
    pub encoder: Option<Encoder<f64>>,
    /// Joints nearer to the base whose motion turns this one along.
    pub couplings: Vec<Coupling<f64>>,
}

impl EncoderFacts {
    /// Of an encoder that nothing is known of: joint values are taken as they come.
    pub const UNKNOWN: Self = Self { encoder: None, couplings: Vec::new() };
}

/// Why numbers are no robot.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum RobotError {
    /// Not every joint has limits, or more than the joints have.
    #[error("limits of {found} joints, expected {expected}")]
    LimitCount {
        /// Limits given.
        found: usize,
        /// Joints of the chain.
        expected: usize,
    },
    /// A joint's range is empty, or one of its ends is no finite number.
    #[error("joint {joint} cannot be limited to {} … {}, expected finite numbers and the lower one first", .limits.min, .limits.max)]
    Limits {
        /// Number of the joint, from 1.
        joint: usize,
        /// What was given, radians or metres.
        limits: JointLimits,
    },
    /// Terms that no chain of these joints has.
    #[error(transparent)]
    Terms(#[from] TermsError),
    /// Tolerances are not of these links and joints, or one is no finite number from zero on.
    #[error("tolerances are not finite numbers from 0 on, of {joints} joints and one link more")]
    Tolerances {
        /// Joints of the chain.
        joints: usize,
    },
    /// What is known of encoders is not of these joints.
    #[error("encoders of {found} joints, expected {expected}")]
    EncoderCount {
        /// Encoders given.
        found: usize,
        /// Joints of the chain.
        expected: usize,
    },
}

impl Robot {
    /// A design: `limits` has one entry a joint, radians or metres as the joint is. Its `source` is its name, its tolerances are the usual
    /// ones, and nothing is known of its encoders.
    ///
    /// # Errors
    /// [`RobotError`] when limits are not those of the chain's joints, or not a range.
    pub fn new(name: impl Into<String>, chain: Chain<f64>, limits: Vec<JointLimits>) -> Result<Self, RobotError> {
        let name = name.into();
        let encoders = vec![EncoderFacts::UNKNOWN; chain.joints()];
        let tolerances = Tolerances::usual(chain.joint_kinds());
        Self { source: name.clone(), name, chain, terms: JointTerms::none(), tolerances, limits, encoders, calibration: None }
            .checked()
    }

    /// What [`Robot::new`] promises of a robot, whoever has put it together.
    pub(super) fn checked(self) -> Result<Self, RobotError> {
        let expected = self.chain.joints();
        if self.limits.len() != expected {
            return Err(RobotError::LimitCount { found: self.limits.len(), expected });
        }
        if self.encoders.len() != expected {
            return Err(RobotError::EncoderCount { found: self.encoders.len(), expected });
        }
        self.terms.check(self.chain.joint_kinds())?;
        if !self.tolerances.are_of(expected) {
            return Err(RobotError::Tolerances { joints: expected });
        }
        match self.limits.iter().position(|limits| !limits.are_a_range()) {
            Some(i) => Err(RobotError::Limits { joint: i + 1, limits: self.limits[i] }),
            None => Ok(self),
        }
    }

    /// Its chain with the terms of its joints, ready to compute with.
    pub fn kinematics(&self) -> Kinematics<f64> {
        Kinematics::with_terms(&self.chain, &self.terms)
    }

    /// What the fit behind this robot was found to be; `None` for a design, and for a file that does not say.
    pub fn verdict(&self) -> Option<CalibrationVerdict> {
        self.calibration.as_ref().and_then(|calibration| calibration.verdict)
    }

    /// What this robot's parameters are.
    pub fn standing(&self) -> Standing {
        match (&self.calibration, self.verdict()) {
            (_, Some(CalibrationVerdict::Calibrated)) => Standing::Calibrated,
            (_, Some(CalibrationVerdict::Reserved)) => Standing::Reserved,
            (Some(_), None) => Standing::NotJudged,
            (None, None) => Standing::Design,
        }
    }

    /// Joints of an encoder vector (radians or metres) that stand beyond their limits.
    pub fn beyond_limits<'a>(&'a self, q: &'a [f64]) -> impl Iterator<Item = BeyondLimits> + 'a {
        let joints = self.limits.iter().zip(self.chain.joint_kinds()).zip(q).enumerate();
        let beyond = joints.filter(|(_, ((limits, _), q))| !limits.contain(**q));
        beyond.map(|(i, ((&limits, &kind), &q))| BeyondLimits { joint: i + 1, kind, q, limits })
    }
}

/// What a robot's parameters are, by what is kept of the fit behind them: the one rule of who may rely on them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// No fit made them.
    Design,
    /// A fit made them, and nothing says that it was good.
    NotJudged,
    /// A good fit made them, and something weighs on it.
    Reserved,
    /// A good fit made them, and nothing stands against it.
    Calibrated,
}

impl Standing {
    /// Whether the fit was found to be good, with reservations or without.
    pub fn is_calibrated(self) -> bool {
        matches!(self, Self::Calibrated | Self::Reserved)
    }
}

impl fmt::Display for Standing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Design => "design, not calibrated",
            Self::NotJudged => "fitted, but not found to be calibrated",
            Self::Reserved => "calibrated, with reservations",
            Self::Calibrated => "calibrated",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ballbar::JointKind;

    fn chain() -> Chain<f64> {
        Chain::new(&[JointKind::Revolute, JointKind::Prismatic], &[0.0; 22]).unwrap()
    }

    #[test]
    fn each_joint_has_limits_that_are_a_range() {
        let good = JointLimits { min: -1.0, max: 1.0 };
        let robot = |limits: &[JointLimits]| Robot::new("arm", chain(), limits.to_vec());
        let made = robot(&[good, good]).unwrap();
        assert_eq!((made.source.as_str(), made.encoders.len(), made.standing()), ("arm", 2, Standing::Design));
        assert_eq!(robot(&[good]).unwrap_err(), RobotError::LimitCount { found: 1, expected: 2 });
        for (min, max) in [(1.0, -1.0), (1.0, 1.0), (f64::NEG_INFINITY, 1.0), (0.0, f64::INFINITY)] {
            let limits = JointLimits { min, max };
            assert_eq!(robot(&[good, limits]).unwrap_err(), RobotError::Limits { joint: 2, limits });
        }
        assert!(robot(&[JointLimits { min: f64::NAN, max: 1.0 }, good]).is_err());
    }
}
