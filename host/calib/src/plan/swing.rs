//! By how much motion can bring two things nearer to one another.
//!
//! Two things move against one another by the joints between them only. A gap is safe where it exceeds the farthest that these joints
//! can move the thing behind them; where that is not enough, the plane halfway between their nearest points often tells more: along
//! its normal a joint moves most things far less, or not at all.

use ballbar::{JointKind, JointVector, MAX_JOINTS, Vector3};

use super::geometry::{Core, Segment, sine};
use crate::kinematics::{Axis, Posture, Skeleton};
use crate::model::JointLimits;

/// How far each joint moves to either side of a posture: radians or metres of the joint, not of its encoder.
#[derive(Clone, Copy, Debug)]
pub struct Swing {
    steps: [f64; MAX_JOINTS],
}

impl Swing {
    /// Of a robot that stands.
    pub const NONE: Self = Self { steps: [0.0; MAX_JOINTS] };

    /// From one joint vector to another.
    pub fn between(skeleton: &Skeleton, a: &JointVector<f64>, b: &JointVector<f64>) -> Self {
        let mut swing = Self::NONE;
        let joints = skeleton.encoders().iter().zip(a.as_array().iter().zip(b.as_array()));
        for (step, (encoder, (a, b))) in swing.steps.iter_mut().zip(joints) {
            *step = ((b - a) * encoder.scale).abs();
        }
        swing
    }

    pub(super) fn is_none(&self) -> bool {
        self.steps.iter().all(|step| *step == 0.0)
    }

    /// Of one joint, radians or metres.
    pub(super) fn step(&self, joint: usize) -> f64 {
        self.steps[joint]
    }

    /// No farther than this do some joints move a point that each of them can have so far from its axis.
    pub(super) fn motion_m(&self, kinds: &[JointKind], joints: std::ops::Range<usize>, reach_m: impl Fn(usize) -> f64) -> f64 {
        let moved = joints.map(|joint| match kinds[joint] {
            JointKind::Revolute => self.steps[joint] * reach_m(joint),
            JointKind::Prismatic => self.steps[joint],
        });
        moved.sum()
    }

    /// Angle by which some joints turn a thing at most.
    fn turn_rad(&self, axes: &[Axis], joints: std::ops::Range<usize>) -> f64 {
        joints.filter(|&joint| axes[joint].kind == JointKind::Revolute).map(|joint| self.steps[joint]).sum()
    }

    /// How far some joints move a point along a direction at most: `motion_m` bounds its motion in any.
    ///
    /// To first order by the slopes at the posture. A point whose path has an acceleration of at most `2 ω v`, by the joints' speeds of
    /// turning `ω` and the point's own `v` taken joint by joint, is off that by at most `ω v`.
    fn along_m(
        &self,
        axes: &[Axis],
        joints: std::ops::Range<usize>,
        point_m: &Vector3<f64>,
        direction: &Vector3<f64>,
        motion_m: f64,
    ) -> f64 {
        let slope = |axis: &Axis| match axis.kind {
            JointKind::Revolute => axis.direction.cross(&(point_m - axis.point_m)).dot(direction),
            JointKind::Prismatic => axis.direction.dot(direction),
        };
        let first_m: f64 = joints.clone().map(|joint| self.steps[joint] * slope(&axes[joint]).abs()).sum();
        (first_m + self.turn_rad(axes, joints) * motion_m).min(motion_m)
    }

    /// The least height that a thing behind some joints keeps above a plane that moves with what is before them. `motion_m` bounds the
    /// motion of all its points.
    pub(super) fn least_height_m(
        &self,
        posture: &Posture,
        joints: std::ops::Range<usize>,
        core: &Core,
        plane: (&Vector3<f64>, &Vector3<f64>),
        motion_m: f64,
    ) -> f64 {
        let (through_m, normal) = plane;
        let axes = posture.axes();
        let height_m = |point_m: &Vector3<f64>| {
            (point_m - through_m).dot(normal) - self.along_m(axes, joints.clone(), point_m, normal, motion_m)
        };
        match core {
            Core::Point(point_m) => height_m(point_m),
            Core::Segment(Segment { from_m, to_m }) => height_m(from_m).min(height_m(to_m)),
            Core::Disc(disc) => {
                let cosine = disc.normal.dot(normal);
                let turn_rad = self.turn_rad(axes, joints.clone());
                let tilts = joints.clone().filter(|&joint| axes[joint].kind == JointKind::Revolute);
                let tilt_rad: f64 = tilts.map(|joint| self.steps[joint] * axes[joint].direction.cross(&disc.normal).norm()).sum();
                let dip = sine(cosine) + cosine.abs() * (tilt_rad + turn_rad * turn_rad);
                height_m(&disc.centre_m) - disc.radius_m * dip.min(1.0)
            }
            Core::Below(_) => f64::NEG_INFINITY,
        }
    }

