//! Every joint vector of a tool pose: in closed form where the arm has one, else from many starts.

use std::f64::consts::TAU;

use ballbar::{JointKind, JointVector, MAX_JOINTS, Pose};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::opw::Opw;
use super::skeleton::Skeleton;
use crate::model::{JointLimits, Robot};

/// How long a numeric search for branches goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Thoroughness {
    /// Starts at most.
    pub starts: usize,
    /// Starts without a new branch after which the search ends.
    pub patience: usize,
}

impl Thoroughness {
    /// Finds all branches of a six-axis arm in nearly every pose.
    pub const ALL: Self = Self { starts: 400, patience: 60 };
    /// Finds some of them, where many poses are tried anyway.
    pub const SOME: Self = Self { starts: 12, patience: 4 };
}

/// The way from tool poses to joint vectors of one robot: in closed form for arms with a parallel base and a spherical wrist (M. Brandstötter,
/// A. Angerer and M. Hofbaur, "An Analytical Solution of the Inverse Kinematics Problem of Industrial Serial Manipulators with an Ortho-parallel
/// Basis and a Spherical Wrist", Austrian Robotics Workshop 2014), otherwise by steps from random starts.
///
/// ```
/// use ballbar_calib::kinematics::{InverseKinematics, Thoroughness, apart};
/// use ballbar_calib::{ChaCha8Rng, Kinematics, SeedableRng, designs};
///
/// let robot = designs::puma560();
/// let kinematics = Kinematics::new(&robot.chain);
/// let base_from_tool = kinematics.base_from_tool(&robot.chain.joint_vector(&[0.3, -0.5, 0.4, 0.2, -0.6, 1.0])?);
///
/// let inverse = InverseKinematics::new(&robot);
/// let found = inverse.branches(&base_from_tool, Thoroughness::ALL, &mut ChaCha8Rng::seed_from_u64(0));
/// assert!(found.within_limits.len() > 1);
/// for q in &found.within_limits {
///     let (off_m, turned_rad) = apart(&kinematics.base_from_tool(q), &base_from_tool);
///     assert!(off_m < 1e-9 && turned_rad < 1e-9);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct InverseKinematics {
    skeleton: Skeleton,
    limits: Vec<JointLimits>,
    closed: Option<Opw>,
}

/// What was found for a pose.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Branches {
    /// Within limits, each joint at the turn nearest to the middle of its range; radians or metres.
    pub within_limits: Vec<JointVector<f64>>,
    /// How many more there are that the limits forbid.
    pub beyond_limits: usize,
}

impl InverseKinematics {
    /// Prepares a robot.
    pub fn new(robot: &Robot) -> Self {
        Self::within(robot, robot.limits.clone())
    }

    /// Prepares a robot with other limits than its own, one entry a joint, radians or metres.
    pub fn within(robot: &Robot, limits: Vec<JointLimits>) -> Self {
        Self { closed: Opw::recognise(&Skeleton::new(&robot.chain)), limits, skeleton: Skeleton::of(robot) }
    }

    /// Whether branches come from a closed form and are therefore all.
    pub fn is_closed_form(&self) -> bool {
        self.closed.is_some()
    }

    /// The chain's links.
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// Joint vectors that bring the tool to a pose: all of them in closed form, otherwise those that `effort` finds.
    pub fn branches(&self, base_from_tool: &Pose<f64>, effort: Thoroughness, rng: &mut ChaCha8Rng) -> Branches {
        match &self.closed {
            // Of an arm without terms exactly; from there it is a few steps to one with them.
            Some(closed) if self.skeleton.has_terms() => {
                let rigid = closed.solve(base_from_tool);
                self.sorted(rigid.iter().filter_map(|start| self.reach(start, base_from_tool)).collect())
            }
            Some(closed) => self.sorted(closed.solve(base_from_tool)),
            None => self.numeric_branches(base_from_tool, effort, rng),
        }
    }

