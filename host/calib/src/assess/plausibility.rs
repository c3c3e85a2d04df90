//! Changes that no robot's design is off by, and joint values that no robot's joints have.

use std::fmt;

use ballbar::{Chain, JointKind, Link, Pose, Vector3};

use crate::identify::Fit;
use crate::kinematics::{CanonicalFrames, apart, compose, from_link, inverse};
use crate::model::{Dataset, Robot};
use crate::units::{ScreenUnit, fixed};

/// A part of a chain that changed by more than designs are off.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Change {
    /// Which part, such as `the origin of link 3`.
    pub part: String,
    /// By how much, SI.
    pub size: f64,
    /// Its unit.
    pub unit: ScreenUnit,
    /// Whether no robot is so far from its design, wherever it stands and whatever its tool.
    pub is_impossible: bool,
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.unit.from_si(self.size);
        match self.unit {
            ScreenUnit::Millimetre => write!(f, "{} by {} mm", self.part, fixed(size, 0)),
            ScreenUnit::Degree => write!(f, "{} by {}°", self.part, fixed(size, 0)),
            ScreenUnit::One => write!(f, "{} by {}", self.part, fixed(size, 3)),
            other => write!(f, "{} by {} {}", self.part, fixed(size, 3), other.name()),
        }
    }
}

/// Beyond the first a change is remarkable, beyond the second it is impossible. SI.
struct Bounds {
    displacement_m: (f64, f64),
    rotation_rad: (f64, f64),
}

/// Where a robot stands, and how a tool is mounted on it, is often known only by eye: these may be far off and the result good. A
/// quarter turn or half a metre is another mistake.
const ENDS: Bounds = Bounds { displacement_m: (0.1, 0.5), rotation_rad: (TEN_DEGREES, 5.0 * TEN_DEGREES) };
/// Inside an arm designs are right within millimetres and, lost zeros of joints apart, tenths of a degree. Twenty times the plausible
/// error: no manufacturer delivers that.
const INSIDE: Bounds = Bounds { displacement_m: (0.1, 0.1), rotation_rad: (TEN_DEGREES, TEN_DEGREES) };
/// A long link turned by the angle that is allowed moves its end by so much of its length.
const SHARE_OF_LENGTH: f64 = 0.2;
/// Of a scale, beside 1.
const SCALE: f64 = 0.1;
const TEN_DEGREES: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// What changed by more than designs are off, from a design to a fit. Links are judged whole, their displacement and their rotation: how
/// a rotation is split into three angles means nothing, and both robots are seen in the design's canonical frames: a frame that somebody wrote a
/// hundred metres away moves by as much with the least turn.
pub(super) fn large_changes(design: &Chain<f64>, fitted: &Chain<f64>) -> Vec<Change> {
    changes_since(design, design, fitted)
}

/// The same of a fit that may have found lost zeros: links are compared as if those had not been lost.
pub(super) fn large_changes_of(design: &Chain<f64>, fit: &Fit) -> Vec<Change> {
    changes_since(design, &fit.remastered(design), &fit.solution.chain)
}

fn changes_since(as_written: &Chain<f64>, design: &Chain<f64>, fitted: &Chain<f64>) -> Vec<Change> {
    let (remastered, frames) = (design, CanonicalFrames::new(design));
    let (design, fitted) = (frames.chain(), &frames.in_canonical_frames(fitted));
    let joints = design.joints();
    let mut changes = Vec::new();
    let mut judge = |part: String, size: f64, unit: ScreenUnit, (remarkable, impossible): (f64, f64)| {
        // What is no number is beyond every bound.
        let is_beyond = |bound: f64| size.is_nan() || size > bound;
        if is_beyond(remarkable) {
            changes.push(Change { part, size, unit, is_impossible: is_beyond(impossible) });
        }
    };
    for (i, (before, after)) in links_of_both(design, fitted).into_iter().enumerate() {
        let bounds = if i == 0 || i == joints { ENDS } else { INSIDE };
        let name = match i {
            0 => "link 1, where the robot stands,".to_owned(),
            last if last == joints => format!("link {}, the tool,", last + 1),
            inside => format!("link {}", inside + 1),
        };
        let longest_m = SHARE_OF_LENGTH * before.translation_m.norm();
        let (remarkable_m, impossible_m) = bounds.displacement_m;
        let displacement_m = (remarkable_m.max(longest_m), impossible_m.max(longest_m));
        judge(name.clone(), (after.translation_m - before.translation_m).norm(), ScreenUnit::Millimetre, displacement_m);
        judge(name, apart(&before, &after).1, ScreenUnit::Degree, bounds.rotation_rad);
    }
    for i in 0..joints {
        let (Some(before), Some(after)) = (design.joint(i), fitted.joint(i)) else { continue };
        let unit = ScreenUnit::from(before.kind);
        let lost = remastered.joint(i).zip(as_written.joint(i)).map_or(0.0, |(found, written)| found.offset - written.offset);
        let off = after.offset - before.offset + lost;
        let (off, bounds) = match before.kind {
            JointKind::Revolute => (wrapped(off), ENDS.rotation_rad),
            JointKind::Prismatic => (off.abs(), ENDS.displacement_m),
        };
        judge(format!("the zero of joint {}", i + 1), off, unit, bounds);
        let of_scale = (after.scale - before.scale).abs() / before.scale.abs();
        judge(format!("the scale of joint {}", i + 1), of_scale, ScreenUnit::One, (SCALE, SCALE));
    }
    changes
}

