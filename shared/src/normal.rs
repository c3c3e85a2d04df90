//! Incremental normal equations `(JᵀWJ + Λ) Δx = JᵀWf − Λ(x − x₀)` over any list of unknowns.

use core::fmt;

use crate::Real;
use crate::rows::{LANES, Lanes, Rows};

/// What was lent is too short for so many unknowns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryTooShort {
    /// Numbers that are needed.
    pub needed: usize,
    /// Numbers that were lent.
    pub lent: usize,
}

impl fmt::Display for MemoryTooShort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "memory for {} numbers, expected {} at least", self.lent, self.needed)
    }
}

impl core::error::Error for MemoryTooShort {}

/// Takes the first `count` numbers of what was lent.
pub(crate) fn take<'a, S>(lent: &mut &'a mut [S], count: usize) -> Result<&'a mut [S], MemoryTooShort> {
    if lent.len() < count {
        return Err(MemoryTooShort { needed: count, lent: lent.len() });
    }
    let (taken, rest) = core::mem::take(lent).split_at_mut(count);
    *lent = rest;
    Ok(taken)
}

/// Entries of the lower triangle of a square matrix of so many rows.
pub(crate) const fn triangle(rows: usize) -> usize {
    rows * (rows + 1) / 2
}

/// Two equations are over different numbers of unknowns and cannot be merged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SizeMismatch;

impl fmt::Display for SizeMismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the two normal equations are over different numbers of unknowns")
    }
}

impl core::error::Error for SizeMismatch {}

/// How sure the values are that unknowns had before anything was measured: the inverse of their covariance, in the unit of the weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Precision<'a, S> {
    /// One entry an unknown: `σ²/tolerance²`, σ the deviation of a measurement of weight one. Zero: not known at all.
    Diagonal(&'a [S]),
    /// The lower triangle by rows: entry (i, j ≤ i) at i(i+1)/2 + j.
    Full(&'a [S]),
}

/// `JᵀWJ + Λ` (packed), `JᵀWf − Λ(x − x₀)` and `Σ w f² + (x − x₀)ᵀΛ(x − x₀)`, gathered block by block in memory that is lent; no row is kept.
#[derive(Debug)]
pub struct NormalEquations<'a, S> {
    /// Lower triangle by rows: entry (i, j ≤ i) at i(i+1)/2 + j.
    packed: &'a mut [S],
    gradient: &'a mut [S],
    cost: S,
    prior_cost: S,
    weight: S,
    rows: usize,
}

impl<'a, S: Real> NormalEquations<'a, S> {
    /// Numbers of memory that so many unknowns need: 702 for 36, 1,539 for 54.
    pub const fn memory(unknowns: usize) -> usize {
        triangle(unknowns) + unknowns
    }

    /// Empty equations over so many unknowns, in memory that is lent.
    ///
    /// # Errors
    /// [`MemoryTooShort`] when that is less than [`NormalEquations::memory`].
    pub fn new(unknowns: usize, mut memory: &'a mut [S]) -> Result<Self, MemoryTooShort> {
        let (needed, lent) = (Self::memory(unknowns), memory.len());
        let mut part = |count| take(&mut memory, count).map_err(|_| MemoryTooShort { needed, lent });
        let (packed, gradient) = (part(triangle(unknowns))?, part(unknowns)?);
        let mut equations = Self { packed, gradient, cost: S::zero(), prior_cost: S::zero(), weight: S::zero(), rows: 0 };
        equations.clear();
        Ok(equations)
    }

    /// Forgets all rows.
    pub fn clear(&mut self) {
        self.packed.fill(S::zero());
        self.gradient.fill(S::zero());
        (self.cost, self.prior_cost, self.weight, self.rows) = (S::zero(), S::zero(), S::zero(), 0);
    }

