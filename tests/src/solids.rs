//! Robot, bar and fixtures as solids once more, from `docs/planning.md` alone: frames by nalgebra's isometries, distances by `parry`. It
//! shares no code with the planner.

use ballbar::{Chain, JointKind};
use ballbar_calib::model::{PairingId, Rig, Robot};
use nalgebra::{Isometry3, Matrix4, Point3, Translation3, UnitQuaternion, Vector3};
use parry3d_f64::math::{Pose, Rot3, Vector};
use parry3d_f64::query;
use parry3d_f64::shape::{Ball, Cylinder, HalfSpace, Segment, Shape};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::naive;

type V = Vector3<f64>;

/// What it is, and which one of its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Table,
    ChuckPlate,
    Chuck(usize),
    /// From 1.
    Link(usize),
    SpherePlate,
    Sphere(usize),
    Bar,
}

/// A shape of `parry`'s in the base frame, and how far its solid reaches beyond it.
struct Solid {
    kind: Kind,
    /// How many joints move it.
    joints: usize,
    shape: Box<dyn Shape>,
    pose: Pose,
    radius: f64,
    /// About which everything of it lies within `around`.
    middle: V,
    around: f64,
}

fn vector(v: &V) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// The half space that stands for the table begins so far below it, so that what is in the table has a distance, too.
const DEPTH: f64 = 10.0;
/// Of a plate; it has none.
const THICKNESS: f64 = 1e-9;

impl Solid {
    fn ball(kind: Kind, joints: usize, centre: V, radius: f64) -> Self {
        let (shape, pose) = (Box::new(Ball::new(0.0)), Pose::from_translation(vector(&centre)));
        Self { kind, joints, shape, pose, radius, middle: centre, around: radius }
    }

    fn capsule(kind: Kind, joints: usize, from: V, to: V, radius: f64) -> Self {
        let shape = Box::new(Segment::new(vector(&from), vector(&to)));
        let (middle, around) = ((from + to) / 2.0, (to - from).norm() / 2.0 + radius);
        Self { kind, joints, shape, pose: Pose::IDENTITY, radius, middle, around }
    }

    fn plate(kind: Kind, joints: usize, centre: V, normal: V, wide: f64) -> Self {
        let turn = Rot3::from_rotation_arc(Vector::Y, vector(&normal));
        let (shape, pose) = (Box::new(Cylinder::new(THICKNESS, wide)), Pose::from_parts(vector(&centre), turn));
        Self { kind, joints, shape, pose, radius: 0.0, middle: centre, around: wide }
    }

    fn table(height: f64) -> Self {
        let (shape, pose) = (Box::new(HalfSpace::new(Vector::Z)), Pose::from_translation(Vector::new(0.0, 0.0, height - DEPTH)));
        Self { kind: Kind::Table, joints: 0, shape, pose, radius: DEPTH, middle: V::zeros(), around: f64::INFINITY }
    }

    fn gap(&self, other: &Self) -> f64 {
        let found = query::distance(&self.pose, &*self.shape, &other.pose, &*other.shape).expect("shapes of parry's");
        found.distance - self.radius - other.radius
    }

    /// The gap of one end of a line.
    fn end_gap(&self, end: usize, other: &Self) -> Option<f64> {
        let line = self.shape.as_segment()?;
        let point = [line.a, line.b][end];
        Some(Self::ball(self.kind, self.joints, V::new(point.x, point.y, point.z), self.radius).gap(other))
    }

    /// Without a piece of a line as long as it is thick, at some of its ends.
    fn without_ends(&self, ends: impl Iterator<Item = usize>) -> Option<Self> {
        let line = self.shape.as_segment()?;
        let (mut points, along) = ([line.a, line.b], (line.b - line.a).normalize());
        for end in ends {
            points[end] += along * if end == 0 { self.radius } else { -self.radius };
        }
        let [from, to] = points.map(|point| V::new(point.x, point.y, point.z));
        Some(Self::capsule(self.kind, self.joints, from, to, self.radius))
    }

