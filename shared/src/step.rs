//! The damped step `Δx = (JᵀWJ + Λ + λD)⁻¹ g` (the paper's eq. 10, with a choice of D), by a Cholesky factorisation of the
//! equations with their columns scaled.

use core::cmp::Ordering;
use core::fmt;

use serde::{Deserialize, Serialize};

use crate::normal::{MemoryTooShort, take, triangle};
use crate::{NormalEquations, Real};

/// What λ is multiplied with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Damping {
    /// `λI`, as the paper has it (eq. 7); metres and radians weigh alike.
    #[default]
    Identity,
    /// `λ·diag(JᵀWJ)`, Marquardt's; independent of units.
    Diagonal,
}

/// A step of the unknowns and what the linear model promises of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step<'a, S> {
    /// Change of every unknown.
    pub change: &'a [S],
    /// By how much the linear model expects the cost to fall.
    pub predicted_reduction: S,
}

/// The damped matrix is singular to working precision: λ is too small for these columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotPositiveDefinite {
    /// Index of the unknown whose column depends on those before it.
    pub unknown: usize,
}

impl fmt::Display for NotPositiveDefinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the column of unknown {} (from 0) depends on those before it", self.unknown)
    }
}

impl core::error::Error for NotPositiveDefinite {}

/// Memory of the factorisation, lent once and kept between steps.
#[derive(Debug)]
pub struct DampedSolver<'a, S> {
    factor: &'a mut [S],
    damping: &'a mut [S],
    scale: &'a mut [S],
    change: &'a mut [S],
}

impl<'a, S: Real> DampedSolver<'a, S> {
    /// Numbers of memory that so many unknowns need.
    pub const fn memory(unknowns: usize) -> usize {
        triangle(unknowns) + 3 * unknowns
    }

    /// A solver of equations over so many unknowns, in memory that is lent.
    ///
    /// # Errors
    /// [`MemoryTooShort`] when that is less than [`DampedSolver::memory`].
    pub fn new(unknowns: usize, mut memory: &'a mut [S]) -> Result<Self, MemoryTooShort> {
        let (needed, lent) = (Self::memory(unknowns), memory.len());
        let mut part = |count| take(&mut memory, count).map_err(|_| MemoryTooShort { needed, lent });
        Ok(Self { factor: part(triangle(unknowns))?, damping: part(unknowns)?, scale: part(unknowns)?, change: part(unknowns)? })
    }

    /// Solves equations of as many unknowns for one step.
    ///
    /// Columns are scaled so that the damped matrix has a unit diagonal; this is what lets `f32` suffice. A column that is
    /// zero up to rounding is damped by the largest one's size, never scaled by its own, which would blow rounding up to rank.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] when a pivot vanishes to working precision; raise λ or hold the unknown it names.
    pub fn solve(
        &mut self,
        normal: &NormalEquations<'_, S>,
        lambda: S,
        damping: Damping,
    ) -> Result<Step<'_, S>, NotPositiveDefinite> {
        self.set_damping(normal, lambda, damping);
        self.load_scaled(normal);
        self.factorise().map_err(|unknown| NotPositiveDefinite { unknown })?;

        for ((x, &g), &scale) in self.change.iter_mut().zip(normal.gradient()).zip(&*self.scale) {
            *x = g * scale;
        }
        substitute(self.factor, self.change);

        let mut predicted_reduction = S::zero();
        let terms = self.change.iter_mut().zip(&*self.scale).zip(&*self.damping).zip(normal.gradient());
        for (((change, &scale), &damping), &gradient) in terms {
            *change *= scale;
            // φ(x) − φ(x + Δx) ≈ 2 gᵀΔ − ΔᵀHΔ = gᵀΔ + λ ΔᵀDΔ, a sum without cancellation.
            predicted_reduction += *change * (gradient + damping * *change);
        }
        Ok(Step { change: self.change, predicted_reduction })
    }

    /// `λD`, and the scale of each column.
    fn set_damping(&mut self, normal: &NormalEquations<'_, S>, lambda: S, damping: Damping) {
        // A translation column has unit rows, so the sum of weights is the size that a column of substance has, even when
        // every column is rounding.
        let largest = normal.diagonal().fold(normal.weight(), |a, b| a.max(b));
        let hundred_ulps = S::nearest(100.0) * S::EPSILON;
        let zero_column = hundred_ulps * hundred_ulps * largest;
        for ((own, scale), square) in self.damping.iter_mut().zip(self.scale.iter_mut()).zip(normal.diagonal()) {
            *own = match damping {
                _ if square <= zero_column => largest,
                Damping::Identity => lambda,
                Damping::Diagonal => lambda * square,
            };
            let size = square + *own;
            *scale = if size > S::zero() { S::one() / size.square_root() } else { S::one() };
        }
    }

    /// The scaled damped matrix, packed, into `factor`.
    fn load_scaled(&mut self, normal: &NormalEquations<'_, S>) {
        let mut entries = normal.packed().iter().zip(self.factor.iter_mut());
        for (i, (&own, &damping)) in self.scale.iter().zip(&*self.damping).enumerate() {
            for (j, &other) in self.scale[..=i].iter().enumerate() {
                if let Some((&entry, scaled)) = entries.next() {
                    let damped = if i == j { entry + damping } else { entry };
                    *scaled = damped * own * other;
                }
            }
        }
    }

    /// `A = L Lᵀ` in place; `Err` with the column whose pivot vanishes beside the unit diagonal.
    fn factorise(&mut self) -> Result<(), usize> {
        let n = self.scale.len();
        let smallest_pivot = S::nearest(n as f64) * S::EPSILON;
        for i in 0..n {
            let (above, line) = self.factor.split_at_mut(triangle(i));
            for j in 0..i {
                let line_j = &above[triangle(j)..][..=j];
                let dot = line[..j].iter().zip(line_j).fold(S::zero(), |sum, (&a, &b)| sum + a * b);
                line[j] = (line[j] - dot) / line_j[j];
            }
            let pivot = line[..i].iter().fold(line[i], |rest, &a| rest - a * a);
            // A pivot that is not a number compares with nothing and fails as well.
            if pivot.partial_cmp(&(smallest_pivot * line[i])) != Some(Ordering::Greater) {
                return Err(i);
            }
            line[i] = pivot.square_root();
        }
        Ok(())
    }
}

/// Solves `L Lᵀ x = b` in place, for a packed lower triangle L.
fn substitute<S: Real>(factor: &[S], x: &mut [S]) {
    for i in 0..x.len() {
        let line = &factor[triangle(i)..][..=i];
        let dot = line[..i].iter().zip(&*x).fold(S::zero(), |sum, (&l, &known)| sum + l * known);
        x[i] = (x[i] - dot) / line[i];
    }
    for i in (0..x.len()).rev() {
        let line = &factor[triangle(i)..][..=i];
        let (unknown, solved) = x.split_at_mut(i);
        solved[0] /= line[i];
        for (value, &l) in unknown.iter_mut().zip(line) {
            *value -= l * solved[0];
        }
    }
}
