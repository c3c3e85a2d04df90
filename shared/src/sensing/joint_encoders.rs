//! Counts to joint values and back, with couplings between joints.

use core::fmt;
use core::ops::RangeInclusive;

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::{JointVector, MAX_JOINTS, Real};

/// The most couplings that a robot may have: a wrist of three joints has three.
pub const MAX_COUPLINGS: usize = 8;

/// How one joint's encoder counts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Encoder<S> {
    /// Counts after quadrature and gearing per radian or metre of the joint; negative when counts fall as the joint rises.
    pub counts_per_unit: S,
    /// Counts from one index pulse to the next; 0 when the encoder has none.
    pub counts_per_index: u32,
}

/// A joint that is turned along by one nearer to the base: its value is its own encoder's plus `ratio` times the other's value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Coupling<S> {
    /// The joint that is turned along, from 0.
    pub joint: u8,
    /// The joint that turns it, from 0, nearer to the base.
    pub driven_by: u8,
    /// Turn of the one per turn of the other.
    pub ratio: S,
}

/// The map between encoder positions and joint values q of a robot.
#[derive(Clone, Debug, PartialEq)]
pub struct JointEncoders<S> {
    encoders: Vec<Encoder<S>, MAX_JOINTS>,
    couplings: Vec<Coupling<S>, MAX_COUPLINGS>,
}

/// Why encoders cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum EncoderError {
    /// More encoders or couplings than there may be.
    TooMany,
    /// Counts per unit of this joint (from 0) are no number, or of a size at which nobody can count: a count is more than a radian or
    /// metre, or all of a counter's range is less.
    CountsPerUnit {
        /// The joint.
        joint: u8,
    },
    /// A coupling of this joint (from 0) names no joint nearer to the base, or its ratio is no number or larger than 10,000 (a screw
    /// of 5 mm a turn makes 1,257 radians of a metre).
    Coupling {
        /// The joint.
        joint: u8,
    },
}

impl fmt::Display for EncoderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooMany => write!(f, "more than {MAX_JOINTS} encoders or {MAX_COUPLINGS} couplings"),
            Self::CountsPerUnit { joint } => {
                write!(f, "joint {}: counts per radian or metre must be 1 to 2^31 in size", joint.saturating_add(1))
            }
            Self::Coupling { joint } => {
                let joint = joint.saturating_add(1);
                write!(f, "joint {joint}: a coupling must name a joint nearer to the base and a ratio of at most 10,000 in size")
            }
        }
    }
}

impl core::error::Error for EncoderError {}

/// Counts per radian or metre that make sense, in size.
const COUNTS_PER_UNIT: RangeInclusive<f64> = 1.0..=2_147_483_648.0;
/// The largest ratio of a coupling, in size.
const MAX_RATIO: f64 = 1e4;

impl<S: Real> JointEncoders<S> {
    /// The encoders of joints 1, 2, …, and what turns what along.
    ///
    /// # Errors
    /// [`EncoderError`] for counts per unit or ratios that no robot has, and couplings towards the tool.
    pub fn new(encoders: &[Encoder<S>], couplings: &[Coupling<S>]) -> Result<Self, EncoderError> {
        for (joint, encoder) in encoders.iter().enumerate() {
            let size = encoder.counts_per_unit.abs();
            if !(size >= S::nearest(*COUNTS_PER_UNIT.start()) && size <= S::nearest(*COUNTS_PER_UNIT.end())) {
                return Err(EncoderError::CountsPerUnit { joint: joint as u8 });
            }
        }
        for coupling in couplings {
            let is_joint = usize::from(coupling.joint) < encoders.len();
            let is_plausible = coupling.ratio.abs() <= S::nearest(MAX_RATIO);
            if !is_joint || coupling.driven_by >= coupling.joint || !is_plausible {
                return Err(EncoderError::Coupling { joint: coupling.joint });
            }
        }
        // Values are made from the base outwards, so a joint's own couplings must be done before it turns others along. Eight at most
        // are put in their places one by one: a sort of the standard library takes 8 KiB of the board's flash.
        let mut ordered: Vec<Coupling<S>, MAX_COUPLINGS> = Vec::new();
        for coupling in couplings {
            let is_later = |other: &Coupling<S>| (other.joint, other.driven_by) > (coupling.joint, coupling.driven_by);
            let place = ordered.iter().position(is_later).unwrap_or(ordered.len());
            ordered.insert(place, *coupling).map_err(|_| EncoderError::TooMany)?;
        }
        Ok(Self { encoders: Vec::from_slice(encoders).map_err(|_| EncoderError::TooMany)?, couplings: ordered })
    }

