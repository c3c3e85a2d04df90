//! What stands about the bar, and how near it comes to it: robot, table and fixtures as simple solids.

use ballbar::{JointKind, JointVector, Vector3};
use miette::Diagnostic;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use super::contact::{Contact, Nearest};
use super::geometry::{Disc, Segment};
use crate::files::{NamedPoint, PairingId, Rig, Robot, Solids};
use crate::kinematics::{Posture, Skeleton};
use crate::units::mm_from_m;

/// The rig cannot be as it is described.
#[derive(Clone, Debug, PartialEq, Error, Diagnostic)]
#[error("{one} and {other} are too near: {gap_mm:.1} mm between them, expected {wanted_mm:.1} mm or more")]
#[diagnostic(help("Check the positions in rig.toml, or give the true sizes in its [solids] table (docs/files.md)."))]
pub struct FixturesOverlap {
    one: String,
    other: String,
    gap_mm: f64,
    wanted_mm: f64,
}

/// Part of a link that a capsule stands for.
#[derive(Clone, Copy, Debug)]
enum Part {
    /// The slide of the prismatic joint before the link.
    Slide,
    /// Along the axis of the joint before it.
    Along,
    /// From that axis to the next joint.
    Across,
}

#[derive(Clone, Copy, Debug)]
struct Body {
    /// From 0.
    link: usize,
    part: Part,
    radius_m: f64,
    /// The capsule's far end is flush with the segment's.
    is_flush: bool,
}

/// Robot and rig as solids.
#[derive(Clone, Debug)]
pub struct Scene {
    solids: Solids,
    bodies: Vec<Body>,
    /// Bodies that may come near one another, as indices; those that share a joint always do.
    body_pairs: Vec<(usize, usize)>,
    /// Bodies that may come near the plate with the spheres.
    tool_bodies: Vec<usize>,
    table_z_m: f64,
    chuck_plate: Disc,
    chucks_m: Vec<Vector3<f64>>,
    sphere_plate_tool: Disc,
    spheres_tool_m: Vec<Vector3<f64>>,
}

impl Scene {
    /// Sets the scene; `clearance_m` is what has to stay between any two things.
    ///
    /// # Errors
    /// [`FixturesOverlap`] when fixtures meet wherever the robot stands.
    pub fn new(robot: &Robot, rig: &Rig, clearance_m: f64) -> Result<Self, FixturesOverlap> {
        let solids = rig.solids;
        let positions = |points: &[NamedPoint]| -> Vec<Vector3<f64>> { points.iter().map(|point| point.position_m).collect() };
        let (chucks_m, spheres_tool_m) = (positions(&rig.chucks), positions(&rig.spheres));
        let lowest_m = chucks_m.iter().map(|chuck_m| chuck_m.z).fold(f64::INFINITY, f64::min);
        let skeleton = Skeleton::new(&robot.chain);
        let bodies = bodies(&skeleton, &solids);
        let (body_pairs, tool_bodies) = free_pairs(&skeleton, robot, &bodies, clearance_m);
        let chuck_plate =
            carrier(&chucks_m, Vector3::z(), solids.chuck_plate_below_m, solids.chuck_radius_m + solids.chuck_plate_rim_m);
        let sphere_plate_tool = carrier(
            &spheres_tool_m,
            outward(&spheres_tool_m),
            solids.sphere_plate_behind_m,
            solids.sphere_radius_m + solids.sphere_plate_rim_m,
        );
        let mut scene = Self {
            table_z_m: lowest_m - solids.table_below_chucks_m,
            solids,
            bodies,
            body_pairs,
            tool_bodies: (0..tool_bodies).collect(),
            chuck_plate,
            chucks_m,
            sphere_plate_tool,
            spheres_tool_m,
        };
        scene.forget_inseparable(robot, &skeleton, clearance_m);
        scene.check_fixtures(rig, &skeleton.at(&ballbar::JointVector::zero()), clearance_m)?;
        Ok(scene)
    }

    /// Unit normal of the plate with the spheres, away from the robot; tool frame.
    pub fn sphere_plate_normal(&self) -> Vector3<f64> {
        self.sphere_plate_tool.normal
    }

    /// How far the tool reaches from its frame's origin, metres.
    pub fn tool_reach_m(&self) -> f64 {
        let spheres = self.spheres_tool_m.iter().map(|sphere_m| sphere_m.norm() + self.solids.sphere_radius_m);
        spheres.fold(self.sphere_plate_tool.centre_m.norm() + self.sphere_plate_tool.radius_m, f64::max)
    }

    /// The nearest two things at a posture, with the bar on the pairing, or without the bar.
    pub fn nearest(&self, posture: &Posture, attached: Option<PairingId>) -> Nearest {
        let mut least = Least::below(f64::INFINITY);
        self.see_all(posture, attached, &mut least);
        least.nearest
    }

