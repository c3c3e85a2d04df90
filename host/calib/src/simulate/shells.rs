//! Poses on hemispherical shells about the chucks, and the lengths that a true robot would give there.

use std::f64::consts::{PI, TAU};

use ballbar::{Approach, Direction, JointVector, Kinematics, TermKind, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use thiserror::Error;

use crate::kinematics::Skeleton;
use crate::model::{PairingId, PoseRow, Rig, Robot};
use crate::units::{mm_from_m, tidy};

/// A simulated experiment: which shells, how many poses on each, and how noisy the bar is.
#[derive(Clone, Copy, Debug)]
pub struct Shells<'a> {
    /// The robot as its controller believes it to be: poses are planned with it.
    pub planned_with: &'a Robot,
    /// The robot as it is: lengths are computed with it.
    pub truth: &'a Robot,
    /// Chucks, spheres and the bar's travel.
    pub rig: &'a Rig,
    /// Pairings to measure.
    pub pairings: &'a [PairingId],
    /// Radius of the shells: the bar's length at mid travel, metres.
    pub bar_m: f64,
    /// Poses on each pairing's shell.
    pub per_pairing: usize,
    /// Standard deviation of the lengths' normal noise, metres.
    pub sigma_m: f64,
    /// The same seed gives the same poses and noise, up to the last digits of the platform's sine.
    pub seed: u64,
}

/// A pose on a shell and the length measured there.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ShellPose {
    /// As a measured length.
    pub row: PoseRow,
    /// Elevation of the bar above the table as planned, radians.
    pub latitude_rad: f64,
    /// Azimuth of the bar as planned, 0 to 2π radians from the base's x towards its y.
    pub longitude_rad: f64,
}

/// Why a shell could not be filled.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ShellError {
    /// Too little of the shell is within reach.
    #[error("pairing {pairing}, bar {bar_mm} mm: {found} of {wanted} poses found within joint limits and bar travel")]
    OutOfReach {
        /// `chuck:sphere`.
        pairing: String,
        /// Radius of the shell, millimetres.
        bar_mm: f64,
        /// Poses found.
        found: usize,
        /// Poses asked for.
        wanted: usize,
    },
}

/// Lowest elevation of the bar: below it, bar and table would meet.
const LOWEST_LATITUDE_RAD: f64 = 10.0 * PI / 180.0;
/// Starts of the inverse kinematics per pose found, and per pose of the first few, before a shell counts as out of reach.
const STARTS_PER_POSE: usize = 400;
const FIRST_POSES: usize = 10;