    /// Joint values q, radians or metres, at encoder positions in counts; joints without a position stay at zero.
    pub fn q(&self, counts: impl IntoIterator<Item = S>) -> JointVector<S> {
        let mut q = JointVector::zero();
        for ((value, encoder), counts) in q.as_array_mut().iter_mut().zip(&self.encoders).zip(counts) {
            *value = counts / encoder.counts_per_unit;
        }
        for coupling in &self.couplings {
            let turned = q.as_array()[usize::from(coupling.driven_by)] * coupling.ratio;
            q.as_array_mut()[usize::from(coupling.joint)] += turned;
        }
        q
    }

    /// Encoder positions in counts at joint values q; entries beyond the joints are zero.
    pub fn counts(&self, q: &JointVector<S>) -> [S; MAX_JOINTS] {
        let mut own = *q.as_array();
        for coupling in &self.couplings {
            own[usize::from(coupling.joint)] -= q.as_array()[usize::from(coupling.driven_by)] * coupling.ratio;
        }
        let mut counts = [S::zero(); MAX_JOINTS];
        for ((counts, own), encoder) in counts.iter_mut().zip(own).zip(&self.encoders) {
            *counts = own * encoder.counts_per_unit;
        }
        counts
    }

    /// The encoders, joint by joint.
    pub fn encoders(&self) -> &[Encoder<S>] {
        &self.encoders
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wrist() -> JointEncoders<f64> {
        let encoder = |counts_per_unit| Encoder { counts_per_unit, counts_per_index: 1000 };
        let coupling = |joint, driven_by, ratio| Coupling { joint, driven_by, ratio };
        // Given out of order on purpose.
        let couplings = [coupling(2, 1, 0.18), coupling(1, 0, -0.014), coupling(2, 0, -0.01)];
        JointEncoders::new(&[encoder(12_101.0), encoder(-11_447.0), encoder(12_205.0)], &couplings).unwrap()
    }

    #[test]
    fn a_coupled_joint_adds_what_turns_it_along() {
        let q = wrist().q([12_101.0, 11_447.0, 12_205.0]);
        let q2 = -1.0 - 0.014;
        assert!((q.as_array()[1] - q2).abs() < 1e-15);
        assert!((q.as_array()[2] - (1.0 + 0.18 * q2 - 0.01)).abs() < 1e-15);
    }

    #[test]
    fn counts_lead_back_to_the_joint_values() {
        let mut q = JointVector::zero();
        q.as_array_mut()[..3].copy_from_slice(&[0.7, -1.9, 2.6]);
        let back = wrist().q(wrist().counts(&q));
        for (a, b) in back.as_array().iter().zip(q.as_array()) {
            assert!((a - b).abs() < 1e-12);
        }
    }

    #[test]
    fn encoders_that_cannot_be_computed_with_are_refused() {
        let good = Encoder { counts_per_unit: 1.0_f32, counts_per_index: 0 };
        let coupling = |joint, driven_by, ratio| Coupling { joint, driven_by, ratio };
        for bad in [0.0, -0.0, 1e-30, 0.99, -0.99, 2.2e9, 1e30, f32::MAX, f32::MIN, f32::NAN, f32::INFINITY] {
            let encoder = Encoder { counts_per_unit: bad, ..good };
            assert_eq!(JointEncoders::new(&[good, encoder], &[]), Err(EncoderError::CountsPerUnit { joint: 1 }));
        }
        for bad in
            [coupling(1, 1, 0.1), coupling(0, 1, 0.1), coupling(2, 0, 0.1), coupling(1, 0, f32::NAN), coupling(1, 0, -1e30)]
        {
            assert_eq!(JointEncoders::new(&[good, good], &[bad]), Err(EncoderError::Coupling { joint: bad.joint }));
        }
        assert_eq!(JointEncoders::new(&[good; 9], &[]), Err(EncoderError::TooMany));
        assert_eq!(JointEncoders::new(&[good; 2], &[coupling(1, 0, 0.1); 9]), Err(EncoderError::TooMany));
    }
}