    /// Whether any two things are at least so far apart: quicker than to ask for the nearest.
    pub fn is_apart(&self, posture: &Posture, attached: Option<PairingId>, gap_m: f64) -> bool {
        let mut least = Least::below(gap_m);
        self.see_all(posture, attached, &mut least);
        least.nearest.gap_m >= gap_m
    }

    fn see_all(&self, posture: &Posture, attached: Option<PairingId>, least: &mut Least) {
        let segments = self.segments(posture);
        if let Some(pairing) = attached {
            self.see_bar(posture, &segments, pairing, least);
        }
        self.see_robot(posture, &segments, least);
    }

    fn segments(&self, posture: &Posture) -> heapless::Vec<Segment, MAX_BODIES> {
        self.bodies.iter().map(|body| body.segment(posture)).collect()
    }

    /// Two bodies that are near one another in every posture are parts of one joint that plain capsules are too wide for.
    fn forget_inseparable(&mut self, robot: &Robot, skeleton: &Skeleton, clearance_m: f64) {
        const POSTURES: usize = 300;
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let postures: Vec<_> = (0..POSTURES)
            .map(|_| {
                let mut q = JointVector::zero();
                for (value, limits) in q.as_array_mut().iter_mut().zip(&robot.limits) {
                    *value = rng.random_range(limits.min..limits.max);
                }
                let posture = skeleton.at(&q);
                (self.segments(&posture), self.sphere_plate(&posture))
            })
            .collect();
        let (mut body_pairs, mut tool_bodies) = (std::mem::take(&mut self.body_pairs), std::mem::take(&mut self.tool_bodies));
        body_pairs.retain(|&(a, b)| postures.iter().any(|(segments, _)| self.links_gap_m(segments, a, b) >= clearance_m));
        tool_bodies
            .retain(|&body| postures.iter().any(|(segments, plate)| self.tool_gap_m(segments, plate, body) >= clearance_m));
        (self.body_pairs, self.tool_bodies) = (body_pairs, tool_bodies);
    }

    fn links_gap_m(&self, segments: &[Segment], a: usize, b: usize) -> f64 {
        segments[a].distance_to_segment(&segments[b]) - self.bodies[a].radius_m - self.bodies[b].radius_m
    }

    fn tool_gap_m(&self, segments: &[Segment], plate: &Disc, body: usize) -> f64 {
        plate.distance_to_segment(&segments[body]) - self.bodies[body].radius_m
    }

    fn see_bar(&self, posture: &Posture, segments: &[Segment], pairing: PairingId, least: &mut Least) {
        let radius_m = self.solids.bar_radius_m;
        let sphere = |index: usize| posture.point_in_base(&self.spheres_tool_m[index]);
        let bar = Segment { from_m: self.chucks_m[pairing.chuck], to_m: sphere(pairing.sphere) };
        least.see(bar.from_m.z.min(bar.to_m.z) - self.table_z_m - radius_m, Contact::BarTable);
        least.see_disc(&self.chuck_plate, &bar, radius_m, Contact::BarChuckPlate);
        least.see_disc(&self.sphere_plate(posture), &bar, radius_m, Contact::BarSpherePlate);
        for (_, chuck_m) in self.chucks_m.iter().enumerate().filter(|(i, _)| *i != pairing.chuck) {
            least.see(bar.distance_to_point(chuck_m) - radius_m - self.solids.chuck_radius_m, Contact::BarChuck);
        }
        for i in (0..self.spheres_tool_m.len()).filter(|&i| i != pairing.sphere) {
            least.see(bar.distance_to_point(&sphere(i)) - radius_m - self.solids.sphere_radius_m, Contact::BarSphere);
        }
        for (body, segment) in self.bodies.iter().zip(segments) {
            least.see(bar.distance_to_segment(segment) - radius_m - body.radius_m, Contact::BarLink(body.link + 1));
        }
    }

