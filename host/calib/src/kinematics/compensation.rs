//! Commands for a controller that keeps its nominal model: what to tell it so that the real robot goes where it should.

use std::fmt;

use ballbar::{JointKind, JointVector, Kinematics, Pose};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use super::branches::{InverseKinematics, Thoroughness};
use super::frames::apart;
use crate::model::{JointLimits, Robot};
use crate::units::{ScreenUnit, tidy};

/// A calibrated robot beside the model that its controller has.
#[derive(Clone, Debug)]
pub struct Compensator {
    calibrated: InverseKinematics,
    nominal: InverseKinematics,
    nominal_forward: Kinematics<f64>,
    kinds: Vec<JointKind>,
    /// What both robots allow.
    limits: Vec<JointLimits>,
}

/// What to command for one target. Differences are metres and radians, as the calibrated robot predicts them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Compensation {
    /// Joints to command, radians or metres.
    pub q: JointVector<f64>,
    /// Joints that the controller would go to by itself.
    pub nominal_q: JointVector<f64>,
    /// The pose that the controller believes to reach by `q`: what to command where it takes poses.
    pub nominal_base_from_tool: Pose<f64>,
    /// From the target, if the controller goes to `nominal_q`.
    pub before: (f64, f64),
    /// From the target, if it goes to `q`.
    pub left: (f64, f64),
    /// Whether the nominal model's solution for that pose, as a file has it, that is nearest to `nominal_q` is `q`. Near singular
    /// postures a pose may have other joints, and then `left` is not what becomes of the pose.
    pub pose_leads_to_q: bool,
}

/// A joint that goes far from where the controller would have it: farther than any calibration moves one, away from singular postures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FarTurn {
    /// Number of the joint, from 1.
    pub joint: usize,
    /// Its kind.
    pub kind: JointKind,
    /// How far it goes, radians or metres.
    pub way: f64,
}

impl Compensation {
    /// The joint that goes farthest from where the controller would have it, if that is more than five degrees or fifty millimetres.
    pub fn far_turn(&self, kinds: &[JointKind]) -> Option<FarTurn> {
        const FAR_RAD: f64 = std::f64::consts::PI / 36.0;
        const FAR_M: f64 = 0.05;
        let ways = self.q.as_array().iter().zip(self.nominal_q.as_array()).map(|(new, old)| (new - old).abs());
        let joints = ways.zip(kinds).enumerate().map(|(i, (way, &kind))| {
            let far = if kind == JointKind::Revolute { FAR_RAD } else { FAR_M };
            (way / far, FarTurn { joint: i + 1, kind, way })
        });
        joints.filter(|(share, _)| *share > 1.0).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, farthest)| farthest)
    }
}

/// How a target is given.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Goal {
    /// The pose that the controller's model has at these joints, radians or metres.
    Joints(JointVector<f64>),
    /// A pose of the tool in the base frame, and joints near which the controller's own solution is, where they are given.
    Pose(Pose<f64>, Option<JointVector<f64>>),
}

/// A joint of which the two robots allow nothing in common.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error("joint {joint}: the calibrated robot allows {}, the nominal one {}", range(*.kind, .calibrated), range(*.kind, .nominal))]
pub struct NothingAllowed {
    /// Number of the joint, from 1.
    pub joint: usize,
    /// Its kind.
    pub kind: JointKind,
    /// Its limits in the calibrated robot's file.
    pub calibrated: JointLimits,
    /// Its limits in the nominal robot's file.
    pub nominal: JointLimits,
}

fn range(kind: JointKind, limits: &JointLimits) -> String {
    let unit = ScreenUnit::from(kind);
    let [min, max] = [limits.min, limits.max].map(|value| tidy(unit.from_si(value)));
    format!("{min} to {max} {}", unit.name())
}

