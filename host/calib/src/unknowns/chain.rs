//! The kinematic parameters of a chain: 8·J + 6, of which lengths tell at most `N = 5 nr + 3 np + 6`.

use std::ops::Range;

use ballbar::{Chain, JointTerms, JointVector, Kinematics, PARAMETERS_OF_LAST_LINK, Parameter, ParameterUnit};

use super::Unknown;
use crate::model::PoseRow;

/// How far a design value may plausibly be off, SI: 5 mm, 0.5°, 0.5 %; a signal's latency by 5 ms, a joint's compliance by
/// 1e-4 rad/Nm or 1e-5 m/N. A parameter whose standard deviation from
/// some poses would exceed this is better left at its design value, which tells more than the poses do.
pub fn plausible_error(unit: ParameterUnit) -> f64 {
    match unit {
        ParameterUnit::Metre => 5e-3,
        ParameterUnit::Radian => 0.5_f64.to_radians(),
        ParameterUnit::One => 5e-3,
        ParameterUnit::Second => 5e-3,
        ParameterUnit::RadianPerNewtonMetre => 1e-4,
        ParameterUnit::MetrePerNewton => 1e-5,
    }
}

/// The parameters of a design, in parameter order, with the terms that its joints are known to have. Other blocks correct measurements: this
/// is what they are compared with, and the sweep down the chain gives its columns.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(from = "Written", into = "Written"))]
pub struct ChainBlock {
    design: Chain<f64>,
    terms: JointTerms<f64>,
    rigid: Kinematics<f64>,
}

/// What a block is made from.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct Written {
    design: Chain<f64>,
    #[serde(default = "JointTerms::none")]
    terms: JointTerms<f64>,
}

#[cfg(feature = "serde")]
impl From<Written> for ChainBlock {
    fn from(Written { design, terms }: Written) -> Self {
        Self::new(design, terms)
    }
}

#[cfg(feature = "serde")]
impl From<ChainBlock> for Written {
    fn from(ChainBlock { design, terms, .. }: ChainBlock) -> Self {
        Self { design, terms }
    }
}

impl ChainBlock {
    /// The parameters of a design whose joints have these terms.
    pub fn new(design: Chain<f64>, terms: JointTerms<f64>) -> Self {
        Self { rigid: Kinematics::new(&design), design, terms }
    }

    /// What gravity does to the design's joints, Nm or N.
    pub(super) fn loads(&self, q: &JointVector<f64>) -> JointVector<f64> {
        self.rigid.gravity_loads(&self.terms.masses, q)
    }

    /// What the known terms add to the joints' angles where a row was measured, radians or metres.
    pub(super) fn displacements(&self, row: &PoseRow) -> JointVector<f64> {
        let q = &row.measurement.q;
        self.terms.displacements(q, &self.terms.loads(&self.rigid, q), row.approach)
    }

    /// The design.
    pub fn design(&self) -> &Chain<f64> {
        &self.design
    }

    /// How many there are, 8·J + 6.
    pub fn len(&self) -> usize {
        self.design.parameter_count()
    }

    /// A chain has parameters.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// The unknowns, in parameter order.
    pub fn unknowns(&self) -> Vec<Unknown> {
        let unknown = |(index, &start): (usize, &f64)| {
            let parameter = Parameter::from_index(index);
            let unit = self.design.unit(parameter);
            Unknown { name: parameter.to_string(), unit, start, tolerance: None, plausible: plausible_error(unit) }
        };
        self.design.parameters().iter().enumerate().map(unknown).collect()
    }

    /// Those that say where the robot stands: position and orientation of its first link.
    pub fn of_base(&self) -> Range<usize> {
        0..PARAMETERS_OF_LAST_LINK
    }

    /// Whether the paper holds the unknown at this index; false beyond the chain's.
    pub fn is_held_in_paper(&self, index: usize) -> bool {
        index < self.len() && self.design.is_conventionally_held(Parameter::from_index(index))
    }

    /// The chain at these values, of which the first are its own.
    pub(super) fn at(&self, values: &[f64]) -> Chain<f64> {
        let mut chain = self.design.clone();
        let own = chain.parameters_mut();
        own.copy_from_slice(&values[..own.len()]);
        chain
    }
}
