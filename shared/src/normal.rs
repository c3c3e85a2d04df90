//! Incremental normal equations `JᵀWJ Δp = JᵀWf` over any subset of a chain's parameters.

use core::fmt;

use heapless::Vec;

use crate::{MAX_PARAMETERS, Real, Row};

/// Entries of a packed triangle over all parameters.
pub(crate) const PACKED: usize = MAX_PARAMETERS * (MAX_PARAMETERS + 1) / 2;

/// The parameters that a solve may change: indices in ascending order, none twice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FreeParameters(Vec<u8, MAX_PARAMETERS>);

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
        let mut free: Vec<u8, MAX_PARAMETERS> = Vec::new();
        for index in indices {
            let ascends = free.last().is_none_or(|&last| usize::from(last) < index);
            if index >= MAX_PARAMETERS || !ascends || free.push(index as u8).is_err() {
                return Err(FreeParametersError { index });
            }
        }
        Ok(Self(free))
    }

    /// Those of the first `count` parameters whose index `is_free` admits.
    pub fn filtered(count: usize, is_free: impl Fn(usize) -> bool) -> Self {
        Self((0..count.min(MAX_PARAMETERS)).filter(|&index| is_free(index)).map(|index| index as u8).collect())
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

/// Two accumulators are over different parameters and cannot be merged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FreeSetMismatch;

impl fmt::Display for FreeSetMismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the two normal equations are over different free parameters")
    }
}

impl core::error::Error for FreeSetMismatch {}

/// `JᵀWJ` (packed), `JᵀWf` and `Σ w f²`, gathered row by row; no row is kept.
///
/// 10 KiB in `f32`, 20 KiB in `f64`: keep it in a static or a box, not on a small stack.
#[derive(Clone, Debug)]
pub struct NormalEquations<S> {
    free: FreeParameters,
    /// Lower triangle by rows: entry (i, j ≤ i) at i(i+1)/2 + j.
    packed: [S; PACKED],
    gradient: Row<S>,
    cost: S,
    weight: S,
    rows: usize,
}

impl<S: Real> NormalEquations<S> {
    /// Empty equations over the free parameters.
    pub fn new(free: FreeParameters) -> Self {
        Self {
            free,
            packed: [S::zero(); PACKED],
            gradient: [S::zero(); MAX_PARAMETERS],
            cost: S::zero(),
            weight: S::zero(),
            rows: 0,
        }
    }

    /// Forgets all rows.
    pub fn clear(&mut self) {
        let n = self.free.len();
        self.packed[..n * (n + 1) / 2].fill(S::zero());
        self.gradient[..n].fill(S::zero());
        self.cost = S::zero();
        self.weight = S::zero();
        self.rows = 0;
    }

    /// Adds one row of J (over all parameters; the free ones are picked here), its residual in metres and its weight.
    pub fn add(&mut self, row: &Row<S>, residual_m: S, weight: S) {
        let n = self.free.len();
        let mut columns = [S::zero(); MAX_PARAMETERS];
        for (column, index) in columns.iter_mut().zip(self.free.indices()) {
            *column = row[index];
        }
        let columns = &columns[..n];

        // The hot loop of a fit: n(n+1)/2 multiply-adds, each inner run contiguous so that it vectorises.
        let mut rest = &mut self.packed[..];
        for (i, &column) in columns.iter().enumerate() {
            let (line, below) = rest.split_at_mut(i + 1);
            let weighted = weight * column;
            for (entry, &other) in line.iter_mut().zip(columns) {
                *entry += weighted * other;
            }
            rest = below;
        }

        let weighted_residual = weight * residual_m;
        for (entry, &column) in self.gradient.iter_mut().zip(columns) {
            *entry += weighted_residual * column;
        }
        self.cost += weighted_residual * residual_m;
        self.weight += weight;
        self.rows += 1;
    }

    /// Adds all rows of `other`, as if they had been added here.
    ///
    /// # Errors
    /// [`FreeSetMismatch`] when the two are over different parameters; nothing is added then.
    pub fn merge(&mut self, other: &Self) -> Result<(), FreeSetMismatch> {
        if self.free != other.free {
            return Err(FreeSetMismatch);
        }
        let n = self.free.len();
        for (entry, &more) in self.packed[..n * (n + 1) / 2].iter_mut().zip(&other.packed) {
            *entry += more;
        }
        for (entry, &more) in self.gradient[..n].iter_mut().zip(&other.gradient) {
            *entry += more;
        }
        self.cost += other.cost;
        self.weight += other.weight;
        self.rows += other.rows;
        Ok(())
    }

    /// The free parameters, in the order of the equations.
    pub fn free(&self) -> &FreeParameters {
        &self.free
    }

    /// Entry (i, j) of `JᵀWJ`, counted over the free parameters; `None` beyond them.
    pub fn entry(&self, i: usize, j: usize) -> Option<S> {
        let (i, j) = (i.max(j), i.min(j));
        (i < self.free.len()).then(|| self.packed[i * (i + 1) / 2 + j])
    }

    /// `JᵀWf`, over the free parameters: half the direction of steepest descent of the cost.
    pub fn gradient(&self) -> &[S] {
        &self.gradient[..self.free.len()]
    }

    /// `Σ w f²`, square metres times the weights' unit (φ in the paper's eq. 4).
    pub fn cost(&self) -> S {
        self.cost
    }

    /// `Σ w`.
    pub fn weight(&self) -> S {
        self.weight
    }

    /// Rows added.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The packed lower triangle, by rows.
    pub(crate) fn packed(&self) -> &[S] {
        let n = self.free.len();
        &self.packed[..n * (n + 1) / 2]
    }

    /// The diagonal of `JᵀWJ`: the squared norm of every free column.
    pub(crate) fn diagonal(&self) -> impl Iterator<Item = S> + '_ {
        (0..self.free.len()).map(|i| self.packed[i * (i + 1) / 2 + i])
    }
}