    /// No more than the gap.
    fn least_gap(&self, other: &Self) -> f64 {
        (self.middle - other.middle).norm() - self.around - other.around
    }
}

/// Two solids, by index, and ends of lines among them, each by index and 0 or 1.
struct Pair {
    a: usize,
    b: usize,
    /// They keep their gap.
    still: Vec<(usize, usize)>,
    /// They keep a gap that is too small: what is round about them is left away.
    cut: Vec<(usize, usize)>,
}

/// What of a solid keeps its gap to one end of the bar, which is in the middle of a chuck or sphere; solids by index.
struct BarEnd {
    of_bar: usize,
    solid: usize,
    all: bool,
    still: Vec<usize>,
    cut: Vec<usize>,
}

/// What the solids of one rig are made of. The rig's chucks must lie in a plane across the base's z, its spheres across the tool's.
pub struct NaiveCell<'a> {
    robot: &'a Robot,
    rig: &'a Rig,
    /// Of the solids those whose gap the posture decides.
    pairs: Vec<Pair>,
    bar_ends: Vec<BarEnd>,
}

/// Least and most.
fn range(gaps: impl Iterator<Item = f64>) -> (f64, f64) {
    gaps.fold((f64::MAX, f64::MIN), |(least, most), gap| (gap.min(least), gap.max(most)))
}

/// Motion cannot change a gap that differs by less.
const CONSTANT: f64 = 5e-3;

/// Of a link where it begins, behind the joint before it, and where it ends, before the joint behind it or at the tool.
type Frames = (Isometry3<f64>, V, Isometry3<f64>);

/// Where the way along the links comes to an axis, and where it leaves it, at encoders zero; both at the base's origin for the first link.
struct Turns {
    comes: V,
    leaves: V,
}

/// Of all links.
fn frames(chain: &Chain<f64>, q: &[f64]) -> Vec<Frames> {
    let mut frame = Isometry3::identity();
    let mut frames = Vec::new();
    for i in 0..=chain.joints() {
        let link = chain.link(i).expect("a link");
        let axis = |axis: V, angle: f64| UnitQuaternion::new(axis * angle);
        let turn = axis(V::z(), link.alpha_rad) * axis(V::y(), link.beta_rad) * axis(V::x(), link.gamma_rad);
        let end = frame * Isometry3::from_parts(Translation3::from(link.translation_m), turn);
        frames.push((frame, link.translation_m, end));
        frame = end;
        if let (Some(joint), Some(q)) = (chain.joint(i), q.get(i)) {
            let theta = joint.offset + joint.scale * q;
            frame *= match joint.kind {
                JointKind::Revolute => Isometry3::rotation(V::z() * theta),
                JointKind::Prismatic => Isometry3::translation(0.0, 0.0, theta),
            };
        }
    }
    frames
}

/// The tool's pose by the naive chain.
pub fn base_from_tool(chain: &Chain<f64>, q: &[f64]) -> Matrix4<f64> {
    let parameters: Vec<num_complex::Complex<f64>> = chain.parameters().iter().map(|&value| value.into()).collect();
    naive::base_from_tool(chain.joint_kinds(), &parameters, q).map(|entry| entry.re)
}

