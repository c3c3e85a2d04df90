//! A robot at its rig, and everything that a pose is judged by.

use ballbar::{Chain, JointKind, JointVector, Kinematics, LANES, LengthRows, Measurement, Pairing, Parameter};
use nalgebra::DMatrix;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::contact::Nearest;
use super::fixtures::{FixturesOverlap, check_fixtures};
use super::scene::Scene;
use crate::kinematics::{CanonicalFrames, InverseKinematics, Posture, with_length_gradient};
use crate::model::{PairingId, Rig, Robot};
use crate::unknowns::plausible_error;

/// What has to be left at every pose.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Margins {
    /// To the limits of revolute joints, radians.
    pub limit_rad: f64,
    /// To the limits of prismatic joints, metres.
    pub limit_m: f64,
    /// To the ends of the bar's travel, metres, for all plausible robots.
    pub travel_m: f64,
    /// Between any two solids, metres.
    pub clearance_m: f64,
    /// Smallest singular value of the tool's Jacobian at measured poses, its lengths divided by the arm's.
    pub singularity: f64,
}

impl Default for Margins {
    fn default() -> Self {
        Self { limit_rad: 3.0_f64.to_radians(), limit_m: 0.005, travel_m: 0.008, clearance_m: 0.010, singularity: 0.03 }
    }
}

/// How fast the robot goes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pace {
    /// Of revolute joints, radians per second.
    pub turn_rad_s: f64,
    /// Of prismatic joints, metres per second.
    pub slide_m_s: f64,
    /// Standing still at each measured pose, seconds (the paper's "two seconds").
    pub settle_s: f64,
}

impl Default for Pace {
    fn default() -> Self {
        Self { turn_rad_s: 30.0_f64.to_radians(), slide_m_s: 0.1, settle_s: 2.0 }
    }
}

/// Deviations of a length, by linear theory, that are kept free at either end of the travel. A thousand robots at some
/// hundred poses that differ in kind reach about as far.
pub const RESERVED_DEVIATIONS: f64 = 4.5;

/// Standard deviation of a true robot's parameter about its design: a third of what a design may plausibly be off.
pub fn plausible_deviation(unit: ballbar::ParameterUnit) -> f64 {
    plausible_error(unit) / 3.0
}

/// How far a pose is from the joints' limits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LimitMargin {
    /// Of the revolute joint nearest to a limit, radians; infinite without one.
    #[cfg_attr(feature = "serde", serde(with = "crate::stored::infinite_as_none"))]
    pub turn_rad: f64,
    /// Of the prismatic joint nearest to a limit, metres; infinite without one.
    #[cfg_attr(feature = "serde", serde(with = "crate::stored::infinite_as_none"))]
    pub slide_m: f64,
}

/// A robot at its rig.
#[derive(Clone, Debug)]
pub struct Cell<'a> {
    /// The nominal robot.
    pub robot: &'a Robot,
    /// Chucks, spheres, solids.
    pub rig: &'a Rig,
    /// Travel of the bar from end to end, metres.
    pub travel_m: f64,
    /// What has to be left.
    pub margins: Margins,
    /// How fast the robot goes.
    pub pace: Pace,
    /// From tool poses to joint vectors.
    pub inverse: InverseKinematics,
    /// Solids.
    pub scene: Scene,
    kinematics: Kinematics<f64>,
    /// What a design's parameters plausibly deviate, SI.
    scales: Vec<f64>,
    /// The same, but zero for parameters that move the tool as others do: their errors are the others' already.
    deviations: Vec<f64>,
    /// Sum of the links' lengths and slides, metres.
    arm_m: f64,
    /// How far anything behind a joint can be from it, metres.
    reach_m: Vec<f64>,
}

