//! What a joint's angle has beside `offset + scale · q`: `Σ_k a_k φ_k(q, load, direction)`.
//!
//! | term | `φ` | stands for |
//! | --- | --- | --- |
//! | eccentricity | `sin q`, `cos q`, `sin 2q`, `cos 2q` | an encoder's disc off its axis, and an axis off its bearing; revolute joints only |
//! | compliance | gravity's moment (Nm) or force (N) on the joint | a gear and a link that yield to it |
//! | backlash | −1 when the joint came up, +1 when it came down, 0 when nobody knows | half of a gap, by which the joint lags behind its encoder |
//!
//! Every `a_k` enters linearly, so that its column is the offset's column times `φ_k`. That is exact while loads are held fixed;
//! they depend on the parameters by so little that a fit computes them once ([`Kinematics::gravity_loads`]).

use core::fmt;

use nalgebra::Scalar;
use serde::{Deserialize, Serialize};

use crate::{Approach, JointKind, JointVector, Kinematics, MAX_JOINTS, Masses, Number, Real};

/// Terms of a joint.
pub const TERMS_PER_JOINT: usize = 6;

/// One of a joint's terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TermKind {
    /// Eccentricity, `sin q`.
    SinQ,
    /// Eccentricity, `cos q`.
    CosQ,
    /// Eccentricity, `sin 2q`.
    Sin2Q,
    /// Eccentricity, `cos 2q`.
    Cos2Q,
    /// Angle or travel per moment or force.
    Compliance,
    /// Half of the gap.
    Backlash,
}

impl TermKind {
    /// All, in the order in which their values are kept.
    pub const ALL: [Self; TERMS_PER_JOINT] = [Self::SinQ, Self::CosQ, Self::Sin2Q, Self::Cos2Q, Self::Compliance, Self::Backlash];

    /// The name of an unknown is this and the number of the joint.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SinQ => "sin_q",
            Self::CosQ => "cos_q",
            Self::Sin2Q => "sin_2q",
            Self::Cos2Q => "cos_2q",
            Self::Compliance => "compliance",
            Self::Backlash => "backlash",
        }
    }

    /// Whether the encoder's disc makes it, which a prismatic joint does not have.
    pub const fn is_eccentricity(self) -> bool {
        matches!(self, Self::SinQ | Self::CosQ | Self::Sin2Q | Self::Cos2Q)
    }

    /// The largest size that is taken for one: 0.1 rad or m, and as much for 10 Nm or N.
    const fn largest(self) -> f64 {
        match self {
            Self::Compliance => 0.01,
            _ => 0.1,
        }
    }
}

/// `φ` of each term of one joint, in [`TermKind::ALL`]'s order, at encoder output `q`, under a load (Nm or N), approached in a
/// direction ([`Approach::sign`]).
pub fn term_basis<S: Number>(q: S, load: S, direction: S) -> [S; TERMS_PER_JOINT] {
    let (sin, cos) = q.sine_cosine();
    let two = S::one() + S::one();
    [sin, cos, two * sin * cos, S::one() - two * sin * sin, load, -direction]
}

/// The terms of all joints of a chain, and the masses whose weight they bear.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "S: Scalar + Serialize", deserialize = "S: Scalar + Deserialize<'de>"))]
pub struct JointTerms<S> {
    pub(crate) coefficients: [[S; TERMS_PER_JOINT]; MAX_JOINTS],
    /// What pulls at the joints.
    pub masses: Masses<S>,
}

/// Why terms are not those of a chain. Joints count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TermsError {
    /// The coefficient is no number, or larger than any joint has: 0.1 rad or m, compliance 0.01 rad/Nm or m/N.
    Size {
        /// The joint.
        joint: u8,
        /// Its term.
        term: TermKind,
    },
    /// A prismatic joint has no disc that could be eccentric.
    EccentricSlide {
        /// The joint.
        joint: u8,
    },
    /// Compliance of a joint of which no mass is known that it bears.
    NoLoad {
        /// The joint.
        joint: u8,
    },
    /// A term of a joint that the chain does not have, or a link behind it.
    NoSuchJoint {
        /// The joint.
        joint: u8,
    },
    /// A mass is below zero, no number, or above 100 t, or its centre lies more than 100 m from its frame. Link `joint + 2`, or the payload,
    /// which follows the last of them.
    Mass {
        /// The joint that moves it, or the number of joints for the payload.
        joint: u8,
    },
    /// Gravity is no number or above 100 m/s².
    Gravity,
}

impl fmt::Display for TermsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Size { joint, term } => write!(
                f,
                "{}{} is out of range: {} in size at most, in rad, m, rad/Nm or m/N",
                term.name(),
                usize::from(joint) + 1,
                term.largest()
            ),
            Self::EccentricSlide { joint } => {
                write!(f, "joint {} is prismatic and can have no eccentricity", usize::from(joint) + 1)
            }
            Self::NoLoad { joint } => {
                write!(f, "joint {} has a compliance, but no mass is known that it bears", usize::from(joint) + 1)
            }
            Self::NoSuchJoint { joint } => write!(f, "terms of joint {}, which is not there", usize::from(joint) + 1),
            Self::Mass { joint } => {
                write!(f, "the mass behind joint {} is not within 0 to 100 t, or not within 100 m of it", usize::from(joint) + 1)
            }
            Self::Gravity => f.write_str("gravity is not within 100 m/s²"),
        }
    }
}

impl core::error::Error for TermsError {}

impl<S: Number> JointTerms<S> {
    /// No terms and no masses.
    pub fn none() -> Self {
        Self { coefficients: [[S::zero(); TERMS_PER_JOINT]; MAX_JOINTS], masses: Masses::none() }
    }

