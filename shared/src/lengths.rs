//! Lengths as a least-squares problem over a chain's parameters: what a board can fit by itself.

use core::fmt;

use crate::normal::NormalEquations;
use crate::rows::{LANES, LengthRows};
use crate::{Chain, Kinematics, MAX_PARAMETERS, Measurement, Problem, Real};

/// The parameters of a chain that a solve may change: indices in ascending order, none twice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FreeParameters(heapless::Vec<u8, MAX_PARAMETERS>);

/// Why a set of free parameters could not be made: the index repeats, is out of order or is beyond [`MAX_PARAMETERS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FreeParametersError {
    /// The offending index.
    pub index: usize,
}

impl fmt::Display for FreeParametersError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "free parameter {} repeats, is out of order or is beyond {MAX_PARAMETERS}", self.index)
    }
}

impl core::error::Error for FreeParametersError {}

impl FreeParameters {
    /// The first `count` parameters, at most [`MAX_PARAMETERS`]: all of a chain's when `count` is its parameter count.
    pub fn all(count: usize) -> Self {
        Self((0..count.min(MAX_PARAMETERS)).map(|index| index as u8).collect())
    }

    /// The parameters at `indices`, which must ascend.
    ///
    /// # Errors
    /// [`FreeParametersError`] with the first index that does not ascend or that no chain has.
    pub fn from_indices(indices: impl IntoIterator<Item = usize>) -> Result<Self, FreeParametersError> {
        let mut free: heapless::Vec<u8, MAX_PARAMETERS> = heapless::Vec::new();
        for index in indices {
            let ascends = free.last().is_none_or(|&last| usize::from(last) < index);
            if index >= MAX_PARAMETERS || !ascends || free.push(index as u8).is_err() {
                return Err(FreeParametersError { index });
            }
        }
        Ok(Self(free))
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether nothing is free.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The indices, ascending.
    pub fn indices(&self) -> impl ExactSizeIterator<Item = usize> + '_ {
        self.0.iter().map(|&index| usize::from(index))
    }

    /// Whether the parameter at `index` is free.
    pub fn contains(&self, index: usize) -> bool {
        self.indices().any(|free| free == index)
    }
}

/// `Σ w (d_measured − d_computed)²` over the free parameters of a chain.
#[derive(Clone, Copy, Debug)]
pub struct Lengths<'a, I> {
    /// What was measured: an iterator that is begun anew for every step.
    pub measurements: I,
    /// Parameters that may change.
    pub free: &'a FreeParameters,
}

impl<S: Real, I: Iterator<Item = Measurement<S>> + Clone> Problem<S> for Lengths<'_, I> {
    type Values = Chain<S>;

    fn unknowns(&self) -> usize {
        self.free.len()
    }

    fn add_to(&self, chain: &Chain<S>, equations: &mut NormalEquations<'_, S>) {
        let kinematics = Kinematics::new(chain);
        let mut rows = LengthRows::default();
        let mut columns = [[S::zero(); LANES]; MAX_PARAMETERS];
        let mut measurements = self.measurements.clone();
        loop {
            let block: heapless::Vec<Measurement<S>, LANES> = measurements.by_ref().take(LANES).collect();
            if block.is_empty() {
                return;
            }
            rows.compute(&kinematics, &block);
            for (column, index) in columns.iter_mut().zip(self.free.indices()) {
                *column = *rows.chain(index);
            }
            equations.add(&rows.over(&columns[..self.free.len()]));
        }
    }

    fn moved(&self, chain: &Chain<S>, change: &[S]) -> Chain<S> {
        let mut moved = chain.clone();
        for (index, &by) in self.free.indices().zip(change) {
            if let Some(value) = moved.parameters_mut().get_mut(index) {
                *value += by;
            }
        }
        moved
    }
}
