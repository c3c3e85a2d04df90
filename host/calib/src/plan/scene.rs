//! What stands about the bar, and how near it comes to it: robot, table and fixtures as simple solids.

use ballbar::{JointKind, JointVector, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

mod bar;
mod gaps;
mod things;

use self::bar::BarEnds;
use self::gaps::{AT_STILL_END_M, End, Pair, candidates};
pub(super) use self::gaps::{CONSTANT_M, Gap};
use self::things::all_things;
pub(super) use self::things::{Thing, What};
use super::contact::{Contact, Nearest};
use super::geometry::{Core, Disc};
use super::swing::{Reach, Swing};
use crate::kinematics::{Posture, Skeleton};
use crate::model::{NamedPoint, PairingId, Rig, Robot, Solids};

/// Robot and rig as solids.
#[derive(Clone, Debug)]
pub struct Scene {
    solids: Solids,
    kinds: Vec<JointKind>,
    things: Vec<Thing>,
    pairs: Vec<Pair>,
    chucks_m: Vec<Vector3<f64>>,
    spheres_tool_m: Vec<Vector3<f64>>,
    /// Reach of each sphere.
    sphere_reach: Vec<Reach>,
    bar_ends: BarEnds,
}

/// Postures by which gaps are judged.
const POSTURES: usize = 400;

impl Scene {
    /// Sets the scene, and tells what gaps were seen while it was set; `clearance_m` is what has to stay between any two things.
    pub(super) fn new(robot: &Robot, rig: &Rig, clearance_m: f64) -> (Self, Vec<Gap>) {
        let skeleton = Skeleton::of(robot);
        let solids = rig.solids;
        let home = skeleton.at(&JointVector::zero());
        let positions = |points: &[NamedPoint]| -> Vec<Vector3<f64>> { points.iter().map(|point| point.position_m).collect() };
        let (chucks_m, spheres_tool_m) = (positions(&rig.chucks), positions(&rig.spheres));
        let thing = |what: What, joints: usize, radius_m: f64| {
            let reach = Reach::new(&skeleton, &robot.limits, &home, joints, &what.place(&home));
            Thing { what, joints, radius_m, reach }
        };
        let things = all_things(&skeleton, &solids, &chucks_m, &spheres_tool_m, &thing);
        let sphere_reach = spheres_tool_m
            .iter()
            .enumerate()
            .map(|(index, &centre_m)| thing(What::Sphere { index, centre_m }, skeleton.joints(), 0.0).reach);
        let mut scene = Self {
            solids,
            kinds: robot.chain.joint_kinds().to_vec(),
            sphere_reach: sphere_reach.collect(),
            things,
            pairs: Vec::new(),
            chucks_m,
            spheres_tool_m,
            bar_ends: BarEnds::default(),
        };
        let gaps = scene.gaps(robot, &skeleton);
        let is_looked_at =
            |gap: &&Gap| !gap.whole.is_constant() && (gap.whole.most_m >= clearance_m || !gap.is_of_links(&scene.things));
        let pair = |gap: &Gap| Pair { ends: gap.ends(clearance_m), ..gap.pair };
        scene.bar_ends = BarEnds::new(&scene.things, &gaps, solids.bar_radius_m, clearance_m);
        scene.pairs = gaps.iter().filter(is_looked_at).map(pair).collect();
        (scene, gaps)
    }

    pub(super) fn things(&self) -> &[Thing] {
        &self.things
    }

    pub(super) fn solids(&self) -> &Solids {
        &self.solids
    }

    /// Whether a thing is of the first link that there is something of.
    pub(super) fn is_foot(&self, thing: &Thing) -> bool {
        let link = |thing: &Thing| match thing.what {
            What::Link(body) => Some(body.link),
            _ => None,
        };
        link(thing).is_some() && link(thing) == self.things.iter().find_map(link)
    }

    /// Unit normal of the plate with the spheres, away from the robot; tool frame.
    pub fn sphere_plate_normal(&self) -> Vector3<f64> {
        self.sphere_plate().normal
    }

    /// How far that plate faces away from the last joint's axis, radians, where its spheres are beside the last link or behind it.
    pub(super) fn turned_plate_rad(&self, home: &Posture) -> Option<f64> {
        const FACES_AWAY_RAD: f64 = std::f64::consts::FRAC_PI_3;
        let normal = home.base_from_tool.rotation * self.sphere_plate_normal();
        let away_rad = home.axes().last()?.direction.dot(&normal).abs().min(1.0).acos();
        (away_rad > FACES_AWAY_RAD).then_some(away_rad)
    }

    fn sphere_plate(&self) -> Disc {
        let plate = self.things.iter().find_map(|thing| match thing.what {
            What::SpherePlate(disc) => Some(disc),
            _ => None,
        });
        plate.unwrap_or(Disc { centre_m: Vector3::zeros(), normal: Vector3::z(), radius_m: 0.0 })
    }

    /// How far the tool reaches from its frame's origin, metres.
    pub fn tool_reach_m(&self) -> f64 {
        let (plate, spheres) = (self.sphere_plate(), self.spheres_tool_m.iter());
        let spheres = spheres.map(|sphere_m| sphere_m.norm() + self.solids.sphere_radius_m);
        spheres.fold(plate.centre_m.norm() + plate.radius_m, f64::max)
    }

    /// Of every two things that joints move against one another what gaps they have over many postures.
    fn gaps(&self, robot: &Robot, skeleton: &Skeleton) -> Vec<Gap> {
        let mut gaps: Vec<Gap> = candidates(&self.things).map(Gap::unseen).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        for _ in 0..POSTURES {
            let mut q = JointVector::zero();
            for (value, limits) in q.as_array_mut().iter_mut().zip(&robot.limits) {
                *value = rng.random_range(limits.min..limits.max);
            }
            let cores = self.place(&skeleton.at(&q));
            for gap in &mut gaps {
                gap.whole.see(self.gap_m(&gap.pair, &cores));
                for (side, ranges) in gap.of_ends.iter_mut().enumerate() {
                    let ends_m = self.gaps_of_ends_m(&gap.pair, side, &cores);
                    ranges.iter_mut().zip(ends_m).for_each(|(range, end_m)| range.see(end_m));
                }
            }
        }
        gaps
    }

    fn place(&self, posture: &Posture) -> Vec<Core> {
        self.things.iter().map(|thing| thing.what.place(posture)).collect()
    }

    fn gap_m(&self, pair: &Pair, cores: &[Core]) -> f64 {
        let [a, b] = self.cores_of(pair, cores);
        a.distance_m(&b) - self.things[pair.a].radius_m - self.things[pair.b].radius_m
    }

    /// The two of a pair, without the ends that are cut.
    fn cores_of(&self, pair: &Pair, cores: &[Core]) -> [Core; 2] {
        let core = |at: usize, ends: [End; 2]| cores[at].without_ends(ends.map(|end| end == End::Cut), self.things[at].radius_m);
        [core(pair.a, pair.ends[0]), core(pair.b, pair.ends[1])]
    }

    /// Of the ends of the capsule on one side of a pair; infinite where it has none.
    fn gaps_of_ends_m(&self, pair: &Pair, side: usize, cores: &[Core]) -> [f64; 2] {
        let (this, other) = if side == 0 { (pair.a, pair.b) } else { (pair.b, pair.a) };
        let radii_m = self.things[pair.a].radius_m + self.things[pair.b].radius_m;
        cores[this].ends().map_or([f64::INFINITY; 2], |ends| ends.map(|end| end.distance_m(&cores[other]) - radii_m))
    }

    /// Whether a gap is that of an end that keeps it in every posture.
    fn is_at_still_end(&self, pair: &Pair, cores: &[Core], gap_m: f64) -> bool {
        pair.ends.iter().enumerate().any(|(side, ends)| {
            ends.contains(&End::Still) && {
                let ends_m = self.gaps_of_ends_m(pair, side, cores);
                ends.iter().zip(ends_m).any(|(end, end_m)| *end == End::Still && gap_m > end_m - AT_STILL_END_M)
            }
        })
    }

    /// The nearest two things at a posture that motion can bring nearer, with the bar on the pairing, or without the bar.
    pub fn nearest(&self, posture: &Posture, attached: Option<PairingId>) -> Nearest {
        let cores = self.place(posture);
        let balls: Vec<_> = cores.iter().map(Core::ball).collect();
        let of_bar = attached.map(|id| self.nearest_to_bar(&self.bar(posture, id), &cores));
        let mut nearest = of_bar.unwrap_or(Nearest { gap_m: f64::INFINITY, contact: Contact::ToolTable });
        for pair in &self.pairs {
            if self.least_gap_m(pair, &balls) < nearest.gap_m {
                let gap_m = self.gap_m(pair, &cores);
                if gap_m < nearest.gap_m && !self.is_at_still_end(pair, &cores, gap_m) {
                    nearest = Nearest { gap_m, contact: pair.contact };
                }
            }
        }
        nearest
    }

    /// Whether everything stays so far apart, with the bar on the pairing or without it, while the joints move from a posture by no more
    /// than `swing`.
    pub fn keeps_apart(&self, posture: &Posture, attached: Option<PairingId>, gap_m: f64, swing: &Swing) -> bool {
        let cores = self.place(posture);
        if attached.is_some_and(|id| !self.keeps_bar_apart(posture, id, &cores, gap_m, swing)) {
            return false;
        }
        let balls: Vec<_> = cores.iter().map(Core::ball).collect();
        let motions_m: Vec<f64> = self.things.iter().map(|thing| self.motion_m(thing, 0..thing.joints, swing)).collect();
        self.pairs.iter().all(|pair| {
            self.least_gap_m(pair, &balls) >= gap_m + motions_m[pair.b] + self.growth_m(pair.a, swing)
                || self.keeps_pair_apart(posture, pair, &cores, gap_m, swing)
        })
    }

    fn keeps_pair_apart(&self, posture: &Posture, pair: &Pair, cores: &[Core], gap_m: f64, swing: &Swing) -> bool {
        let (a, b) = (&self.things[pair.a], &self.things[pair.b]);
        let here_m = self.gap_m(pair, cores);
        if here_m < gap_m || swing.is_none() {
            return here_m >= gap_m;
        }
        let between = a.joints..b.joints;
        let motion_m = self.motion_m(b, between.clone(), swing);
        let (radii_m, growth_m) = (a.radius_m + b.radius_m, self.growth_m(pair.a, swing));
        if here_m >= gap_m + motion_m + growth_m {
            return true;
        }
        let [core_a, core_b] = self.cores_of(pair, cores);
        let (on_a_m, on_b_m) = core_a.nearest(&core_b);
        let Some(normal) = (on_b_m - on_a_m).try_normalize(f64::MIN_POSITIVE) else { return false };
        let height_m = swing.least_height_m(posture, between, &core_b, (&on_a_m, &normal), motion_m);
        height_m >= gap_m + radii_m + growth_m
    }

    /// No more than the gap, and quicker.
    fn least_gap_m(&self, pair: &Pair, balls: &[(Vector3<f64>, f64)]) -> f64 {
        let ((a_m, a_radius_m), (b_m, b_radius_m)) = (balls[pair.a], balls[pair.b]);
        let radii_m = a_radius_m + b_radius_m + self.things[pair.a].radius_m + self.things[pair.b].radius_m;
        (a_m - b_m).norm() - radii_m
    }

    fn motion_m(&self, thing: &Thing, joints: std::ops::Range<usize>, swing: &Swing) -> f64 {
        swing.motion_m(&self.kinds, joints, |joint| thing.reach.of_joint_m(joint))
    }

    /// By how much a slide's own capsule grows.
    fn growth_m(&self, at: usize, swing: &Swing) -> f64 {
        match &self.things[at].what {
            What::Link(body) if body.is_slide() => swing.step(body.link - 1),
            _ => 0.0,
        }
    }
}
