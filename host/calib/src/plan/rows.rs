//! Rows of a plan: poses to measure and via points, in the order in which the robot goes through them.

use ballbar::JointVector;

use crate::model::PairingId;

/// What happens at a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowKind {
    /// The robot goes through.
    Via,
    /// The robot stands still and the bar is read.
    Measure,
}

/// How the bar stands at a row.
#[derive(Clone, Copy, Debug, PartialEq)]
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
pub struct RowMargins {
    /// To the nearer end of the bar's travel, less what plausible robots may be off, metres; `None` without the bar.
    pub travel_m: Option<f64>,
    /// Between the two nearest solids, metres.
    pub clearance_m: f64,
    /// Which these are.
    pub nearest: String,
    /// Of the revolute joint nearest to a limit, radians; infinite without one.
    pub limit_rad: f64,
    /// Of the prismatic joint nearest to a limit, metres; infinite without one.
    pub limit_m: f64,
    /// Smallest singular value of the tool's Jacobian, lengths divided by the arm's.
    pub singularity: f64,
}

/// One row of a plan. The robot comes to it from the row before by joint interpolation.
#[derive(Clone, Debug, PartialEq)]
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