    fn see_robot(&self, posture: &Posture, segments: &[Segment], least: &mut Least) {
        // The first is the robot's foot, which stands on the table.
        for (body, segment) in self.bodies.iter().zip(segments).skip(1) {
            let number = body.link + 1;
            let height_m = segment.from_m.z.min(segment.to_m.z);
            least.see(height_m - self.table_z_m - body.radius_m, Contact::LinkTable(number));
            least.see_disc(&self.chuck_plate, segment, body.radius_m, Contact::LinkChucks(number));
            for chuck_m in &self.chucks_m {
                let gap_m = segment.distance_to_point(chuck_m) - body.radius_m - self.solids.chuck_radius_m;
                least.see(gap_m, Contact::LinkChucks(number));
            }
        }
        for &(a, b) in &self.body_pairs {
            least.see(self.links_gap_m(segments, a, b), Contact::Links(self.bodies[a].link + 1, self.bodies[b].link + 1));
        }
        let plate = self.sphere_plate(posture);
        least.see(plate.lowest_z_m() - self.table_z_m, Contact::ToolTable);
        for chuck_m in &self.chucks_m {
            least.see(plate.distance_to_point(chuck_m) - self.solids.chuck_radius_m, Contact::ToolTable);
        }
        for sphere_m in self.spheres_tool_m.iter().map(|sphere_m| posture.point_in_base(sphere_m)) {
            least.see(sphere_m.z - self.table_z_m - self.solids.sphere_radius_m, Contact::ToolTable);
            least.see(self.chuck_plate.distance_to_point(&sphere_m) - self.solids.sphere_radius_m, Contact::ToolTable);
        }
        for &body in &self.tool_bodies {
            let contact = Contact::ToolLink(self.bodies[body].link + 1);
            least.see_disc(&plate, &segments[body], self.bodies[body].radius_m, contact);
        }
    }

    fn sphere_plate(&self, posture: &Posture) -> Disc {
        let plate = &self.sphere_plate_tool;
        Disc {
            centre_m: posture.point_in_base(&plate.centre_m),
            normal: posture.base_from_tool.rotation * plate.normal,
            radius_m: plate.radius_m,
        }
    }

    /// What no posture could part.
    fn check_fixtures(&self, rig: &Rig, posture: &Posture, clearance_m: f64) -> Result<(), FixturesOverlap> {
        let solids = &self.solids;
        let part = |one: String, other: &str, gap_m: f64, wanted_m: f64| {
            if gap_m >= wanted_m {
                return Ok(());
            }
            Err(FixturesOverlap { one, other: other.to_owned(), gap_mm: mm_from_m(gap_m), wanted_mm: mm_from_m(wanted_m) })
        };
        let ends = [("chuck", &rig.chucks, solids.chuck_radius_m), ("sphere", &rig.spheres, solids.sphere_radius_m)];
        for (what, points, radius_m) in ends {
            for (i, a) in points.iter().enumerate() {
                for b in &points[..i] {
                    let gap_m = (a.position_m - b.position_m).norm() - 2.0 * radius_m;
                    part(format!("{what} {}", b.name), &format!("{what} {}", a.name), gap_m, 0.0)?;
                }
            }
        }
        if let Some(foot) = self.bodies.first() {
            let segment = foot.segment(posture);
            let name = || "the robot's foot".to_owned();
            part(name(), "the chuck plate", self.chuck_plate.distance_to_segment(&segment) - foot.radius_m, 0.0)?;
            for chuck in &rig.chucks {
                let gap_m = segment.distance_to_point(&chuck.position_m) - foot.radius_m - solids.chuck_radius_m;
                part(name(), &format!("chuck {}", chuck.name), gap_m, clearance_m)?;
            }
        }
        let bar = |height_m: f64| height_m - solids.bar_radius_m;
        for chuck in &rig.chucks {
            let (table_m, plate_m) = (chuck.position_m.z - self.table_z_m, self.chuck_plate.distance_to_point(&chuck.position_m));
            part(format!("a bar in chuck {}", chuck.name), "the table", bar(table_m), clearance_m)?;
            part(format!("a bar in chuck {}", chuck.name), "the chuck plate", bar(plate_m), clearance_m)?;
        }
        for sphere in &rig.spheres {
            let plate_m = self.sphere_plate_tool.distance_to_point(&sphere.position_m);
            part(format!("a bar on sphere {}", sphere.name), "the sphere plate", bar(plate_m), clearance_m)?;
        }
        Ok(())
    }
}

/// The least gap seen so far.
struct Least {
    nearest: Nearest,
}

impl Least {
    /// Only what is nearer than this will be seen.
    fn below(gap_m: f64) -> Self {
        Self { nearest: Nearest { gap_m, contact: Contact::ToolTable } }
    }

    fn see(&mut self, gap_m: f64, contact: Contact) {
        if gap_m < self.nearest.gap_m {
            self.nearest = Nearest { gap_m, contact };
        }
    }

    /// A disc and a capsule: most are far apart, and then a ball about the disc is already farther than what was seen.
    fn see_disc(&mut self, disc: &Disc, segment: &Segment, radius_m: f64, contact: Contact) {
        if disc.least_distance_to_segment(segment) - radius_m < self.nearest.gap_m {
            self.see(disc.distance_to_segment(segment) - radius_m, contact);
        }
    }
}

/// Three parts a link at most.
const MAX_BODIES: usize = 3 * (ballbar::MAX_JOINTS + 1);