/// Why a target has no command.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Unreached {
    /// The controller's own model does not get there, or only beyond limits.
    ByNominal,
    /// The calibrated robot does not get there.
    ByCalibrated,
    /// A joint would go beyond its limits.
    Limit {
        /// Number of the joint, from 1.
        joint: usize,
        /// Its kind.
        kind: JointKind,
        /// Where it would have to go, radians or metres.
        q: f64,
        /// Its limits.
        limits: JointLimits,
    },
}

impl fmt::Display for Unreached {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::ByNominal => f.write_str("the controller's model has no joints within limits for this pose"),
            Self::ByCalibrated => f.write_str("the calibrated robot does not reach this pose"),
            Self::Limit { joint, kind, q, limits } => {
                let unit = ScreenUnit::from(kind);
                let [q, min, max] = [q, limits.min, limits.max].map(|value| tidy(unit.from_si(value)));
                write!(f, "joint {joint} would have to go to {q:.4} {}, beyond its limits, {min} to {max}", unit.name())
            }
        }
    }
}

impl Compensator {
    /// A calibrated robot and its controller's model; both have the same joints. Branches are looked for within what both allow.
    ///
    /// # Errors
    /// [`NothingAllowed`] names the first joint of which they allow nothing in common.
    pub fn new(calibrated: &Robot, nominal: &Robot) -> Result<Self, NothingAllowed> {
        let kinds = nominal.chain.joint_kinds().to_vec();
        let mut limits = Vec::new();
        for (i, ((a, b), &kind)) in calibrated.limits.iter().zip(&nominal.limits).zip(&kinds).enumerate() {
            let both = JointLimits { min: a.min.max(b.min), max: a.max.min(b.max) };
            if both.min > both.max {
                return Err(NothingAllowed { joint: i + 1, kind, calibrated: *a, nominal: *b });
            }
            limits.push(both);
        }
        Ok(Self {
            calibrated: InverseKinematics::within(calibrated, limits.clone()),
            nominal: InverseKinematics::within(nominal, limits.clone()),
            nominal_forward: nominal.kinematics(),
            kinds,
            limits,
        })
    }

    /// The middle of the joints' ranges.
    pub fn middle(&self) -> JointVector<f64> {
        let mut q = JointVector::zero();
        q.as_array_mut().iter_mut().zip(&self.limits).for_each(|(q, limits)| *q = (limits.min + limits.max) / 2.0);
        q
    }

    /// Joints by which the calibrated robot is at the target, on the branch on which the controller would go there: of the target's joints,
    /// or of a pose the one within limits that is nearest to the joints beside it, or else to `before`, where the arm comes from. `rounded`
    /// is what becomes of joints on their way to the controller, and `written` what becomes of poses.
    ///
    /// # Errors
    /// [`Unreached`] says why the target has none.
    pub fn compensate(
        &self,
        goal: &Goal,
        before: &JointVector<f64>,
        rounded: impl Fn(JointVector<f64>) -> JointVector<f64>,
        written: impl Fn(&Pose<f64>) -> Pose<f64>,
    ) -> Result<Compensation, Unreached> {
        /// Radians and metres: a hundredth of a millimetre a metre away.
        const SAME_JOINTS: f64 = 1e-5;
        let (wanted, nominal_q) = match *goal {
            Goal::Joints(q) => (self.nominal_forward.base_from_tool(&q), q),
            Goal::Pose(pose, near) => (pose, self.nominal_joints(&pose, &near.unwrap_or(*before)).ok_or(Unreached::ByNominal)?),
        };
        let stepped = self.calibrated.reach(&nominal_q, &wanted);
        let near = stepped.filter(|q| is_near(q, &nominal_q));
        // What is only reached beyond limits is refused by its joint.
        let q = near.or_else(|| nearest_branch(&self.calibrated, &wanted, &nominal_q, stepped)).or(stepped);
        let q = rounded(q.ok_or(Unreached::ByCalibrated)?);
        self.check_limits(&q)?;
        let from_target = |q: &JointVector<f64>| apart(&wanted, &self.calibrated.skeleton().at(q).base_from_tool);
        let nominal_base_from_tool = self.nominal_forward.base_from_tool(&q);
        let by_controller = self.nominal_joints(&written(&nominal_base_from_tool), &nominal_q);
        Ok(Compensation {
            q,
            nominal_q,
            nominal_base_from_tool,
            pose_leads_to_q: by_controller.is_some_and(|by_controller| distance(&by_controller, &q) < SAME_JOINTS),
            before: from_target(&nominal_q),
            left: from_target(&q),
        })
    }