impl<'a> NaiveCell<'a> {
    /// Prepares a robot at its rig; `clearance_m` only decides which links are too near one another by construction to be looked at.
    pub fn new(robot: &'a Robot, rig: &'a Rig, clearance_m: f64) -> Self {
        const POSTURES: usize = 400;
        let mut cell = Self { robot, rig, pairs: Vec::new(), bar_ends: Vec::new() };
        let mut rng = ChaCha8Rng::seed_from_u64(1234);
        let postures: Vec<Vec<Solid>> = (0..POSTURES).map(|_| cell.solids(&cell.random_posture(&mut rng))).collect();
        let one = &postures[0];
        let foot = one.iter().find(|solid| matches!(solid.kind, Kind::Link(_))).map(|solid| solid.kind);
        for b in 0..one.len() {
            for a in 0..b {
                let is_foot = one[a].kind == Kind::Table && Some(one[b].kind) == foot;
                if one[a].joints == one[b].joints || is_foot {
                    continue;
                }
                let (least, most) = range(postures.iter().map(|solids| solids[a].gap(&solids[b])));
                let are_links = matches!((one[a].kind, one[b].kind), (Kind::Link(_), Kind::Link(_)));
                if most - least < CONSTANT || (most < clearance_m && are_links) {
                    continue;
                }
                let mut pair = Pair { a, b, still: Vec::new(), cut: Vec::new() };
                for (i, end) in [(a, 0), (a, 1), (b, 0), (b, 1)] {
                    let (least, most) = range(postures.iter().filter_map(|solids| solids[i].end_gap(end, &solids[a + b - i])));
                    if (0.0..CONSTANT).contains(&(most - least)) {
                        if least >= clearance_m { pair.still.push((i, end)) } else { pair.cut.push((i, end)) }
                    }
                }
                cell.pairs.push(pair);
            }
        }
        cell.bar_ends = cell.bar_ends(&postures, clearance_m);
        cell
    }

    fn bar_ends(&self, postures: &[Vec<Solid>], clearance: f64) -> Vec<BarEnd> {
        let one = &postures[0];
        let bar =
            |solids: &[Solid], of_bar: usize| Solid::ball(Kind::Bar, 0, solids[of_bar].middle, self.rig.solids.bar_radius_m);
        let of_bar = (0..one.len()).filter(|&i| matches!(one[i].kind, Kind::Chuck(_) | Kind::Sphere(_)));
        let ends =
            of_bar.flat_map(|of_bar| (0..one.len()).filter(move |&solid| solid != of_bar).map(move |solid| (of_bar, solid)));
        let is_constant = |(least, most): (f64, f64)| (0.0..CONSTANT).contains(&(most - least));
        let bar_end = |(of_bar, solid): (usize, usize)| {
            let all = range(postures.iter().map(|solids| solids[solid].gap(&bar(solids, of_bar))));
            let mut found = BarEnd { of_bar, solid, all: is_constant(all), still: Vec::new(), cut: Vec::new() };
            if one[solid].joints == one[of_bar].joints {
                return found;
            }
            for end in [0, 1] {
                let gaps = range(postures.iter().filter_map(|solids| solids[solid].end_gap(end, &bar(solids, of_bar))));
                if is_constant(gaps) {
                    if gaps.0 >= clearance { found.still.push(end) } else { found.cut.push(end) }
                }
            }
            found
        };
        ends.map(bar_end).collect()
    }

    /// How many pairs of solids are looked at, without the bar.
    pub fn pairs(&self) -> usize {
        self.pairs.len()
    }

    /// A joint vector within limits.
    pub fn random_posture(&self, rng: &mut ChaCha8Rng) -> Vec<f64> {
        self.robot.limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect()
    }

    /// Length of the bar, metres.
    pub fn length_m(&self, q: &[f64], pairing: PairingId) -> f64 {
        let frames = frames(&self.robot.chain, q);
        let sphere = Point3::from(self.rig.spheres[pairing.sphere].position_m);
        (frames[frames.len() - 1].2 * sphere - Point3::from(self.rig.chucks[pairing.chuck].position_m)).norm()
    }