impl Body {
    fn segment(&self, posture: &Posture) -> Segment {
        let (from_m, to_m) = match self.part {
            Part::Slide => (posture.end_m(self.link - 1), posture.start_m(self.link)),
            Part::Along => (posture.start_m(self.link), posture.corner_m(self.link)),
            Part::Across => (posture.corner_m(self.link), posture.end_m(self.link)),
        };
        if !self.is_flush {
            return Segment { from_m, to_m };
        }
        let length_m = (to_m - from_m).norm();
        let share = if length_m > 0.0 { (1.0 - self.radius_m / length_m).max(0.0) } else { 0.0 };
        Segment { from_m, to_m: from_m + (to_m - from_m) * share }
    }
}

/// A capsule for each part of a link that has a length.
fn bodies(skeleton: &Skeleton, solids: &Solids) -> Vec<Body> {
    const NO_LENGTH_M: f64 = 1e-6;
    let mut bodies = Vec::new();
    for link in 0..=skeleton.joints() {
        let translation_m = skeleton.translation_m(link);
        let slides = link > 0 && skeleton.encoders()[link - 1].kind == JointKind::Prismatic;
        let parts = [
            (Part::Slide, slides),
            (Part::Along, translation_m.z.abs() > NO_LENGTH_M),
            (Part::Across, translation_m.xy().norm() > NO_LENGTH_M),
        ];
        let there = parts.into_iter().filter(|(_, is_there)| *is_there);
        bodies.extend(there.map(|(part, _)| Body { link, part, radius_m: solids.link_radius_m, is_flush: false }));
    }
    if let Some(last) = bodies.last_mut() {
        last.radius_m = solids.last_link_radius_m;
        last.is_flush = true;
    }
    bodies
}

/// Pairs of bodies with enough arm between them to be apart, and how many bodies the plate with the spheres can be apart from.
fn free_pairs(skeleton: &Skeleton, robot: &Robot, bodies: &[Body], clearance_m: f64) -> (Vec<(usize, usize)>, usize) {
    let shortest_m = |body: &Body| {
        let translation_m = skeleton.translation_m(body.link);
        match body.part {
            Part::Slide => {
                let (encoder, limits) = (skeleton.encoders()[body.link - 1], robot.limits[body.link - 1]);
                let ends = [limits.min, limits.max].map(|q| encoder.offset + encoder.scale * q);
                if ends[0] * ends[1] <= 0.0 { 0.0 } else { ends[0].abs().min(ends[1].abs()) }
            }
            Part::Along => translation_m.z.abs(),
            Part::Across => translation_m.xy().norm(),
        }
    };
    let arm_m = |from: usize, to: usize| bodies[from..to].iter().map(shortest_m).sum::<f64>();
    let mut pairs = Vec::new();
    for (b, second) in bodies.iter().enumerate() {
        for (a, first) in bodies.iter().enumerate().take(b) {
            if arm_m(a + 1, b) > first.radius_m + second.radius_m + clearance_m {
                pairs.push((a, b));
            }
        }
    }
    let is_free = |&a: &usize| arm_m(a + 1, bodies.len()) > bodies[a].radius_m + clearance_m && a + 1 < bodies.len();
    (pairs, (0..bodies.len()).take_while(is_free).count())
}

/// The disc that carries some points at `height_m` behind them; `side` says where before is.
fn carrier(points_m: &[Vector3<f64>], side: Vector3<f64>, height_m: f64, rim_m: f64) -> Disc {
    let centre_m = points_m.iter().sum::<Vector3<f64>>() / points_m.len() as f64;
    let normal = plane_normal(points_m).map_or(side, |normal| if normal.dot(&side) < 0.0 { -normal } else { normal });
    let widest_m = points_m.iter().map(|point_m| (point_m - centre_m).norm()).fold(0.0, f64::max);
    Disc { centre_m: centre_m - normal * height_m, normal, radius_m: widest_m + rim_m }
}

/// From the tool's origin to its spheres; along its z when they are about it.
fn outward(spheres_tool_m: &[Vector3<f64>]) -> Vector3<f64> {
    let sum_m = spheres_tool_m.iter().sum::<Vector3<f64>>();
    sum_m.try_normalize(1e-9).unwrap_or(Vector3::z())
}

/// Unit normal of the plane through the points that span the largest triangle; `None` when they are in one line.
fn plane_normal(points_m: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let (first_m, others_m) = points_m.split_first()?;
    let mut largest = Vector3::zeros();
    for (i, a_m) in others_m.iter().enumerate() {
        for b_m in &others_m[..i] {
            let across = (a_m - first_m).cross(&(b_m - first_m));
            if across.norm() > largest.norm() {
                largest = across;
            }
        }
    }
    largest.try_normalize(1e-9)
}