/// How far a fit says that a robot stands, or its tool is mounted, from where its file says, in units of what is remarkable: the larger of both.
pub(super) fn change_of_ends(design: &Chain<f64>, fitted: &Chain<f64>) -> f64 {
    let frames = CanonicalFrames::new(design);
    let (design, fitted) = (frames.chain(), &frames.in_canonical_frames(fitted));
    let links = links_of_both(design, fitted);
    let ends = links.first().into_iter().chain(links.last());
    let change = ends.map(|(before, after)| {
        let (displacement_m, turn_rad) = apart(before, after);
        (displacement_m / ENDS.displacement_m.0).max(turn_rad / ENDS.rotation_rad.0)
    });
    change.fold(0.0, f64::max)
}

/// Each link in both chains, which are in one's canonical frames.
///
/// There the last joint's frame follows the tool along and about its axis (of a slide, wherever it is), so that a tool which is mounted elsewhere would
/// look like a link of the arm that has changed: what the tool can do alone counts as its own.
fn links_of_both(design: &Chain<f64>, fitted: &Chain<f64>) -> Vec<(Pose<f64>, Pose<f64>)> {
    let links = |chain: &Chain<f64>| (0..=chain.joints()).filter_map(|i| chain.link(i)).map(pose).collect::<Vec<_>>();
    let (before, mut after) = (links(design), links(fitted));
    if let ([.., arm, _], [.., found_arm, found_tool]) = (before.as_slice(), after.as_mut_slice()) {
        let moved = found_arm.rotation.tr_mul(&(found_arm.translation_m - arm.translation_m));
        let moved = match fitted.joint_kinds().last() {
            Some(JointKind::Prismatic) => moved,
            _ => Vector3::new(0.0, 0.0, moved.z),
        };
        let turned = arm.rotation.tr_mul(&found_arm.rotation);
        let turn_rad = (turned[(1, 0)] - turned[(0, 1)]).atan2(turned[(0, 0)] + turned[(1, 1)]);
        let by_tool = compose(&from_link(Vector3::zeros(), [turn_rad, 0.0, 0.0]), &from_link(moved, [0.0; 3]));
        *found_tool = compose(&by_tool, found_tool);
        *found_arm = compose(found_arm, &inverse(&by_tool));
    }
    before.into_iter().zip(after).collect()
}

fn pose(link: Link<f64>) -> Pose<f64> {
    from_link(link.translation_m, [link.alpha_rad, link.beta_rad, link.gamma_rad])
}

/// Size of an angle, whole turns aside.
fn wrapped(angle_rad: f64) -> f64 {
    let within = angle_rad.rem_euclid(std::f64::consts::TAU);
    within.min(std::f64::consts::TAU - within)
}

/// Rows in which a joint stood far beyond its limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BeyondLimits {
    /// How many.
    pub(super) rows: usize,
    /// The first of them, an index.
    pub(super) first: usize,
    /// The joint that is the farthest beyond there, from 1.
    pub(super) joint: usize,
}

/// Joint values that no joint of this robot can have: beyond a limit by more than a tenth of the range. What is just beyond is a limit
/// that was stated too narrow. `None` where there are none.
pub(super) fn far_beyond_limits(robot: &Robot, dataset: &Dataset) -> Option<BeyondLimits> {
    const FAR: f64 = 0.1;
    let beyond = |row: usize| {
        let q = dataset.rows[row].measurement.q.as_array();
        let joints = robot.limits.iter().zip(q).enumerate();
        let shares = joints.map(|(i, (limits, &q))| (i + 1, (limits.min - q).max(q - limits.max) / (limits.max - limits.min)));
        shares.filter(|(_, share)| *share > FAR).max_by(|a, b| a.1.total_cmp(&b.1)).map(|(joint, _)| (row, joint))
    };
    let rows: Vec<(usize, usize)> = (0..dataset.rows.len()).filter_map(beyond).collect();
    rows.first().map(|&(first, joint)| BeyondLimits { rows: rows.len(), first, joint })
}