    /// Joint vectors that bring the tool to a pose, from random starts, also where there is a closed form.
    pub fn numeric_branches(&self, base_from_tool: &Pose<f64>, effort: Thoroughness, rng: &mut ChaCha8Rng) -> Branches {
        const SAME: f64 = 1e-5;
        let mut found: Vec<JointVector<f64>> = Vec::new();
        let mut fruitless = 0;
        for _ in 0..effort.starts {
            fruitless += 1;
            if let Some(q) = self.reach(&self.random_start(rng), base_from_tool) {
                let q = self.unwound(&q);
                if found.iter().all(|other| self.wrapped_distance(other, &q) > SAME) {
                    found.push(q);
                    fruitless = 0;
                }
            }
            if fruitless == effort.patience {
                break;
            }
        }
        self.sorted(found)
    }

    /// Joint vector that brings the tool to a pose, by steps from `start`; of an arm of fewer than six joints to the pose's position, and as
    /// near to its orientation as it can. Limits are not looked at.
    pub fn reach(&self, start: &JointVector<f64>, base_from_tool: &Pose<f64>) -> Option<JointVector<f64>> {
        /// An arm with fewer joints cannot turn its tool freely.
        const FREE_JOINTS: usize = 6;
        if self.skeleton.joints() < FREE_JOINTS {
            self.skeleton.approach_pose(start, base_from_tool)
        } else {
            self.skeleton.reach_pose(start, base_from_tool)
        }
    }

    /// A joint vector within the limits; of joints with more than a turn, within the middle one.
    pub fn random_start(&self, rng: &mut ChaCha8Rng) -> JointVector<f64> {
        let mut q = JointVector::zero();
        let joints = self.limits.iter().zip(self.skeleton.encoders());
        for (value, (limits, encoder)) in q.as_array_mut().iter_mut().zip(joints) {
            let (middle, mut half) = ((limits.min + limits.max) / 2.0, (limits.max - limits.min) / 2.0);
            if encoder.kind == JointKind::Revolute {
                half = half.min(TAU / 2.0 / encoder.scale.abs());
            }
            *value = rng.random_range(middle - half..=middle + half);
        }
        q
    }

    /// Whether every joint is within its limits.
    pub fn is_within_limits(&self, q: &JointVector<f64>) -> bool {
        self.limits.iter().zip(q.as_array()).all(|(limits, &q)| limits.contain(q))
    }

    /// The same posture with every revolute joint at the turn nearest to the middle of its range.
    pub fn unwound(&self, q: &JointVector<f64>) -> JointVector<f64> {
        let mut q = *q;
        let joints = self.limits.iter().zip(self.skeleton.encoders());
        for (value, (limits, encoder)) in q.as_array_mut().iter_mut().zip(joints) {
            if encoder.kind == JointKind::Revolute {
                let (middle, turn) = ((limits.min + limits.max) / 2.0, TAU / encoder.scale.abs());
                *value -= ((*value - middle) / turn).round() * turn;
            }
        }
        q
    }

    /// The same posture with every revolute joint at the turn nearest to another's, as far as its limits let it.
    pub fn turned_towards(&self, q: &JointVector<f64>, other: &JointVector<f64>) -> JointVector<f64> {
        let mut q = *q;
        let joints = self.limits.iter().zip(self.skeleton.encoders());
        for ((value, other), (limits, encoder)) in q.as_array_mut().iter_mut().zip(other.as_array()).zip(joints) {
            if encoder.kind == JointKind::Revolute {
                let turn = TAU / encoder.scale.abs();
                let turned = *value - ((*value - other) / turn).round() * turn;
                if limits.contain(turned) {
                    *value = turned;
                }
            }
        }
        q
    }

    fn sorted(&self, all: Vec<JointVector<f64>>) -> Branches {
        let total = all.len();
        let within: Vec<_> = all.iter().map(|q| self.unwound(q)).filter(|q| self.is_within_limits(q)).collect();
        Branches { beyond_limits: total - within.len(), within_limits: within }
    }

    /// Largest difference of a joint, whole turns apart counting as none.
    fn wrapped_distance(&self, a: &JointVector<f64>, b: &JointVector<f64>) -> f64 {
        let mut largest = 0.0_f64;
        for (joint, encoder) in self.skeleton.encoders().iter().enumerate().take(MAX_JOINTS) {
            let mut off = (a.as_array()[joint] - b.as_array()[joint]).abs();
            if encoder.kind == JointKind::Revolute {
                let turn = TAU / encoder.scale.abs();
                off = (off % turn).min(turn - off % turn);
            }
            largest = largest.max(off);
        }
        largest
    }
}
