//! What the simulated robot does: stations at which it stands and measures, and how fast it goes from one to the next.

use ballbar::{JointKind, JointVector, Pairing};
use ballbar_calib::simulate::{ShellError, Shells};

use crate::robot_link::JointSpeed;

/// A pose to stand at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Encoder outputs, radians or metres. The servos hold the nearest whole counts.
    pub q: JointVector<f64>,
    /// What is attached there; another bar than at the station before is off on the way. `None` where no bar is attached.
    pub bar: Option<AttachedBar>,
    /// How long the robot stands there, seconds.
    pub dwell_s: f64,
    /// What the bar measures too much here, metres: play of the chucks and all else that a fit sees as noise.
    pub length_error_m: f64,
}

/// A bar between a chuck and a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttachedBar {
    /// The bar's two ends.
    pub pairing: Pairing<f64>,
    /// Its length at mid travel, metres.
    pub mid_m: f64,
}

/// Stations in their order.
#[derive(Clone, Debug, PartialEq)]
pub struct Script {
    /// The stations.
    pub stations: Vec<Station>,
    /// How fast the robot moves between them.
    pub speed: JointSpeed,
}

/// No move is shorter, so that a jump of a few counts is no jolt.
const SHORTEST_MOVE_S: f64 = 0.05;
/// Highest speed over mean speed of the profile of [`progress`].
const PEAK_OVER_MEAN: f64 = 1.875;

/// Time of a move, seconds.
pub(super) fn move_duration_s(kinds: &[JointKind], speed: &JointSpeed, from: &JointVector<f64>, to: &JointVector<f64>) -> f64 {
    (speed.duration_s(kinds, from, to) * PEAK_OVER_MEAN).max(SHORTEST_MOVE_S)
}

/// Share of the way, 0 to 1, at a share of the time: `10 τ³ − 15 τ⁴ + 6 τ⁵`, which begins and ends without a jerk.
pub(super) fn progress(time_share: f64) -> f64 {
    let t = time_share.clamp(0.0, 1.0);
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}

impl Script {
    /// Stations at the poses of simulated shells, `dwell_s` seconds at each; the shells' noise is the stations' length error.
    /// `on_pose` is called for each.
    ///
    /// # Errors
    /// [`ShellError`] when a shell has too few points that the robot reaches.
    pub fn from_shells(shells: &Shells<'_>, dwell_s: f64, speed: JointSpeed, on_pose: impl FnMut()) -> Result<Self, ShellError> {
        let truth = shells.truth.kinematics();
        let stations = shells.simulate(on_pose)?.into_iter().map(|pose| {
            let measurement = pose.row.measurement;
            Station {
                q: measurement.q,
                bar: Some(AttachedBar { pairing: measurement.pairing, mid_m: shells.bar_m }),
                dwell_s,
                length_error_m: measurement.length_m - truth.length(&measurement.q, &measurement.pairing),
            }
        });
        Ok(Self { stations: stations.collect(), speed })
    }
}
