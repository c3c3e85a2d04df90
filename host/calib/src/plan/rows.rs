//! Rows of a plan: poses to measure and via points, in the order in which the robot goes through them.

use std::f64::consts::TAU;

use ballbar::{JointVector, Vector3};

use crate::model::{PairingId, PoseError, PoseRow, Rig, Robot};

/// What happens at a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum RowKind {
    /// The robot goes through.
    Via,
    /// The robot stands still and the bar is read.
    Measure,
}

/// How the bar stands at a row.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BarAt {
    /// Elevation above the table, radians.
    pub latitude_rad: f64,
    /// Azimuth from the base's x towards its y, 0 to 2π radians.
    pub longitude_rad: f64,
    /// Length by the nominal robot, metres.
    pub length_m: f64,
}

/// What is left at a row.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RowMargins {
    /// To the nearer end of the bar's travel, less what plausible robots may be off, metres; `None` without the bar.
    pub travel_m: Option<f64>,
    /// Between the two nearest solids, metres.
    pub clearance_m: f64,
    /// Which these are.
    pub nearest: String,
    /// Of the revolute joint nearest to a limit, radians; infinite without one.
    #[cfg_attr(feature = "serde", serde(with = "crate::stored::infinite_as_none"))]
    pub limit_rad: f64,
    /// Of the prismatic joint nearest to a limit, metres; infinite without one.
    #[cfg_attr(feature = "serde", serde(with = "crate::stored::infinite_as_none"))]
    pub limit_m: f64,
    /// Smallest singular value of the tool's Jacobian, lengths divided by the arm's.
    pub singularity: f64,
}

/// One row of a plan. The robot comes to it from the row before by joint interpolation.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PlanRow {
    /// Go through or measure.
    pub kind: RowKind,
    /// Which chuck and sphere the bar joins, or will join.
    pub pairing: PairingId,
    /// Length of the bar at mid travel, metres.
    pub bar_m: f64,
    /// Encoder outputs, radians or metres.
    pub q: JointVector<f64>,
    /// `None` while the bar is off.
    pub bar: Option<BarAt>,
    /// `None` in a plan that was not made in this process.
    pub margins: Option<RowMargins>,
    /// Line of the text that it was read from, from 1; 0 in a new plan.
    pub line: usize,
}

impl BarAt {
    /// Of the way from the centre of the chuck to that of the sphere, base frame, metres.
    pub(super) fn along(bar_base_m: &Vector3<f64>) -> Self {
        let length_m = bar_base_m.norm();
        Self {
            latitude_rad: (bar_base_m.z / length_m).asin(),
            longitude_rad: bar_base_m.y.atan2(bar_base_m.x).rem_euclid(TAU),
            length_m,
        }
    }
}

impl PlanRow {
    /// The robot at `q` (radians or metres) with the bar attached to a chuck and a sphere of `rig`, where the nominal `robot` has it. `bar_m` is
    /// the bar's length at mid travel, metres. Whether the robot may go there, [`super::CheckedPlan::new`] says.
    ///
    /// # Errors
    /// [`PoseError`] when the rig has no such pairing, or a number is not finite or out of range.
    pub fn with_bar(
        robot: &Robot,
        rig: &Rig,
        kind: RowKind,
        pairing: PairingId,
        bar_m: f64,
        q: JointVector<f64>,
    ) -> Result<Self, PoseError> {
        let row = Self::without_bar(rig, pairing, bar_m, q)?;
        let ends = rig.pairing(pairing);
        let sphere_base_m = robot.kinematics().point_in_base(&q, &ends.sphere_tool_m);
        Ok(Self { kind, bar: Some(BarAt::along(&(sphere_base_m - ends.chuck_base_m))), ..row })
    }

    /// A via point at `q` (radians or metres) on the way to where the bar, of length `bar_m` at mid travel (metres), will join a chuck and a
    /// sphere of `rig`.
    ///
    /// # Errors
    /// As [`PlanRow::with_bar`].
    pub fn without_bar(rig: &Rig, pairing: PairingId, bar_m: f64, q: JointVector<f64>) -> Result<Self, PoseError> {
        PoseRow::new(rig, pairing, q, bar_m)?;
        Ok(Self { kind: RowKind::Via, pairing, bar_m, q, bar: None, margins: None, line: 0 })
    }
}
