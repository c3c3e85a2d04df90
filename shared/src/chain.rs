//! The Sheth-Uicker chain: its links, joints and parameters.

use core::fmt;

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::{
    MAX_JOINTS, MAX_PARAMETERS, Number, PARAMETERS_OF_LAST_LINK, PARAMETERS_PER_JOINT, Parameter, ParameterKind, ParameterUnit,
    Real, Row, Vector3,
};

/// What a joint does along or about its z axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, Schema)]
pub enum JointKind {
    /// `J = Rz(θ)`, θ in radians.
    Revolute,
    /// `J = Trans_z(θ)`, θ in metres.
    Prismatic,
}

/// A link's fixed transform `L = Trans(x, y, z) · Rz(alpha) · Ry(beta) · Rx(gamma)`, distal frame to proximal frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "S: Real + Serialize", deserialize = "S: Real + Deserialize<'de>"))]
pub struct Link<S> {
    /// `(x, y, z)` in the proximal frame, metres.
    pub translation_m: Vector3<S>,
    /// Rotation about z, radians.
    pub alpha_rad: S,
    /// Rotation about y, radians.
    pub beta_rad: S,
    /// Rotation about x, radians.
    pub gamma_rad: S,
}

/// A joint's encoder model `θ = offset + scale · q` (the paper's eq. 2); units as the joint's kind has them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joint<S> {
    /// Revolute or prismatic.
    pub kind: JointKind,
    /// θ at encoder output zero, radians or metres.
    pub offset: S,
    /// θ per encoder output; 1 for an ideal encoder.
    pub scale: S,
}

/// Encoder outputs of all joints, radians or metres as the joint is. Made by [`Chain::joint_vector`], which checks the count.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointVector<S>(pub(crate) [S; MAX_JOINTS]);

impl<S: Number> JointVector<S> {
    /// All joints at encoder output zero.
    pub fn zero() -> Self {
        Self([S::zero(); MAX_JOINTS])
    }

    /// Whether all values are zero.
    pub fn are_zero(&self) -> bool {
        self.0.iter().all(|value| *value == S::zero())
    }

    /// The values; those beyond the chain's joints are zero.
    pub fn as_array(&self) -> &[S; MAX_JOINTS] {
        &self.0
    }

    /// The values, to change; those beyond the chain's joints have no effect.
    pub fn as_array_mut(&mut self) -> &mut [S; MAX_JOINTS] {
        &mut self.0
    }
}

impl<S: Real> JointVector<S> {
    /// The same values in another precision.
    pub fn cast<T: Real>(&self) -> JointVector<T> {
        JointVector(self.0.map(|q| T::nearest(q.widen())))
    }
}

/// A serial chain `T = L1 J1 L2 J2 … LJ JJ L(J+1)`, from the tool (end-effector) frame to the base (global) frame.
///
/// Parameters are stored flat, in the order of the paper's Table II (see [`Parameter`]): 8·J + 6 numbers, SI units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    into = "Written<S>",
    try_from = "Written<S>",
    bound(serialize = "S: Real + Serialize", deserialize = "S: Real + Deserialize<'de>")
)]
pub struct Chain<S> {
    joints: usize,
    kinds: [JointKind; MAX_JOINTS],
    parameters: Row<S>,
}

/// A chain as it is stored: what [`Chain::new`] takes, which checks it when it is read.
#[derive(Serialize, Deserialize)]
struct Written<S> {
    kinds: Vec<JointKind, MAX_JOINTS>,
    parameters: Vec<S, MAX_PARAMETERS>,
}

impl<S: Real> From<Chain<S>> for Written<S> {
    fn from(chain: Chain<S>) -> Self {
        let kinds = chain.joint_kinds().iter().copied().collect();
        Self { kinds, parameters: chain.parameters().iter().copied().collect() }
    }
}

impl<S: Real> TryFrom<Written<S>> for Chain<S> {
    type Error = ChainError;

    fn try_from(written: Written<S>) -> Result<Self, ChainError> {
        Self::new(&written.kinds, &written.parameters)
    }
}

/// Why a chain or a joint vector could not be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ChainError {
    /// A chain needs 1 to [`MAX_JOINTS`] joints.
    JointCount {
        /// Joints asked for.
        found: usize,
    },
    /// The number of parameters is not 8·J + 6.
    ParameterCount {
        /// Parameters given.
        found: usize,
        /// 8·J + 6.
        expected: usize,
    },
    /// A parameter is infinite or not a number.
    NotFinite {
        /// Which one.
        parameter: Parameter,
    },
    /// The number of joint values is not the number of joints.
    JointValues {
        /// Values given.
        found: usize,
        /// Joints of the chain.
        expected: usize,
    },
}

