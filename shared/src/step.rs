//! The damped step `Δp = (JᵀWJ + λD)⁻¹ JᵀWf` (the paper's eq. 10, with a choice of D), by a Cholesky factorisation of the
//! equations with their columns scaled.

use core::cmp::Ordering;
use core::fmt;

use serde::{Deserialize, Serialize};

use crate::normal::PACKED;
use crate::{MAX_PARAMETERS, NormalEquations, Real, Row};

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

/// A step of the parameters and what the linear model promises of it.
#[derive(Clone, Debug)]
pub struct Step<S> {
    /// Change of every parameter; zero where held.
    pub change: Row<S>,
    /// By how much the linear model expects `Σ w f²` to fall.
    pub predicted_reduction: S,
}

/// The damped matrix is singular to working precision: λ is too small for these columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotPositiveDefinite {
    /// Index of the parameter whose column depends on the free ones before it.
    pub parameter_index: usize,
}

impl fmt::Display for NotPositiveDefinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the column of {} depends on those before it", crate::Parameter::from_index(self.parameter_index))
    }
}

impl core::error::Error for NotPositiveDefinite {}

/// Memory of the factorisation, kept between steps so that nothing is allocated: 10 KiB in `f32`, 20 KiB in `f64`.
#[derive(Clone, Debug)]
pub struct DampedSolver<S> {
    factor: [S; PACKED],
    damping: Row<S>,
    scale: Row<S>,
}

impl<S: Real> Default for DampedSolver<S> {
    fn default() -> Self {
        Self { factor: [S::zero(); PACKED], damping: [S::zero(); MAX_PARAMETERS], scale: [S::zero(); MAX_PARAMETERS] }
    }
}

impl<S: Real> DampedSolver<S> {
    /// Solves for one step.
    ///
    /// Columns are scaled so that the damped matrix has a unit diagonal; this is what lets `f32` suffice. A column that is
    /// zero up to rounding is damped by the largest one's size, never scaled by its own, which would blow rounding up to rank.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] when a pivot vanishes to working precision; raise λ or hold the parameter it names.
    pub fn solve(&mut self, normal: &NormalEquations<S>, lambda: S, damping: Damping) -> Result<Step<S>, NotPositiveDefinite> {
        let n = normal.free().len();
        self.set_damping(normal, lambda, damping);
        self.load_scaled(normal);
        self.factorise(n)
            .map_err(|column| NotPositiveDefinite { parameter_index: normal.free().indices().nth(column).unwrap_or(column) })?;

        let mut solution = [S::zero(); MAX_PARAMETERS];
        for ((x, &g), &scale) in solution.iter_mut().zip(normal.gradient()).zip(&self.scale) {
            *x = g * scale;
        }
        self.substitute(&mut solution[..n]);

        let mut step = Step { change: [S::zero(); MAX_PARAMETERS], predicted_reduction: S::zero() };
        for (i, index) in normal.free().indices().enumerate() {
            let change = solution[i] * self.scale[i];
            step.change[index] = change;
            // φ(p) − φ(p + Δp) ≈ 2 gᵀΔ − ΔᵀHΔ = gᵀΔ + λ ΔᵀDΔ, a sum without cancellation.
            step.predicted_reduction += change * (normal.gradient()[i] + self.damping[i] * change);
        }
        Ok(step)
    }

    /// `λD`, and the scale of each column.
    fn set_damping(&mut self, normal: &NormalEquations<S>, lambda: S, damping: Damping) {
        // A translation column has unit rows, so the sum of weights is the size that a column of substance has, even when
        // every free column is rounding.
        let largest = normal.diagonal().fold(normal.weight(), |a, b| a.max(b));
        let hundred_ulps = S::nearest(100.0) * S::EPSILON;
        let zero_column = hundred_ulps * hundred_ulps * largest;
        for (i, square) in normal.diagonal().enumerate() {
            self.damping[i] = match damping {
                _ if square <= zero_column => largest,
                Damping::Identity => lambda,
                Damping::Diagonal => lambda * square,
            };
            let size = square + self.damping[i];
            self.scale[i] = if size > S::zero() { S::one() / size.sqrt() } else { S::one() };
        }
    }

    /// The scaled damped matrix, packed, into `factor`.
    fn load_scaled(&mut self, normal: &NormalEquations<S>) {
        let mut entries = normal.packed().iter().zip(self.factor.iter_mut());
        for i in 0..normal.free().len() {
            for j in 0..=i {
                if let Some((&entry, scaled)) = entries.next() {
                    let damped = if i == j { entry + self.damping[i] } else { entry };
                    *scaled = damped * self.scale[i] * self.scale[j];
                }
            }
        }
    }

    /// `A = L Lᵀ` in place; `Err` with the column whose pivot vanishes beside the unit diagonal.
    fn factorise(&mut self, n: usize) -> Result<(), usize> {
        let smallest_pivot = S::nearest(n as f64) * S::EPSILON;
        for i in 0..n {
            let (above, line) = self.factor.split_at_mut(i * (i + 1) / 2);
            for j in 0..i {
                let line_j = &above[j * (j + 1) / 2..][..=j];
                let dot = line[..j].iter().zip(line_j).fold(S::zero(), |sum, (&a, &b)| sum + a * b);
                line[j] = (line[j] - dot) / line_j[j];
            }
            let pivot = line[..i].iter().fold(line[i], |rest, &a| rest - a * a);
            // A pivot that is not a number compares with nothing and fails as well.
            if pivot.partial_cmp(&(smallest_pivot * line[i])) != Some(Ordering::Greater) {
                return Err(i);
            }
            line[i] = pivot.sqrt();
        }
        Ok(())
    }

    /// Solves `L Lᵀ x = b` in place.
    fn substitute(&self, x: &mut [S]) {
        for i in 0..x.len() {
            let line = &self.factor[i * (i + 1) / 2..][..=i];
            let dot = line[..i].iter().zip(&*x).fold(S::zero(), |sum, (&l, &known)| sum + l * known);
            x[i] = (x[i] - dot) / line[i];
        }
        for i in (0..x.len()).rev() {
            let line = &self.factor[i * (i + 1) / 2..][..=i];
            let (unknown, solved) = x.split_at_mut(i);
            solved[0] /= line[i];
            for (value, &l) in unknown.iter_mut().zip(line) {
                *value -= l * solved[0];
            }
        }
    }
}
