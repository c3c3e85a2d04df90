//! Robot, bar and fixtures as solids once more, from the naive chain and `docs/planning.md` alone: it shares no code with the planner.

use ballbar::{Chain, JointKind, PARAMETERS_PER_JOINT};
use host_cal::files::{PairingId, Rig, Robot, Solids};
use nalgebra::{Matrix4, Vector3, Vector4};
use num_complex::Complex;

use crate::naive;

type V = Vector3<f64>;

/// A line with a radius.
struct Capsule {
    link: usize,
    from: V,
    to: V,
    radius: f64,
}

/// What the solids of one rig are made of. The rig's chucks must lie in a plane across the base's z, its spheres across the tool's.
pub struct NaiveCell<'a> {
    robot: &'a Robot,
    rig: &'a Rig,
    /// Indices into the capsules: pairs with more arm between them than both are thick.
    pairs: Vec<(usize, usize)>,
    /// Capsules that have more arm between them and the tool than they are thick.
    apart_from_tool: Vec<usize>,
}

/// Real part of the naive chain behind the first `joints` joints.
fn frame(chain: &Chain<f64>, q: &[f64], joints: usize) -> Matrix4<f64> {
    let parameters: Vec<Complex<f64>> =
        chain.parameters()[..joints * PARAMETERS_PER_JOINT].iter().map(|&value| value.into()).collect();
    naive::base_from_tool(&chain.joint_kinds()[..joints], &parameters, q).map(|entry| entry.re)
}

/// The tool's pose by the naive chain.
pub fn base_from_tool(chain: &Chain<f64>, q: &[f64]) -> Matrix4<f64> {
    let parameters: Vec<Complex<f64>> = chain.parameters().iter().map(|&value| value.into()).collect();
    naive::base_from_tool(chain.joint_kinds(), &parameters, q).map(|entry| entry.re)
}

fn place(frame: &Matrix4<f64>, x: f64, y: f64, z: f64) -> V {
    (frame * Vector4::new(x, y, z, 1.0)).xyz()
}

fn point_to_line(point: &V, from: &V, to: &V) -> f64 {
    least(|share| (from + (to - from) * share - point).norm())
}

fn line_to_line(a: (&V, &V), b: (&V, &V)) -> f64 {
    least(|share| point_to_line(&(a.0 + (a.1 - a.0) * share), b.0, b.1))
}

fn point_to_disc(point: &V, centre: &V, normal: &V, radius: f64) -> f64 {
    let height = (point - centre).dot(normal);
    let flat = point - normal * height - centre;
    let inside = if flat.norm() > radius { flat * (radius / flat.norm()) } else { flat };
    (centre + inside - point).norm()
}

/// Least value of a convex function from 0 to 1, by thirds, to some micrometres of the lengths here.
fn least(of: impl Fn(f64) -> f64) -> f64 {
    const STEPS: usize = 32;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..STEPS {
        let third = (high - low) / 3.0;
        if of(low + third) < of(high - third) { high -= third } else { low += third }
    }
    of((low + high) / 2.0).min(of(0.0)).min(of(1.0))
}

impl<'a> NaiveCell<'a> {
    /// Prepares a robot at its rig; `clearance_m` only decides which parts are too near one another by construction to be looked at.
    pub fn new(robot: &'a Robot, rig: &'a Rig, clearance_m: f64) -> Self {
        let middle: Vec<f64> = robot.limits.iter().map(|limits| (limits.min + limits.max) / 2.0).collect();
        let mut cell = Self { robot, rig, pairs: Vec::new(), apart_from_tool: Vec::new() };
        let capsules = cell.capsules(&middle);
        // The least arm that a slide may leave is not in the middle of its range; no built-in robot's choice hangs on it.
        let arm = |from: usize, to: usize| capsules[from..to].iter().map(|part| (part.to - part.from).norm()).sum::<f64>();
        for second in 0..capsules.len() {
            for first in 0..second {
                if arm(first + 1, second) > capsules[first].radius + capsules[second].radius + clearance_m {
                    cell.pairs.push((first, second));
                }
            }
        }
        let is_apart = |&i: &usize| arm(i + 1, capsules.len()) > capsules[i].radius + clearance_m;
        cell.apart_from_tool = (0..capsules.len() - 1).take_while(is_apart).collect();
        cell
    }