    /// The same for the bar, whose first end stands with the base and the other with the tool, and a plane that moves with what is
    /// behind `before` joints. `motions_m` bound those of the ends.
    pub(super) fn least_height_of_bar_m(
        &self,
        posture: &Posture,
        before: usize,
        bar: &Segment,
        plane: (&Vector3<f64>, &Vector3<f64>),
        motions_m: (f64, f64),
    ) -> f64 {
        let (through_m, normal) = plane;
        let axes = posture.axes();
        let height_m = |point_m: &Vector3<f64>, joints, motion_m| {
            (point_m - through_m).dot(normal) - self.along_m(axes, joints, point_m, normal, motion_m)
        };
        height_m(&bar.from_m, 0..before, motions_m.0).min(height_m(&bar.to_m, before..axes.len(), motions_m.1))
    }
}

/// How far a thing can be from the axes of the joints before it, metres, whatever the posture.
#[derive(Clone, Debug)]
pub(super) struct Reach {
    by_joint_m: Vec<f64>,
}

impl Reach {
    /// Of a thing that stands as `core` at a posture, behind `joints` joints.
    pub(super) fn new(skeleton: &Skeleton, limits: &[JointLimits], posture: &Posture, joints: usize, core: &Core) -> Self {
        let mut by_joint_m = vec![0.0; joints];
        let Some(last) = joints.checked_sub(1) else { return Self { by_joint_m } };
        let axis = &posture.axes()[last];
        // The origin behind the last joint before it: for a slide the farthest that it can be is added below.
        let origin_m = posture.corner_m(joints);
        by_joint_m[last] = farthest_m(core, |point_m| axis.direction.cross(&(point_m - axis.point_m)).norm(), &axis.direction);
        let behind = farthest_m(core, |point_m| (point_m - origin_m).norm(), &Vector3::zeros());
        // A slide's own capsule reaches back to where it comes from.
        let mut behind_m = behind.max(slide_m(skeleton, limits, last));
        for joint in (0..last).rev() {
            behind_m += slide_m(skeleton, limits, joint + 1);
            let translation_m = skeleton.translation_m(joint + 1);
            by_joint_m[joint] = behind_m + translation_m.xy().norm();
            behind_m += translation_m.norm();
        }
        Self { by_joint_m }
    }

    pub(super) fn of_joint_m(&self, joint: usize) -> f64 {
        self.by_joint_m[joint]
    }
}

/// How far a joint can slide; zero for one that turns.
fn slide_m(skeleton: &Skeleton, limits: &[JointLimits], joint: usize) -> f64 {
    let (encoder, limits) = (skeleton.encoders()[joint], limits[joint]);
    match encoder.kind {
        JointKind::Revolute => 0.0,
        JointKind::Prismatic => {
            [limits.min, limits.max].map(|q| (encoder.offset + encoder.scale * q).abs()).into_iter().fold(0.0, f64::max)
        }
    }
}

/// The farthest of a core's points; a disc that turns about its own axis stays what it is.
fn farthest_m(core: &Core, distance_m: impl Fn(&Vector3<f64>) -> f64, axis: &Vector3<f64>) -> f64 {
    match core {
        Core::Point(point_m) => distance_m(point_m),
        Core::Segment(Segment { from_m, to_m }) => distance_m(from_m).max(distance_m(to_m)),
        Core::Disc(disc) => distance_m(&disc.centre_m) + disc.radius_m * sine(disc.normal.dot(axis)),
        Core::Below(_) => 0.0,
    }
}