    /// Whether all coefficients are zero: the angles are `offset + scale · q`.
    pub fn are_zero(&self) -> bool {
        (0..MAX_JOINTS).all(|joint| self.is_plain(joint))
    }

    /// Whether a joint has no terms. Not inlined, so that it is in the board's flash once.
    #[inline(never)]
    fn is_plain(&self, joint: usize) -> bool {
        self.of_joint(joint).iter().all(|value| *value == S::zero())
    }

    /// Coefficient `a` of a term of joint `joint`, from 0: radians or metres, of compliance per Nm or N. Zero beyond [`MAX_JOINTS`].
    pub fn coefficient(&self, joint: usize, term: TermKind) -> S {
        self.coefficients.get(joint).map_or(S::zero(), |of_joint| of_joint[term as usize])
    }

    /// The coefficients of joint `joint`, from 0, in [`TermKind::ALL`]'s order; zero beyond [`MAX_JOINTS`].
    pub fn of_joint(&self, joint: usize) -> [S; TERMS_PER_JOINT] {
        self.coefficients.get(joint).copied().unwrap_or([S::zero(); TERMS_PER_JOINT])
    }

    /// Sets a coefficient; joints from [`MAX_JOINTS`] on are passed over. Taken as it is; [`JointTerms::check`] looks at all of them.
    pub fn set_coefficient(&mut self, joint: usize, term: TermKind, value: S) {
        if let Some(of_joint) = self.coefficients.get_mut(joint) {
            of_joint[term as usize] = value;
        }
    }

    /// What the terms add to θ of each joint, radians or metres, at encoder outputs `q`, under `loads`
    /// ([`Kinematics::gravity_loads`]), approached so.
    pub fn displacements(&self, q: &JointVector<S>, loads: &JointVector<S>, approach: Approach) -> JointVector<S> {
        let mut displacements = JointVector::zero();
        for (i, (displacement, coefficients)) in displacements.0.iter_mut().zip(&self.coefficients).enumerate() {
            let basis = term_basis(q.0[i], loads.0[i], approach.sign(i));
            *displacement = coefficients.iter().zip(basis).fold(S::zero(), |sum, (a, phi)| sum + *a * phi);
        }
        displacements
    }

    /// The loads that [`JointTerms::displacements`] takes; not computed, and zero, where no joint yields to them.
    pub fn loads(&self, kinematics: &Kinematics<S>, q: &JointVector<S>) -> JointVector<S> {
        let yields = |of_joint: &[S; TERMS_PER_JOINT]| of_joint[TermKind::Compliance as usize] != S::zero();
        if self.coefficients.iter().any(yields) { kinematics.gravity_loads(&self.masses, q) } else { JointVector::zero() }
    }
}

impl<S: Real> JointTerms<S> {
    /// Whether these can be the terms of a chain of such joints.
    ///
    /// # Errors
    /// [`TermsError`] with the first thing that is wrong.
    pub fn check(&self, kinds: &[JointKind]) -> Result<(), TermsError> {
        self.check_masses(kinds.len())?;
        (0..MAX_JOINTS * TERMS_PER_JOINT)
            .try_for_each(|i| self.check_coefficient(kinds, i / TERMS_PER_JOINT, TermKind::ALL[i % TERMS_PER_JOINT]))
    }

    /// Not inlined, so that it is in the board's flash once and not unrolled.
    #[inline(never)]
    fn check_coefficient(&self, kinds: &[JointKind], i: usize, term: TermKind) -> Result<(), TermsError> {
        let (value, joint) = (self.coefficient(i, term), i as u8);
        // What is not a number is not within it.
        let is_small = value.abs() <= S::nearest(term.largest());
        match kinds.get(i) {
            _ if value == S::zero() => Ok(()),
            None => Err(TermsError::NoSuchJoint { joint }),
            Some(JointKind::Prismatic) if term.is_eccentricity() => Err(TermsError::EccentricSlide { joint }),
            _ if !is_small => Err(TermsError::Size { joint, term }),
            _ if term == TermKind::Compliance && !self.masses.load_joint(i) => Err(TermsError::NoLoad { joint }),
            _ => Ok(()),
        }
    }

    fn check_masses(&self, joints: usize) -> Result<(), TermsError> {
        const MAX_MASS_KG: f64 = 1e5;
        // As far as a frame may be written from its link.
        const MAX_CENTER_M: f64 = 1e3;
        const MAX_GRAVITY_M_S2: f64 = 100.0;
        for (joint, body) in self.masses.links.iter().chain([&self.masses.payload]).enumerate() {
            let is_possible = body.mass_kg >= S::zero()
                && body.mass_kg <= S::nearest(MAX_MASS_KG)
                && body.center_m.norm() <= S::nearest(MAX_CENTER_M);
            if !is_possible {
                return Err(TermsError::Mass { joint: joint.min(joints) as u8 });
            }
            if joint >= joints && joint < MAX_JOINTS && body.mass_kg > S::zero() {
                return Err(TermsError::NoSuchJoint { joint: joint as u8 });
            }
        }
        let is_possible = self.masses.gravity_base_m_s2.norm() <= S::nearest(MAX_GRAVITY_M_S2);
        is_possible.then_some(()).ok_or(TermsError::Gravity)
    }

    /// The same in another precision.
    pub fn cast<T: Real>(&self) -> JointTerms<T> {
        let coefficients = self.coefficients.map(|of_joint| of_joint.map(|value| T::nearest(value.widen())));
        JointTerms { coefficients, masses: self.masses.cast() }
    }
}