    /// How many pairs of links are looked at.
    pub fn pairs(&self) -> usize {
        self.pairs.len()
    }

    /// Length of the bar, metres.
    pub fn length_m(&self, q: &[f64], pairing: PairingId) -> f64 {
        self.ends(q, pairing).1
    }

    fn ends(&self, q: &[f64], pairing: PairingId) -> ((V, V), f64) {
        let sphere = self.rig.spheres[pairing.sphere].position_m;
        let to = place(&base_from_tool(&self.robot.chain, q), sphere.x, sphere.y, sphere.z);
        let from = self.rig.chucks[pairing.chuck].position_m;
        ((from, to), (to - from).norm())
    }

    /// The least gap between any two solids, metres, and between which.
    pub fn gap_m(&self, q: &[f64], attached: Option<PairingId>) -> (f64, String) {
        let solids = &self.rig.solids;
        let capsules = self.capsules(q);
        let tool = base_from_tool(&self.robot.chain, q);
        let chucks: Vec<V> = self.rig.chucks.iter().map(|chuck| chuck.position_m).collect();
        let in_tool: Vec<V> = self.rig.spheres.iter().map(|sphere| sphere.position_m).collect();
        let spheres: Vec<V> = in_tool.iter().map(|sphere| place(&tool, sphere.x, sphere.y, sphere.z)).collect();
        let table_z = chucks[0].z - solids.table_below_chucks_m;
        let (chuck_plate, chuck_plate_radius) =
            plate(&chucks, solids.chuck_plate_below_m, solids.chuck_radius_m, solids.chuck_plate_rim_m);
        let (behind, tool_plate_radius) =
            plate(&in_tool, solids.sphere_plate_behind_m, solids.sphere_radius_m, solids.sphere_plate_rim_m);
        let tool_plate = place(&tool, behind.x, behind.y, behind.z);
        let tool_normal: V = tool.fixed_view::<3, 1>(0, 2).into();
        let to_chuck_plate = |point: &V| point_to_disc(point, &chuck_plate, &V::z(), chuck_plate_radius);
        let to_tool_plate = |point: &V| point_to_disc(point, &tool_plate, &tool_normal, tool_plate_radius);
        let along = |from: &V, to: &V, distance: &dyn Fn(&V) -> f64| least(|share| distance(&(from + (to - from) * share)));

        let mut nearest = (f64::INFINITY, String::new());
        let mut see = |gap: f64, what: String| {
            if gap < nearest.0 {
                nearest = (gap, what);
            }
        };
        if let Some(pairing) = attached {
            let ((from, to), _) = self.ends(q, pairing);
            let radius = solids.bar_radius_m;
            see(from.z.min(to.z) - table_z - radius, "bar and table".to_owned());
            see(along(&from, &to, &to_chuck_plate) - radius, "bar and chuck plate".to_owned());
            see(along(&from, &to, &to_tool_plate) - radius, "bar and sphere plate".to_owned());
            for (i, chuck) in chucks.iter().enumerate().filter(|(i, _)| *i != pairing.chuck) {
                see(point_to_line(chuck, &from, &to) - radius - solids.chuck_radius_m, format!("bar and chuck {i}"));
            }
            for (i, sphere) in spheres.iter().enumerate().filter(|(i, _)| *i != pairing.sphere) {
                see(point_to_line(sphere, &from, &to) - radius - solids.sphere_radius_m, format!("bar and sphere {i}"));
            }
            for part in &capsules {
                see(
                    line_to_line((&from, &to), (&part.from, &part.to)) - radius - part.radius,
                    format!("bar and link {}", part.link),
                );
            }
        }
        for part in capsules.iter().skip(1) {
            see(part.from.z.min(part.to.z) - table_z - part.radius, format!("link {} and table", part.link));
            see(along(&part.from, &part.to, &to_chuck_plate) - part.radius, format!("link {} and chuck plate", part.link));
            for chuck in &chucks {
                let gap = point_to_line(chuck, &part.from, &part.to) - part.radius - solids.chuck_radius_m;
                see(gap, format!("link {} and a chuck", part.link));
            }
        }
        for &(a, b) in &self.pairs {
            let (a, b) = (&capsules[a], &capsules[b]);
            let gap = line_to_line((&a.from, &a.to), (&b.from, &b.to)) - a.radius - b.radius;
            see(gap, format!("links {} and {}", a.link, b.link));
        }
        for sphere in &spheres {
            see(sphere.z - solids.sphere_radius_m - table_z, "a sphere and the table".to_owned());
            see(to_chuck_plate(sphere) - solids.sphere_radius_m, "a sphere and the chuck plate".to_owned());
        }
        for chuck in &chucks {
            see(to_tool_plate(chuck) - solids.chuck_radius_m, "the sphere plate and a chuck".to_owned());
        }
        for degree in 0..360 {
            let (sin, cos) = f64::from(degree).to_radians().sin_cos();
            let rim = place(&tool, behind.x + tool_plate_radius * cos, behind.y + tool_plate_radius * sin, behind.z);
            see(rim.z - table_z, "the sphere plate and the table".to_owned());
        }
        for part in self.apart_from_tool.iter().map(|&i| &capsules[i]) {
            see(along(&part.from, &part.to, &to_tool_plate) - part.radius, format!("the sphere plate and link {}", part.link));
        }
        nearest
    }

