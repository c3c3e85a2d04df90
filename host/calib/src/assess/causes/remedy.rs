//! What a row's residual is once a cause is put right.

use ballbar::{JointKind, Vector3};

use super::case::Case;
use super::kind::{CauseKind, RowsOf};
use crate::model::{End, PairingId};

impl PairingId {
    /// The same with another chuck or sphere.
    fn with(self, end: End, which: usize) -> Self {
        match end {
            End::Chuck => Self { chuck: which, ..self },
            End::Sphere => Self { sphere: which, ..self },
        }
    }
}

impl Case<'_> {
    /// The residual that a row has without this cause, metres; `None` where the cause does not concern the row.
    pub(super) fn residual_without(&self, kind: &CauseKind, row: usize) -> Option<f64> {
        let CauseRow { pairing, length_m, residual_m } = self.row(row);
        let joint_off = |joint: usize, by: f64| self.with_joints(row, |q| q[joint] -= by);
        Some(match *kind {
            CauseKind::EndsExchanged { end, between: [a, b] } => {
                let named = pairing.at(end);
                let really = if named == a { b } else { a };
                (named == a || named == b).then(|| self.with_pairing(row, pairing.with(end, really)))?
            }
            CauseKind::OtherEnd { end, named, really } => {
                (pairing.at(end) == named).then(|| self.with_pairing(row, pairing.with(end, really)))?
            }
            CauseKind::OtherPairing { named, really } => (pairing == named).then(|| self.with_pairing(row, really))?,
            CauseKind::LengthUnit(unit) => residual_m + length_m * (unit.millimetres() - 1.0),
            CauseKind::RodMissing { rod_m } => residual_m + rod_m,
            CauseKind::OtherRod { longer_by_m } => residual_m - longer_by_m,
            CauseKind::OtherPairings { .. } | CauseKind::NoLength | CauseKind::LengthRepeated | CauseKind::Unknown => {
                return None;
            }
            CauseKind::LengthShifted { by } => {
                let other = row.checked_add_signed(by).filter(|&other| other < self.count())?;
                self.measured_m(row) - self.computed_m(other)
            }
            CauseKind::JointSign { joint } => self.with_joints(row, |q| q[joint] = -q[joint]),
            CauseKind::JointsExchanged { between: [a, b] } => self.with_joints(row, |q| q.swap(a, b)),
            CauseKind::AngleUnit(unit) => {
                let kinds = self.robot.chain.joint_kinds();
                self.with_joints(row, |q| {
                    let angles = q.iter_mut().zip(kinds).filter(|(_, kind)| **kind == JointKind::Revolute);
                    angles.for_each(|(q, _)| *q *= unit.factor());
                })
            }
            CauseKind::EncoderTurns { joint, by, .. } | CauseKind::JointOffset { joint, by } => joint_off(joint, by),
            CauseKind::LengthOffset { by_m, ref of, first, last } => {
                ((first..=last).contains(&row) && of.has(self.dataset, row)).then_some(residual_m - by_m)?
            }
            CauseKind::Displaced { end, which, by_m, first, last } => {
                let is_concerned = (first..=last).contains(&row) && RowsOf::end(end, which).has(self.dataset, row);
                is_concerned.then(|| self.measured_m(row) - self.displaced_m(row, end, Vector3::from(by_m)))?
            }
        })
    }

    /// The length that the fit computes with the chuck (base frame) or the sphere (tool frame) displaced, metres.
    pub(super) fn displaced_m(&self, row: usize, end: End, by_m: Vector3<f64>) -> f64 {
        let row = &self.rows[row];
        match end {
            End::Chuck => (row.bar_m - by_m).norm(),
            End::Sphere => (row.bar_m + row.base_from_tool * by_m).norm(),
        }
    }

    /// Whether a row by itself shows this cause; most causes show in residuals alone.
    pub(super) fn shows(&self, kind: &CauseKind, row: usize) -> bool {
        match kind {
            CauseKind::NoLength => self.has_no_length(row),
            CauseKind::LengthRepeated => self.is_repeated(row),
            _ => false,
        }
    }

    /// A bar that short is not made.
    fn has_no_length(&self, row: usize) -> bool {
        const SHARE: f64 = 0.02;
        self.dataset.rows[row].measurement.length_m < SHARE * self.computed_m(row)
    }

    /// To the last digit that a file has, while the arm stood elsewhere.
    fn is_repeated(&self, row: usize) -> bool {
        const SAME_M: f64 = 1e-9;
        row.checked_sub(1).is_some_and(|before| {
            let [one, other] = [row, before].map(|row| &self.dataset.rows[row].measurement);
            (one.length_m - other.length_m).abs() < SAME_M && one.q != other.q
        })
    }

    fn row(&self, row: usize) -> CauseRow {
        let pose = &self.dataset.rows[row];
        CauseRow { pairing: pose.pairing, length_m: pose.measurement.length_m, residual_m: self.rows[row].residual_m }
    }
}

/// What the causes are about.
struct CauseRow {
    pairing: PairingId,
    length_m: f64,
    residual_m: f64,
}
