//! From a block of measurements to rows of equations: the one way in.
//!
//! Measurements stand side by side, column by column, so that what computes a block may compute all of its lanes at once.

use crate::{Kinematics, MAX_PARAMETERS, Measurement, Number, PARAMETERS_PER_JOINT, ParameterKind, Real};

/// As many measurements as one block holds.
pub const LANES: usize = 8;

/// One number for each measurement of a block.
pub type Lanes<S> = [S; LANES];

/// Rows of linear equations for up to [`LANES`] measurements, ready to be added to [`crate::NormalEquations`]. Lanes beyond `count` have
/// weight zero and finite columns.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'a, S> {
    /// `∂computed/∂unknown`: one entry an unknown.
    pub columns: &'a [Lanes<S>],
    /// Measured less computed.
    pub residual_m: &'a Lanes<S>,
    /// Weights of the squared residuals.
    pub weight: &'a Lanes<S>,
    /// Measurements in the block.
    pub count: usize,
}

/// What one sweep down the chain gives for each measurement of a block: residuals, the chain's columns, and the forces from which all
/// other unknowns make theirs.
#[derive(Clone, Debug)]
pub struct LengthRows<S> {
    columns: [Lanes<S>; MAX_PARAMETERS],
    force_base: [Lanes<S>; 3],
    force_tool: [Lanes<S>; 3],
    residual_m: Lanes<S>,
    weight: Lanes<S>,
    count: usize,
}

impl<S: Number> Default for LengthRows<S> {
    fn default() -> Self {
        let zeros = [S::zero(); LANES];
        Self {
            columns: [zeros; MAX_PARAMETERS],
            force_base: [zeros; 3],
            force_tool: [zeros; 3],
            residual_m: zeros,
            weight: zeros,
            count: 0,
        }
    }
}

impl<S: Real> LengthRows<S> {
    /// Computes the rows of the first [`LANES`] measurements at the chain's present parameters.
    pub fn compute(&mut self, kinematics: &Kinematics<S>, measurements: &[Measurement<S>]) {
        let mut row = [S::zero(); MAX_PARAMETERS];
        let parameters = kinematics.parameter_count();
        self.count = measurements.len().min(LANES);
        self.weight[self.count..].fill(S::zero());
        for (lane, measurement) in measurements.iter().take(LANES).enumerate() {
            let (residual_m, force) = kinematics.residual_row(measurement, &mut row);
            for (column, &entry) in self.columns.iter_mut().zip(&row[..parameters]) {
                column[lane] = entry;
            }
            for axis in 0..3 {
                self.force_base[axis][lane] = force.base[axis];
                self.force_tool[axis][lane] = force.tool[axis];
            }
            self.residual_m[lane] = residual_m;
            self.weight[lane] = measurement.weight;
        }
        self.clear_unused_lanes();
    }

    /// What stands there from a block before may be infinite, and zero times that is no zero.
    fn clear_unused_lanes(&mut self) {
        let count = self.count;
        let all = self.columns.iter_mut().chain(&mut self.force_base).chain(&mut self.force_tool).chain([&mut self.residual_m]);
        all.for_each(|column| column[count..].fill(S::zero()));
    }

    /// `∂d/∂p` of the chain's parameter at `index`, metres per SI unit.
    pub fn chain(&self, index: usize) -> &Lanes<S> {
        &self.columns[index]
    }

    /// `∂d/∂θ` of joint `joint`, from 0: metres per radian or metre. A term `a·φ` of the joint has this times φ as its column.
    pub fn joint(&self, joint: usize) -> &Lanes<S> {
        &self.columns[joint * PARAMETERS_PER_JOINT + ParameterKind::Offset as usize]
    }

    /// `∂d/∂c` of the chuck along an axis of the base frame, 0 to 2.
    pub fn chuck(&self, axis: usize) -> Lanes<S> {
        self.force_base[axis].map(|force| -force)
    }

    /// `∂d/∂s` of the sphere along an axis of the tool frame, 0 to 2.
    pub fn sphere(&self, axis: usize) -> &Lanes<S> {
        &self.force_tool[axis]
    }

    /// Measured less computed, metres.
    pub fn residual_m(&self) -> &Lanes<S> {
        &self.residual_m
    }

    /// Measurements in the block.
    pub fn count(&self) -> usize {
        self.count
    }

    /// These measurements as rows over other columns.
    pub fn over<'a>(&'a self, columns: &'a [Lanes<S>]) -> Rows<'a, S> {
        Rows { columns, residual_m: &self.residual_m, weight: &self.weight, count: self.count }
    }
}