impl fmt::Display for ChainError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::JointCount { found } => write!(f, "{found} joints, expected 1 to {MAX_JOINTS}"),
            Self::ParameterCount { found, expected } => write!(f, "{found} parameters, expected {expected}"),
            Self::NotFinite { parameter } => write!(f, "{parameter} is not a finite number"),
            Self::JointValues { found, expected } => write!(f, "{found} joint values, expected {expected}"),
        }
    }
}

impl core::error::Error for ChainError {}

impl<S: Real> Chain<S> {
    /// A chain of the given joints with `parameters` in parameter order.
    ///
    /// # Errors
    /// [`ChainError`] when there is no joint or more than [`MAX_JOINTS`], when the parameters are not 8·J + 6, or when one
    /// is not finite.
    pub fn new(kinds: &[JointKind], parameters: &[S]) -> Result<Self, ChainError> {
        if kinds.is_empty() || kinds.len() > MAX_JOINTS {
            return Err(ChainError::JointCount { found: kinds.len() });
        }
        let expected = kinds.len() * PARAMETERS_PER_JOINT + PARAMETERS_OF_LAST_LINK;
        if parameters.len() != expected {
            return Err(ChainError::ParameterCount { found: parameters.len(), expected });
        }
        if let Some(index) = parameters.iter().position(|value| !value.is_finite()) {
            return Err(ChainError::NotFinite { parameter: Parameter::from_index(index) });
        }
        let mut chain =
            Self { joints: kinds.len(), kinds: [JointKind::Revolute; MAX_JOINTS], parameters: [S::zero(); MAX_PARAMETERS] };
        chain.kinds[..kinds.len()].copy_from_slice(kinds);
        chain.parameters[..expected].copy_from_slice(parameters);
        Ok(chain)
    }

    /// The same chain in another precision.
    pub fn cast<T: Real>(&self) -> Chain<T> {
        Chain { joints: self.joints, kinds: self.kinds, parameters: self.parameters.map(|value| T::nearest(value.widen())) }
    }
}

impl<S: Number> Chain<S> {
    /// Number of joints, J.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Kinds of the J joints, from the base.
    pub fn joint_kinds(&self) -> &[JointKind] {
        &self.kinds[..self.joints]
    }

    /// Number of parameters, 8·J + 6.
    pub fn parameter_count(&self) -> usize {
        self.joints * PARAMETERS_PER_JOINT + PARAMETERS_OF_LAST_LINK
    }

    /// The 8·J + 6 parameter values, SI units.
    pub fn parameters(&self) -> &[S] {
        &self.parameters[..self.parameter_count()]
    }

    /// The 8·J + 6 parameter values, to change. Values are taken as they are: a caller that writes infinities gets infinities.
    pub fn parameters_mut(&mut self) -> &mut [S] {
        let count = self.parameter_count();
        &mut self.parameters[..count]
    }

    /// Unit of a parameter's value.
    pub fn unit(&self, parameter: Parameter) -> ParameterUnit {
        let joint = self.kinds.get(parameter.number() - 1).copied().unwrap_or(JointKind::Revolute);
        parameter.kind().unit(joint)
    }

    /// Link `i`, counted from 0 at the base; `None` beyond J.
    pub fn link(&self, i: usize) -> Option<Link<S>> {
        let at = |kind: ParameterKind| self.parameters[i * PARAMETERS_PER_JOINT + kind as usize];
        (i <= self.joints).then(|| Link {
            translation_m: Vector3::new(at(ParameterKind::X), at(ParameterKind::Y), at(ParameterKind::Z)),
            alpha_rad: at(ParameterKind::Alpha),
            beta_rad: at(ParameterKind::Beta),
            gamma_rad: at(ParameterKind::Gamma),
        })
    }

    /// Joint `i`, counted from 0 at the base; `None` from J on.
    pub fn joint(&self, i: usize) -> Option<Joint<S>> {
        let at = |kind: ParameterKind| self.parameters[i * PARAMETERS_PER_JOINT + kind as usize];
        (i < self.joints).then(|| Joint {
            kind: self.kinds[i],
            offset: at(ParameterKind::Offset),
            scale: at(ParameterKind::Scale),
        })
    }

