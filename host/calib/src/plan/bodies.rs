//! What a robot's links look like: capsules along the way from joint to joint.

use ballbar::{JointKind, JointVector, Vector3};

use super::geometry::Segment;
use crate::kinematics::{Posture, Skeleton};
use crate::model::Solids;

/// Part of a link that a capsule stands for.
#[derive(Clone, Copy, Debug)]
enum Part {
    /// The slide of the prismatic joint before the link.
    Slide,
    /// Along the axis of the joint before it.
    Along,
    /// From that axis to the next one.
    Across,
}

/// A capsule of a link.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body {
    /// From 0.
    pub(super) link: usize,
    part: Part,
    pub(super) radius_m: f64,
    /// The capsule's far end is flush with the segment's.
    is_flush: bool,
}

/// Shorter parts, in radii of a link, lie in the rounded ends of their neighbours but for a fiftieth of a radius; fitted robots have offsets
/// of micrometres and millimetres everywhere.
const SHORT_RADII: f64 = 0.4;

impl Body {
    pub(super) fn is_slide(&self) -> bool {
        matches!(self.part, Part::Slide)
    }

    pub(super) fn segment(&self, posture: &Posture) -> Segment {
        let (start_m, corner_m, end_m) = (posture.start_m(self.link), posture.corner_m(self.link), posture.end_m(self.link));
        let (from_m, to_m) = match self.part {
            Part::Slide => (posture.end_m(self.link - 1), start_m),
            Part::Along => (start_m, corner_m),
            Part::Across => (corner_m, end_m),
        };
        if !self.is_flush {
            return Segment { from_m, to_m };
        }
        let along_m = to_m - from_m;
        // Only a slide can have no length.
        let axis = || self.link.checked_sub(1).map_or(Vector3::z(), |joint| posture.axes()[joint].direction);
        let to_m = to_m - along_m.try_normalize(f64::EPSILON).unwrap_or_else(axis) * self.radius_m;
        Segment { from_m: if along_m.norm() > self.radius_m { from_m } else { to_m }, to_m }
    }
}

/// The capsules of all links, from the base. Those of the last link that has one are narrower, and the very last one is flush with its
/// end, since the plate with the spheres begins there.
pub(super) fn bodies(skeleton: &Skeleton, solids: &Solids) -> Vec<Body> {
    let mut bodies: Vec<Body> = Vec::new();
    let home = skeleton.at(&JointVector::zero());
    for link in 0..=skeleton.joints() {
        let (start_m, corner_m, end_m) = (home.start_m(link), home.corner_m(link), home.end_m(link));
        let is_long = |from_m: Vector3<f64>, to_m: Vector3<f64>| (to_m - from_m).norm() > SHORT_RADII * solids.link_radius_m;
        let slides = link > 0 && skeleton.encoders()[link - 1].kind == JointKind::Prismatic;
        let parts = [(Part::Slide, slides), (Part::Along, is_long(start_m, corner_m)), (Part::Across, is_long(corner_m, end_m))];
        let there = parts.into_iter().filter(|(_, is_there)| *is_there);
        bodies.extend(there.map(|(part, _)| Body { link, part, radius_m: solids.link_radius_m, is_flush: false }));
    }
    let last_link = bodies.last().map(|body| body.link);
    for body in bodies.iter_mut().filter(|body| Some(body.link) == last_link) {
        body.radius_m = solids.last_link_radius_m;
    }
    if let Some(last) = bodies.last_mut() {
        last.is_flush = true;
    }
    bodies
}
