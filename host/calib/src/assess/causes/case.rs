//! The rows of a fit, ready to be asked what they would leave if something about them had been otherwise.

use ballbar::{JointVector, Kinematics, Matrix3, Vector3};

use super::FittedRows;
use crate::identify::{Residual, WrongRow};
use crate::model::{Dataset, PairingId, PoseRow, Rig, Robot};

/// One row as the fit leaves it.
#[derive(Clone, Copy)]
pub(super) struct CaseRow {
    /// Measured less computed, metres.
    pub(super) residual_m: f64,
    /// What it scatters by where nothing is wrong, metres.
    pub(super) deviation_m: f64,
    /// From chuck to sphere, base frame, metres.
    pub(super) bar_m: Vector3<f64>,
    /// Turns the tool's directions to the base's.
    pub(super) base_from_tool: Matrix3<f64>,
    is_left_out: bool,
}

/// All rows.
pub(super) struct Case<'a> {
    pub(super) robot: &'a Robot,
    pub(super) rig: &'a Rig,
    pub(super) dataset: &'a Dataset,
    pub(super) rows: Vec<CaseRow>,
    kinematics: Kinematics<f64>,
}

impl<'a> Case<'a> {
    pub(super) fn new(fitted: &FittedRows<'a>, left_out: &[WrongRow]) -> Self {
        let &FittedRows { robot, rig, dataset, residuals, sigma_m } = fitted;
        /// Below it, a nanometre, residuals are the rounding of a file's digits.
        const LEAST_M: f64 = 1e-9;
        let kinematics = robot.kinematics();
        let case_row = |(row, residual): (&PoseRow, &Residual)| {
            let pairing = rig.pairing(row.pairing);
            let configuration = kinematics.configuration(&row.measurement.q, row.approach);
            CaseRow {
                residual_m: residual.value_m,
                deviation_m: sigma_m.max(LEAST_M) / row.measurement.weight.sqrt(),
                bar_m: configuration.point_in_base(&pairing.sphere_tool_m) - pairing.chuck_base_m,
                base_from_tool: configuration.base_from_tool().rotation,
                is_left_out: false,
            }
        };
        let mut rows: Vec<CaseRow> = dataset.rows.iter().zip(residuals).map(case_row).collect();
        for one in left_out {
            /// What the fit adds to the scatter of a row is believed up to this factor.
            const MOST: f64 = 3.0;
            let row = &mut rows[one.row];
            row.is_left_out = true;
            let own_m = row.residual_m.abs() / one.deviations.abs();
            if own_m.is_finite() {
                row.deviation_m = own_m.clamp(row.deviation_m, MOST * row.deviation_m);
            }
        }
        Self { robot, rig, dataset, rows, kinematics }
    }

    pub(super) fn count(&self) -> usize {
        self.rows.len()
    }

    pub(super) fn is_left_out(&self, row: usize) -> bool {
        self.rows[row].is_left_out
    }

    /// The length that the fit computes for a row as it stands, metres.
    pub(super) fn computed_m(&self, row: usize) -> f64 {
        self.rows[row].bar_m.norm()
    }

    /// The length that was measured, less what the fit knows of other unknowns, metres.
    pub(super) fn measured_m(&self, row: usize) -> f64 {
        self.rows[row].residual_m + self.computed_m(row)
    }

    /// The residual of a row if it had been measured between other ends, metres.
    pub(super) fn with_pairing(&self, row: usize, pairing: PairingId) -> f64 {
        let pose = &self.dataset.rows[row];
        let configuration = self.kinematics.configuration(&pose.measurement.q, pose.approach);
        self.measured_m(row) - configuration.length(&self.rig.pairing(pairing))
    }

    /// The residual of a row if its joints had stood elsewhere, metres.
    pub(super) fn with_joints(&self, row: usize, change: impl FnOnce(&mut [f64])) -> f64 {
        let pose = &self.dataset.rows[row];
        let mut q: JointVector<f64> = pose.measurement.q;
        change(&mut q.as_array_mut()[..self.robot.chain.joints()]);
        let configuration = self.kinematics.configuration(&q, pose.approach);
        self.measured_m(row) - configuration.length(&self.rig.pairing(pose.pairing))
    }
}