    /// Adds a block of rows, which has one column an unknown; of more or fewer, those that both have.
    pub fn add(&mut self, rows: &Rows<'_, S>) {
        // The hot loop of a fit: n(n+1)/2 sums of eight products, each in registers and added to its entry once.
        let mut rest = &mut *self.packed;
        for (i, (column, pull)) in rows.columns.iter().zip(self.gradient.iter_mut()).enumerate() {
            let (line, below) = rest.split_at_mut(i + 1);
            let weighted = product(column, rows.weight);
            for (entry, other) in line.iter_mut().zip(rows.columns) {
                *entry += sum_of_products(&weighted, other);
            }
            *pull += sum_of_products(&weighted, rows.residual_m);
            rest = below;
        }
        let weighted = product(rows.residual_m, rows.weight);
        self.cost += sum_of_products(&weighted, rows.residual_m);
        self.weight += sum(rows.weight);
        self.rows += rows.count;
    }

    /// Adds what was known before: values that are `deviation = x − x₀` away from where they are believed to be.
    pub fn add_prior(&mut self, deviation: &[S], precision: Precision<'_, S>) {
        let at = |i: usize, j: usize| match precision {
            Precision::Diagonal(diagonal) if i == j => diagonal.get(i).copied().unwrap_or(S::zero()),
            Precision::Diagonal(_) => S::zero(),
            Precision::Full(packed) => packed.get(triangle(i.max(j)) + i.min(j)).copied().unwrap_or(S::zero()),
        };
        for (i, &own) in deviation.iter().enumerate().take(self.unknowns()) {
            let pull = deviation.iter().enumerate().fold(S::zero(), |sum, (j, &other)| sum + at(i, j) * other);
            self.gradient[i] -= pull;
            self.prior_cost += own * pull;
            for j in 0..=i {
                self.packed[triangle(i) + j] += at(i, j);
            }
        }
    }

    /// Adds all rows of `other`, as if they had been added here.
    ///
    /// # Errors
    /// [`SizeMismatch`] when the two are over different numbers of unknowns; nothing is added then.
    pub fn merge(&mut self, other: &NormalEquations<'_, S>) -> Result<(), SizeMismatch> {
        if self.unknowns() != other.unknowns() {
            return Err(SizeMismatch);
        }
        for (entry, &more) in self.packed.iter_mut().zip(&*other.packed) {
            *entry += more;
        }
        for (entry, &more) in self.gradient.iter_mut().zip(&*other.gradient) {
            *entry += more;
        }
        self.cost += other.cost;
        self.prior_cost += other.prior_cost;
        self.weight += other.weight;
        self.rows += other.rows;
        Ok(())
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.gradient.len()
    }

    /// Entry (i, j) of the matrix; `None` beyond the unknowns.
    pub fn entry(&self, i: usize, j: usize) -> Option<S> {
        let (i, j) = (i.max(j), i.min(j));
        (i < self.unknowns()).then(|| self.packed[triangle(i) + j])
    }

    /// The right-hand side: half the direction of steepest descent of the cost.
    pub fn gradient(&self) -> &[S] {
        self.gradient
    }

    /// What is minimised: `Σ w f²`, square metres times the weights' unit (φ in the paper's eq. 4), and what the prior adds.
    pub fn cost(&self) -> S {
        self.cost + self.prior_cost
    }

    /// `√(Σ w f² / Σ w)`, metres: of the measurements alone.
    pub fn rms_m(&self) -> S {
        (self.cost / self.weight).square_root()
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
        self.packed
    }

    /// The diagonal of the matrix: without a prior, the squared norm of every column.
    pub fn diagonal(&self) -> impl Iterator<Item = S> + '_ {
        (0..self.unknowns()).map(|i| self.packed[triangle(i) + i])
    }
}

fn product<S: Real>(a: &Lanes<S>, b: &Lanes<S>) -> Lanes<S> {
    let mut product = *a;
    for (value, &factor) in product.iter_mut().zip(b) {
        *value *= factor;
    }
    product
}

/// In pairs, so that no addition waits for the one before it, and rounding grows with the logarithm.
fn sum<S: Real>(a: &Lanes<S>) -> S {
    let mut sums = *a;
    let mut half = LANES / 2;
    while half > 0 {
        for i in 0..half {
            let other = sums[i + half];
            sums[i] += other;
        }
        half /= 2;
    }
    sums[0]
}

fn sum_of_products<S: Real>(a: &Lanes<S>, b: &Lanes<S>) -> S {
    sum(&product(a, b))
}