    /// The least gap between any two solids that motion can bring nearer, metres, and between which.
    pub fn gap_m(&self, q: &[f64], attached: Option<PairingId>) -> (f64, String) {
        let solids = self.solids(q);
        let mut nearest = (f64::INFINITY, (Kind::Bar, Kind::Bar));
        if let Some(pairing) = attached {
            let index = |kind| solids.iter().position(|solid| solid.kind == kind).expect("an end of the bar");
            let of_bar = [index(Kind::Chuck(pairing.chuck)), index(Kind::Sphere(pairing.sphere))];
            let radius = self.rig.solids.bar_radius_m;
            let [chuck, sphere] = of_bar.map(|end| solids[end].middle);
            let bar = Solid::capsule(Kind::Bar, 0, chuck, sphere, radius);
            for (i, solid) in solids.iter().enumerate().filter(|(i, _)| !of_bar.contains(i)) {
                let ends: Vec<&BarEnd> =
                    self.bar_ends.iter().filter(|end| of_bar.contains(&end.of_bar) && end.solid == i).collect();
                let cut: Vec<usize> = ends.iter().flat_map(|end| &end.cut).copied().collect();
                let gap = match solid.without_ends(cut.iter().copied()) {
                    Some(rest) if !cut.is_empty() => rest.gap(&bar),
                    _ => solid.gap(&bar),
                };
                let is_still = ends.iter().any(|end| {
                    let bar_end = Solid::ball(Kind::Bar, 0, solids[end.of_bar].middle, radius);
                    let still = end.still.iter().filter_map(|&of_line| solid.end_gap(of_line, &bar_end));
                    still.chain(end.all.then(|| solid.gap(&bar_end))).any(|at_end| gap > at_end - 1e-6)
                });
                if gap < nearest.0 && !is_still {
                    nearest = (gap, (solid.kind, Kind::Bar));
                }
            }
        }
        for Pair { a, b, still, cut } in &self.pairs {
            let is_at_end = |gap: f64| {
                let of = |&(i, end): &(usize, usize)| solids[i].end_gap(end, &solids[a + b - i]);
                still.iter().filter_map(of).any(|end| gap > end - 1e-6)
            };
            let without_ends = |i: usize| solids[i].without_ends(cut.iter().filter(|(of, _)| *of == i).map(|(_, end)| *end));
            let (a_cut, b_cut) = if cut.is_empty() { (None, None) } else { (without_ends(*a), without_ends(*b)) };
            let (a, b) = (&solids[*a], &solids[*b]);
            if a.least_gap(b) < nearest.0 {
                let gap = a_cut.as_ref().unwrap_or(a).gap(b_cut.as_ref().unwrap_or(b));
                if gap < nearest.0 && !is_at_end(gap) {
                    nearest = (gap, (a.kind, b.kind));
                }
            }
        }
        (nearest.0, format!("{:?} and {:?}", nearest.1.0, nearest.1.1))
    }

    fn solids(&self, q: &[f64]) -> Vec<Solid> {
        let (sizes, rig) = (&self.rig.solids, self.rig);
        let chucks: Vec<V> = rig.chucks.iter().map(|chuck| chuck.position_m).collect();
        let spheres: Vec<V> = rig.spheres.iter().map(|sphere| sphere.position_m).collect();
        let frames = frames(&self.robot.chain, q);
        let joints = self.robot.chain.joints();
        let tool = frames[joints].2;
        let on_tool = |point: &V| (tool * Point3::from(*point)).coords;

        let (behind, wide) = plate(&chucks, sizes.chuck_plate_below_m, sizes.chuck_radius_m + sizes.chuck_plate_rim_m);
        let mut solids =
            vec![Solid::table(chucks[0].z - sizes.table_below_chucks_m), Solid::plate(Kind::ChuckPlate, 0, behind, V::z(), wide)];
        solids.extend(chucks.iter().enumerate().map(|(i, &chuck)| Solid::ball(Kind::Chuck(i), 0, chuck, sizes.chuck_radius_m)));
        solids.extend(self.links(&frames));
        let (behind, wide) = plate(&spheres, sizes.sphere_plate_behind_m, sizes.sphere_radius_m + sizes.sphere_plate_rim_m);
        solids.push(Solid::plate(Kind::SpherePlate, joints, on_tool(&behind), tool * V::z(), wide));
        let sphere = |(i, sphere)| Solid::ball(Kind::Sphere(i), joints, on_tool(sphere), sizes.sphere_radius_m);
        solids.extend(spheres.iter().enumerate().map(sphere));
        solids
    }