    /// A slide from the joint's origin; then along the joint's axis, then across to the next joint.
    fn capsules(&self, q: &[f64]) -> Vec<Capsule> {
        const NO_LENGTH: f64 = 1e-6;
        let Solids { link_radius_m, last_link_radius_m, .. } = self.rig.solids;
        let chain = &self.robot.chain;
        let mut capsules = Vec::new();
        let mut end = V::zeros();
        for link in 0..=chain.joints() {
            let after_joint = frame(chain, q, link);
            let start = place(&after_joint, 0.0, 0.0, 0.0);
            let [x, y, z] = [0, 1, 2].map(|i| chain.parameters()[link * PARAMETERS_PER_JOINT + i]);
            let corner = place(&after_joint, 0.0, 0.0, z);
            let slides = link > 0 && chain.joint_kinds()[link - 1] == JointKind::Prismatic;
            let mut add = |from: V, to: V, is_there: bool| {
                if is_there {
                    capsules.push(Capsule { link: link + 1, from, to, radius: link_radius_m });
                }
            };
            add(end, start, slides);
            add(start, corner, z.abs() > NO_LENGTH);
            end = place(&after_joint, x, y, z);
            add(corner, end, x.hypot(y) > NO_LENGTH);
        }
        // The last one is flush with the tool's frame.
        if let Some(last) = capsules.last_mut() {
            last.radius = last_link_radius_m;
            let length = (last.to - last.from).norm();
            last.to = last.from + (last.to - last.from) * (1.0 - last_link_radius_m / length).max(0.0);
        }
        capsules
    }
}

/// Middle and radius of the disc behind some points of one height.
fn plate(points: &[V], behind: f64, point_radius: f64, rim: f64) -> (V, f64) {
    let sum: V = points.iter().sum();
    let middle = sum / points.len() as f64;
    assert!(points.iter().all(|point| (point.z - middle.z).abs() < 1e-12), "points of one height");
    let widest = points.iter().map(|point| (point - middle).norm()).fold(0.0, f64::max);
    (middle - V::z() * behind, widest + point_radius + rim)
}