    /// As [`Compensator::compensate`], for targets one after the other: the arm comes to each from the one before it that has a command, to
    /// the first from `start`.
    pub fn compensate_all<'g>(
        &self,
        goals: impl IntoIterator<Item = &'g Goal>,
        start: JointVector<f64>,
        rounded: impl Fn(JointVector<f64>) -> JointVector<f64>,
        written: impl Fn(&Pose<f64>) -> Pose<f64>,
    ) -> Vec<Result<Compensation, Unreached>> {
        let mut before = start;
        let one = |goal: &Goal| {
            let found = self.compensate(goal, &before, &rounded, &written);
            if let Ok(found) = &found {
                before = found.nominal_q;
            }
            found
        };
        goals.into_iter().map(one).collect()
    }

    /// Joints of the nominal model for a pose, within limits, nearest to others.
    fn nominal_joints(&self, pose: &Pose<f64>, near: &JointVector<f64>) -> Option<JointVector<f64>> {
        /// What the decimals of a file may turn a tool out of what an arm of few joints can do.
        const DECIMALS_RAD: f64 = 1e-3;
        let stepped = self.nominal.reach(near, pose);
        let q = stepped.filter(|q| is_near(q, near) && self.check_limits(q).is_ok());
        let q = q.or_else(|| nearest_branch(&self.nominal, pose, near, stepped))?;
        let (_, turned_rad) = apart(pose, &self.nominal_forward.base_from_tool(&q));
        (turned_rad < DECIMALS_RAD && self.check_limits(&q).is_ok()).then_some(q)
    }

    fn check_limits(&self, q: &JointVector<f64>) -> Result<(), Unreached> {
        let joints = self.limits.iter().zip(&self.kinds).zip(q.as_array()).enumerate();
        match joints.into_iter().find(|(_, ((limits, _), q))| !limits.contain(**q)) {
            None => Ok(()),
            Some((i, ((&limits, &kind), &q))) => Err(Unreached::Limit { joint: i + 1, kind, q, limits }),
        }
    }
}

/// Of all branches within limits, each joint turned as near as its limits let it, the nearest. What steps from there reach is one of them,
/// of an arm with joints to spare often the nearest of infinitely many.
fn nearest_branch(
    inverse: &InverseKinematics,
    pose: &Pose<f64>,
    to: &JointVector<f64>,
    stepped: Option<JointVector<f64>>,
) -> Option<JointVector<f64>> {
    const SEED: u64 = 1993;
    let branches = inverse.branches(pose, Thoroughness::ALL, &mut ChaCha8Rng::seed_from_u64(SEED));
    let turned = branches.within_limits.iter().chain(&stepped).map(|q| inverse.turned_towards(q, to));
    turned.filter(|q| inverse.is_within_limits(q)).min_by(|a, b| distance(a, to).total_cmp(&distance(b, to)))
}

/// Whether two joint vectors are too near one another to be on different branches, but for singular postures.
fn is_near(a: &JointVector<f64>, b: &JointVector<f64>) -> bool {
    const NEAR: f64 = 0.2;
    distance(a, b) < NEAR
}

/// Radians and metres taken alike.
fn distance(a: &JointVector<f64>, b: &JointVector<f64>) -> f64 {
    a.as_array().iter().zip(b.as_array()).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
