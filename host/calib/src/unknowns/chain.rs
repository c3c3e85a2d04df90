//! The kinematic parameters of a chain: 8·J + 6, of which lengths tell at most `N = 5 nr + 3 np + 6`.

use std::ops::Range;

use ballbar::{Chain, PARAMETERS_OF_LAST_LINK, Parameter, ParameterUnit};

use super::Unknown;

/// How far a design value may plausibly be off, SI: 5 mm, 0.5°, 0.5 %; a signal's latency by 5 ms. A parameter whose standard deviation from
/// some poses would exceed this is better left at its design value, which tells more than the poses do.
pub fn plausible_error(unit: ParameterUnit) -> f64 {
    match unit {
        ParameterUnit::Metre => 5e-3,
        ParameterUnit::Radian => 0.5_f64.to_radians(),
        ParameterUnit::One => 5e-3,
        ParameterUnit::Second => 5e-3,
    }
}

/// The parameters of a design, in parameter order. Unlike other blocks it does not correct measurements: it is what they are compared with, and
/// the sweep down the chain gives its columns.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ChainBlock {
    design: Chain<f64>,
}

impl ChainBlock {
    /// The parameters of a design.
    pub fn new(design: Chain<f64>) -> Self {
        Self { design }
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