impl<'a> Cell<'a> {
    /// Prepares a robot at its rig, with a bar that travels `travel_m` from end to end.
    ///
    /// # Errors
    /// [`FixturesOverlap`] when the rig cannot be as it is described.
    pub fn new(robot: &'a Robot, rig: &'a Rig, travel_m: f64, margins: Margins, pace: Pace) -> Result<Self, FixturesOverlap> {
        let frames = CanonicalFrames::new(&robot.chain);
        let planned = Robot { chain: frames.rounded_chain(), terms: frames.terms(&robot.terms), ..robot.clone() };
        let (scene, gaps) = Scene::new(&planned, rig, margins.clearance_m);
        let inverse = InverseKinematics::new(&planned);
        let skeleton = inverse.skeleton();
        check_fixtures(&scene, rig, &skeleton.at(&JointVector::zero()), &gaps, margins.clearance_m)?;
        let mut reach_m = vec![0.0; skeleton.joints()];
        let mut behind_m = scene.tool_reach_m().max(rig.solids.last_link_radius_m);
        for joint in (0..skeleton.joints()).rev() {
            behind_m += skeleton.translation_m(joint + 1).norm();
            reach_m[joint] = behind_m + rig.solids.link_radius_m;
            let encoder = skeleton.encoders()[joint];
            if encoder.kind == JointKind::Prismatic {
                let limits = &robot.limits[joint];
                let ends = [limits.min, limits.max].map(|q| (encoder.offset + encoder.scale * q).abs());
                behind_m += ends[0].max(ends[1]);
            }
        }
        let chain = skeleton.chain();
        let parameters = (0..chain.parameter_count()).map(Parameter::from_index);
        let scale = |parameter| plausible_deviation(chain.unit(parameter));
        let deviation = |parameter| if chain.is_conventionally_held(parameter) { 0.0 } else { scale(parameter) };
        Ok(Self {
            robot,
            rig,
            travel_m,
            margins,
            pace,
            kinematics: planned.kinematics(),
            scales: parameters.clone().map(scale).collect(),
            deviations: parameters.map(deviation).collect(),
            arm_m: behind_m.max(f64::MIN_POSITIVE),
            reach_m,
            inverse,
            scene,
        })
    }

    /// The nominal robot in canonical frames, to the nanometre, in which all of a plan is computed: the same plan whatever frames the robot's
    /// file is written in.
    pub fn chain(&self) -> &Chain<f64> {
        self.inverse.skeleton().chain()
    }

    /// Where the links stand.
    pub fn posture(&self, q: &JointVector<f64>) -> Posture {
        self.inverse.skeleton().at(q)
    }

    /// How far a joint vector is from the limits; below zero it is beyond them.
    pub fn limit_margin(&self, q: &JointVector<f64>) -> LimitMargin {
        let mut margin = LimitMargin { turn_rad: f64::INFINITY, slide_m: f64::INFINITY };
        let joints = self.robot.chain.joint_kinds().iter().zip(&self.robot.limits).zip(q.as_array());
        for ((kind, limits), q) in joints {
            let least = (q - limits.min).min(limits.max - q);
            match kind {
                JointKind::Revolute => margin.turn_rad = margin.turn_rad.min(least),
                JointKind::Prismatic => margin.slide_m = margin.slide_m.min(least),
            }
        }
        margin
    }

    /// Whether the joints keep their margin to the limits.
    pub fn keeps_limits(&self, q: &JointVector<f64>) -> bool {
        let margin = self.limit_margin(q);
        margin.turn_rad >= self.margins.limit_rad && margin.slide_m >= self.margins.limit_m
    }