impl Shells<'_> {
    /// Finds the poses and measures them; `on_pose` is called after each.
    ///
    /// Points are spread evenly over the area of the hemisphere. The arm's posture is what a random start within the joint
    /// limits leads to, so that wrists and elbows vary as the fit needs them to. Where the true robot's joints have backlash, it goes straight from
    /// each pose to the next, and the rows say from which sides the joints came.
    ///
    /// ```
    /// use ballbar_calib::designs;
    /// use ballbar_calib::model::Dataset;
    /// use ballbar_calib::simulate::Shells;
    ///
    /// let (robot, rig) = (designs::puma560(), designs::triangles());
    /// let pairings = rig.all_pairings();
    /// let shells = Shells {
    ///     planned_with: &robot, truth: &robot, rig: &rig, pairings: &pairings, bar_m: 0.46, per_pairing: 5, sigma_m: 84e-6, seed: 1,
    /// };
    /// let poses = shells.simulate(|| ())?;
    /// assert_eq!(poses.len(), 9 * 5);
    /// let dataset = Dataset::new("simulated", poses.into_iter().map(|pose| pose.row).collect())?;
    /// assert!(dataset.rows.iter().all(|row| (row.measurement.length_m - 0.46).abs() <= 0.0375));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`ShellError::OutOfReach`] when a shell has too few points that the robot reaches.
    ///
    /// # Panics
    /// When a pairing is none of the rig's.
    pub fn simulate(&self, mut on_pose: impl FnMut()) -> Result<Vec<ShellPose>, ShellError> {
        let planned = Skeleton::of(self.planned_with);
        let truth = self.truth.kinematics();
        let backlash = |joint| self.truth.terms.coefficient(joint, TermKind::Backlash);
        let has_backlash = (0..self.truth.chain.joints()).any(|joint| backlash(joint) != 0.0);
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        // Noise has a stream of its own: its size changes no pose, as long as it keeps the length within the bar's travel.
        let mut noise_rng = ChaCha8Rng::seed_from_u64(self.seed);
        noise_rng.set_stream(1);
        let normal = Normal::new(0.0, self.sigma_m).ok();

        let mut poses = Vec::new();
        for &pairing in self.pairings {
            let (mut found, mut starts) = (0, 0);
            while found < self.per_pairing && starts < STARTS_PER_POSE * (found + FIRST_POSES) {
                starts += 1;
                let noise_m = normal.map_or(0.0, |normal| normal.sample(&mut noise_rng));
                let before = poses.last().map(|pose: &ShellPose| pose.row.measurement.q);
                let before = before.as_ref().filter(|_| has_backlash);
                if let Some(pose) = self.attempt(&planned, &truth, pairing, before, noise_m, &mut rng) {
                    poses.push(pose);
                    found += 1;
                    on_pose();
                }
            }
            if found < self.per_pairing {
                let pairing = self.rig.pairing_name(pairing);
                return Err(ShellError::OutOfReach {
                    pairing,
                    bar_mm: tidy(mm_from_m(self.bar_m)),
                    found,
                    wanted: self.per_pairing,
                });
            }
        }
        Ok(poses)
    }

    fn attempt(
        &self,
        planned: &Skeleton,
        truth: &Kinematics<f64>,
        id: PairingId,
        before: Option<&JointVector<f64>>,
        noise_m: f64,
        rng: &mut ChaCha8Rng,
    ) -> Option<ShellPose> {
        let latitude_rad = rng.random_range(LOWEST_LATITUDE_RAD.sin()..1.0).asin();
        let longitude_rad = rng.random_range(0.0..TAU);
        let along_bar =
            Vector3::new(latitude_rad.cos() * longitude_rad.cos(), latitude_rad.cos() * longitude_rad.sin(), latitude_rad.sin());
        let start: Vec<f64> = self.planned_with.limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();

        let pairing = self.rig.pairing(id);
        let target_m = pairing.chuck_base_m + along_bar * self.bar_m;
        let start = self.planned_with.chain.joint_vector(&start).ok()?;
        let q = planned.reach_point(&start, &pairing.sphere_tool_m, &target_m)?;
        if !self.planned_with.limits.iter().zip(q.as_array()).all(|(limits, &q)| limits.contain(q)) {
            return None;
        }
        let approach = before.map_or(Approach::UNKNOWN, |before| approach(before, &q));
        let length_m = truth.configuration(&q, approach).length(&pairing) + noise_m;
        let within_travel = self.rig.bar.as_ref().is_none_or(|bar| (length_m - self.bar_m).abs() <= bar.travel_m / 2.0);
        (within_travel && length_m > 0.0).then(|| ShellPose {
            row: PoseRow {
                set: Some(tidy(mm_from_m(self.bar_m)).to_string()),
                bar_m: Some(self.bar_m),
                approach,
                ..PoseRow::of(id, ballbar::Measurement::new(pairing, q, length_m))
            },
            latitude_rad,
            longitude_rad,
        })
    }
}

/// From which sides joints come that go straight from one place to another.
fn approach(from: &JointVector<f64>, to: &JointVector<f64>) -> Approach {
    let ways = from.as_array().iter().zip(to.as_array()).enumerate();
    ways.filter(|(_, (from, to))| from != to).fold(Approach::UNKNOWN, |approach, (joint, (from, to))| {
        approach.with(joint, Some(if to > from { Direction::Rising } else { Direction::Falling }))
    })
}