    /// The frames at encoders zero, and where the links' ways turn there: from the tool inwards an axis is left at its point nearest to where
    /// the next one is, a slide where the next axis is left; it is come to at its point nearest to where the one before is left.
    fn turns(&self) -> (Vec<Frames>, Vec<Turns>) {
        let joints = self.robot.chain.joints();
        let zero = frames(&self.robot.chain, &vec![0.0; joints]);
        let foot = |joint: usize, point: V| {
            let (through, along) = (zero[joint].2.translation.vector, zero[joint].2 * V::z());
            through + along * along.dot(&(point - through))
        };
        let mut leaves = vec![V::zeros(); joints + 1];
        let mut next = zero[joints].2.translation.vector;
        for joint in (0..joints).rev() {
            if self.robot.chain.joint_kinds()[joint] == JointKind::Revolute {
                next = foot(joint, next);
            }
            leaves[joint + 1] = next;
        }
        // Whatever the line of a slide, it goes through where it is left.
        let comes = |link: usize| match link.checked_sub(1) {
            None => V::zeros(),
            Some(joint) => {
                let along = zero[joint].2 * V::z();
                leaves[link] + along * along.dot(&(leaves[joint] - leaves[link]))
            }
        };
        let turns = (0..=joints).map(|link| Turns { comes: comes(link), leaves: leaves[link] }).collect();
        (zero, turns)
    }

    /// A slide from where it comes from; then the link itself: along the joint's axis and across to the next one.
    fn links(&self, frames: &[Frames]) -> Vec<Solid> {
        let sizes = &self.rig.solids;
        let short = 0.4 * sizes.link_radius_m;
        let (zero, turns) = self.turns();
        // What stands before or behind a joint at encoders zero goes where its frame goes.
        let moved =
            |now: &Isometry3<f64>, before: &Isometry3<f64>, point: &V| (now * before.inverse() * Point3::from(*point)).coords;
        let mut lines: Vec<(usize, V, V)> = Vec::new();
        for (link, now) in frames.iter().enumerate() {
            let [start, corner] = [turns[link].comes, turns[link].leaves].map(|point| moved(&now.0, &zero[link].0, &point));
            let end = turns.get(link + 1).map_or(now.2.translation.vector, |next| moved(&now.2, &zero[link].2, &next.comes));
            if link > 0 && self.robot.chain.joint_kinds()[link - 1] == JointKind::Prismatic {
                lines.push((link, moved(&frames[link - 1].2, &zero[link - 1].2, &turns[link].comes), start));
            }
            let parts = [(link, start, corner), (link, corner, end)];
            lines.extend(parts.into_iter().filter(|(_, from, to)| (to - from).norm() > short));
        }
        let last = lines[lines.len() - 1].0;
        let count = lines.len();
        let capsule = |(i, (link, mut from, mut to)): (usize, (usize, V, V))| {
            let radius = if link == last { sizes.last_link_radius_m } else { sizes.link_radius_m };
            if i + 1 == count {
                // Flush with its end.
                let is_short = (to - from).norm() <= radius;
                to -= (to - from).normalize() * radius;
                from = if is_short { to } else { from };
            }
            Solid::capsule(Kind::Link(link + 1), link, from, to, radius)
        };
        lines.into_iter().enumerate().map(capsule).collect()
    }
}

/// Middle and radius of the disc behind some points of one height.
fn plate(points: &[V], behind: f64, rim: f64) -> (V, f64) {
    let sum: V = points.iter().sum();
    let middle = sum / points.len() as f64;
    assert!(points.iter().all(|point| (point.z - middle.z).abs() < 1e-12), "points of one height");
    let widest = points.iter().map(|point| (point - middle).norm()).fold(0.0, f64::max);
    (middle - V::z() * behind, widest + rim)
}