    /// Smallest singular value of the tool's Jacobian, with lengths divided by the arm's: zero where the tool cannot move in some
    /// direction or turn about some axis that other postures allow.
    pub fn singularity(&self, posture: &Posture) -> f64 {
        let at_m = &posture.base_from_tool.translation_m;
        let axes = posture.axes();
        let jacobian = DMatrix::from_fn(6, axes.len(), |row, joint| {
            let unit = if axes[joint].kind == JointKind::Prismatic { self.arm_m } else { 1.0 };
            match row {
                0..3 => axes[joint].point_column(at_m)[row] / self.arm_m * unit,
                _ => axes[joint].turn_column()[row - 3] * unit,
            }
        });
        let values = jacobian.singular_values();
        values.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// The bar's length, and how far plausible robots may be off it, metres.
    pub fn length(&self, q: &JointVector<f64>, pairing: &Pairing<f64>) -> (f64, f64) {
        let reserve_m = |gradient: &[f64]| {
            let squares = gradient.iter().zip(&self.deviations).map(|(entry, deviation)| (entry * deviation).powi(2));
            RESERVED_DEVIATIONS * squares.sum::<f64>().sqrt()
        };
        with_length_gradient(&self.kinematics, q, pairing, |length_m, gradient| (length_m, reserve_m(gradient)))
    }

    /// The gradient of the length at each of some joint vectors, entries times the parameters' plausible deviations: metres.
    pub fn plausible_rows(&self, all_q: &[JointVector<f64>], pairing: &Pairing<f64>) -> Vec<Vec<f64>> {
        let mut swept = LengthRows::default();
        let mut rows = Vec::with_capacity(all_q.len());
        for block in all_q.chunks(LANES) {
            let measurement = |&q: &JointVector<f64>| Measurement::new(*pairing, q, 0.0);
            let measurements: heapless::Vec<_, LANES> = block.iter().map(measurement).collect();
            swept.compute(&self.kinematics, &measurements);
            let row =
                |lane: usize| self.scales.iter().enumerate().map(|(index, scale)| swept.chain(index)[lane] * scale).collect();
            rows.extend((0..block.len()).map(row));
        }
        rows
    }

    /// What stays to the nearer end of the bar's travel, less what plausible robots may be off, metres.
    pub fn travel_margin_m(&self, q: &JointVector<f64>, pairing: &Pairing<f64>, bar_m: f64) -> f64 {
        let (length_m, reserve_m) = self.length(q, pairing);
        self.travel_m / 2.0 - (length_m - bar_m).abs() - reserve_m
    }

    /// The two nearest things.
    pub fn nearest(&self, posture: &Posture, attached: Option<PairingId>) -> Nearest {
        self.scene.nearest(posture, attached)
    }

    /// No point of robot or bar moves farther than this on the way between two joint vectors, metres.
    pub fn longest_motion_m(&self, a: &JointVector<f64>, b: &JointVector<f64>) -> f64 {
        let steps = a.as_array().iter().zip(b.as_array()).map(|(a, b)| (b - a).abs());
        let joints = self.inverse.skeleton().encoders().iter().zip(&self.reach_m);
        let moved = steps.zip(joints).map(|(step, (encoder, reach_m))| match encoder.kind {
            JointKind::Revolute => step * encoder.scale.abs() * reach_m,
            JointKind::Prismatic => step * encoder.scale.abs(),
        });
        moved.sum()
    }

    /// Seconds from one joint vector to another, the slowest joint deciding.
    pub fn seconds(&self, a: &JointVector<f64>, b: &JointVector<f64>) -> f64 {
        let joints = self.robot.chain.joint_kinds().iter().zip(a.as_array().iter().zip(b.as_array()));
        let times = joints.map(|(kind, (a, b))| {
            let speed = match kind {
                JointKind::Revolute => self.pace.turn_rad_s,
                JointKind::Prismatic => self.pace.slide_m_s,
            };
            (b - a).abs() / speed
        });
        times.fold(0.0, f64::max)
    }

    /// A plausible true robot: every independent parameter off by a normal deviation.
    pub fn plausible_robot(&self, rng: &mut ChaCha8Rng) -> Chain<f64> {
        let mut chain = self.chain().clone();
        for (value, deviation) in chain.parameters_mut().iter_mut().zip(&self.deviations) {
            let normal: f64 = StandardNormal.sample(rng);
            *value += deviation * normal;
        }
        chain
    }
}

/// Halfway between two joint vectors.
pub(super) fn halfway(a: &JointVector<f64>, b: &JointVector<f64>) -> JointVector<f64> {
    let mut middle = *a;
    for (value, b) in middle.as_array_mut().iter_mut().zip(b.as_array()) {
        *value = (*value + b) / 2.0;
    }
    middle
}