    /// `N = 5 nr + 3 np + 6`, the most parameters that any measurement at the tool can identify (the paper's eq. 1).
    pub fn independent_parameters(&self) -> usize {
        let joints = self.joint_kinds().iter().map(|kind| match kind {
            JointKind::Revolute => 5,
            JointKind::Prismatic => 3,
        });
        joints.sum::<usize>() + PARAMETERS_OF_LAST_LINK
    }

    /// Whether the paper's Table II holds this parameter fixed because others move the tool in the same way.
    ///
    /// Behind a revolute joint i these are `offset_i`, `z_(i+1)` and `alpha_(i+1)`. Behind a prismatic joint the translation of
    /// the next link is that of the previous one seen from another frame, so `x_(i+1)` and `y_(i+1)` join them. What stays free
    /// counts `N` (see [`Chain::independent_parameters`]).
    pub fn is_conventionally_held(&self, parameter: Parameter) -> bool {
        let kind_of_joint = |number: usize| self.joint_kinds().get(number.wrapping_sub(1));
        match parameter.kind() {
            ParameterKind::Offset => kind_of_joint(parameter.number()).is_some(),
            ParameterKind::Z | ParameterKind::Alpha => kind_of_joint(parameter.number() - 1).is_some(),
            ParameterKind::X | ParameterKind::Y => kind_of_joint(parameter.number() - 1) == Some(&JointKind::Prismatic),
            _ => false,
        }
    }

    /// The joint vector of `q`, radians or metres as each joint is.
    ///
    /// # Errors
    /// [`ChainError::JointValues`] when `q` does not have J entries.
    pub fn joint_vector(&self, q: &[S]) -> Result<JointVector<S>, ChainError> {
        if q.len() != self.joints {
            return Err(ChainError::JointValues { found: q.len(), expected: self.joints });
        }
        let mut vector = JointVector::zero();
        vector.0[..q.len()].copy_from_slice(q);
        Ok(vector)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use JointKind::{Prismatic, Revolute};
    use std::vec;
    use std::vec::Vec;

    #[test]
    fn what_stays_free_counts_the_independent_parameters() {
        let mixes: [&[JointKind]; 5] =
            [&[Revolute; 6], &[Prismatic], &[Revolute, Revolute, Prismatic, Revolute], &[Prismatic; 8], &[Prismatic, Revolute]];
        for kinds in mixes {
            let chain = Chain::new(kinds, &vec![0.0_f64; kinds.len() * 8 + 6]).unwrap();
            let free = (0..chain.parameter_count()).filter(|&i| !chain.is_conventionally_held(Parameter::from_index(i))).count();
            assert_eq!(free, chain.independent_parameters(), "{kinds:?}");
        }
    }

    #[test]
    fn the_paper_holds_eighteen_of_a_puma() {
        let chain = Chain::new(&[Revolute; 6], &[0.0_f64; 54]).unwrap();
        let held: Vec<_> = (0..54).filter(|&i| chain.is_conventionally_held(Parameter::from_index(i))).map(|i| i % 8).collect();
        assert_eq!(held, [6, 2, 3, 6, 2, 3, 6, 2, 3, 6, 2, 3, 6, 2, 3, 6, 2, 3]);
    }

    #[test]
    fn bad_chains_are_refused_by_name() {
        assert_eq!(Chain::<f64>::new(&[], &[]), Err(ChainError::JointCount { found: 0 }));
        assert_eq!(Chain::new(&[Revolute; 9], &[0.0_f32; 78]), Err(ChainError::JointCount { found: 9 }));
        assert_eq!(Chain::new(&[Revolute], &[0.0_f64; 13]), Err(ChainError::ParameterCount { found: 13, expected: 14 }));
        let mut parameters = [0.0_f64; 14];
        parameters[5] = f64::NAN;
        let parameter = "gamma1".parse().unwrap();
        assert_eq!(Chain::new(&[Revolute], &parameters), Err(ChainError::NotFinite { parameter }));
        let chain = Chain::new(&[Revolute], &[0.0_f64; 14]).unwrap();
        assert_eq!(chain.joint_vector(&[]), Err(ChainError::JointValues { found: 0, expected: 1 }));
        assert!(chain.link(1).is_some() && chain.link(2).is_none() && chain.joint(1).is_none());
    }
}
