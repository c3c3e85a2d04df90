//! The bar, and what it comes near.

use super::Scene;
use super::gaps::{AT_STILL_END_M, End, Gap, Range};
use super::things::{Thing, What};
use crate::kinematics::Posture;
use crate::model::PairingId;
use crate::plan::contact::{Contact, Nearest};
use crate::plan::geometry::{Core, Segment};
use crate::plan::swing::Swing;

/// What of a thing keeps its gap to one end of the bar in every posture.
#[derive(Clone, Copy, Debug)]
struct BesideEnd {
    /// All of it does.
    is_still: bool,
    /// Of the ends of its capsule.
    ends: [End; 2],
}

/// Of all things, beside the bar's end in each chuck, and beside its end on each sphere.
#[derive(Clone, Debug, Default)]
pub(super) struct BarEnds {
    in_chucks: Vec<Vec<BesideEnd>>,
    on_spheres: Vec<Vec<BesideEnd>>,
}

impl BarEnds {
    pub(super) fn new(things: &[Thing], gaps: &[Gap], bar_radius_m: f64, clearance_m: f64) -> Self {
        let beside_all = |of_bar: usize| -> Vec<BesideEnd> {
            let beside = |thing| beside_end(things, gaps, (of_bar, thing), bar_radius_m, clearance_m);
            (0..things.len()).map(beside).collect()
        };
        let mut ends = Self::default();
        for (at, thing) in things.iter().enumerate() {
            match thing.what {
                What::Chuck { .. } => ends.in_chucks.push(beside_all(at)),
                What::Sphere { .. } => ends.on_spheres.push(beside_all(at)),
                _ => {}
            }
        }
        ends
    }

    /// Of one thing, beside the end in the chuck and beside the one on the sphere.
    fn beside(&self, id: PairingId, thing: usize) -> [BesideEnd; 2] {
        [self.in_chucks[id.chuck][thing], self.on_spheres[id.sphere][thing]]
    }
}

fn beside_end(things: &[Thing], gaps: &[Gap], (of_bar, thing): (usize, usize), bar_radius_m: f64, clearance_m: f64) -> BesideEnd {
    let is_rigid = things[of_bar].joints == things[thing].joints;
    let Some((gap, side)) = gaps.iter().find_map(|gap| Some((gap, gap.side_of(thing, of_bar)?))) else {
        return BesideEnd { is_still: is_rigid, ends: [End::Moves; 2] };
    };
    let thicker_m = things[of_bar].radius_m - bar_radius_m;
    let end = |range: Range| range.plus(thicker_m).end(clearance_m);
    BesideEnd { is_still: gap.whole.is_constant(), ends: gap.of_ends[side].map(end) }
}

/// What the bar meets there; `None` for the chuck and the sphere that it is attached to.
fn bar_contact(what: &What, id: PairingId) -> Option<Contact> {
    match what {
        What::Table { .. } => Some(Contact::BarTable),
        What::ChuckPlate(_) => Some(Contact::BarChuckPlate),
        What::Chuck { index, .. } => (*index != id.chuck).then_some(Contact::BarChuck),
        What::Link(body) => Some(Contact::BarLink(body.link + 1)),
        What::SpherePlate(_) => Some(Contact::BarSpherePlate),
        What::Sphere { index, .. } => (*index != id.sphere).then_some(Contact::BarSphere),
    }
}

/// The bar on a pairing, at a posture.
pub(super) struct Bar {
    id: PairingId,
    /// From the chuck to the sphere.
    line: Segment,
}

impl Scene {
    pub(super) fn bar(&self, posture: &Posture, id: PairingId) -> Bar {
        let line = Segment { from_m: self.chucks_m[id.chuck], to_m: posture.point_in_base(&self.spheres_tool_m[id.sphere]) };
        Bar { id, line }
    }

    /// What is nearest to the bar of all that motion can bring nearer.
    pub(super) fn nearest_to_bar(&self, bar: &Bar, cores: &[Core]) -> Nearest {
        let mut nearest = Nearest { gap_m: f64::INFINITY, contact: Contact::BarTable };
        for (at, thing) in self.things.iter().enumerate() {
            let Some(contact) = bar_contact(&thing.what, bar.id) else { continue };
            let gap_m = self.bar_gap_m(bar, at, &self.core_beside_bar(bar, at, cores));
            if gap_m < nearest.gap_m && !self.is_at_bar_end(bar, at, cores, gap_m) {
                nearest = Nearest { gap_m, contact };
            }
        }
        nearest
    }

    /// As [`Scene::keeps_apart`], of the bar and everything else.
    pub(super) fn keeps_bar_apart(&self, posture: &Posture, id: PairingId, cores: &[Core], gap_m: f64, swing: &Swing) -> bool {
        let bar = self.bar(posture, id);
        let joints = self.kinds.len();
        let sphere_reach = &self.sphere_reach[id.sphere];
        let all_m = swing.motion_m(&self.kinds, 0..joints, |joint| sphere_reach.of_joint_m(joint));
        // While the joints move, their axes do too, by no more than the sphere.
        let from_axis_m = |joint: usize| (bar.line.from_m - posture.axes()[joint].point_m).norm() + all_m;
        self.things.iter().enumerate().all(|(at, thing)| {
            if bar_contact(&thing.what, id).is_none() {
                return true;
            }
            let core = self.core_beside_bar(&bar, at, cores);
            let here_m = self.bar_gap_m(&bar, at, &core);
            if here_m < gap_m || swing.is_none() {
                return here_m >= gap_m;
            }
            let chuck_m = swing.motion_m(&self.kinds, 0..thing.joints, from_axis_m);
            let sphere_m = swing.motion_m(&self.kinds, thing.joints..joints, |joint| sphere_reach.of_joint_m(joint));
            let growth_m = self.growth_m(at, swing);
            if here_m >= gap_m + chuck_m.max(sphere_m) + growth_m {
                return true;
            }
            let (on_thing_m, on_bar_m) = core.nearest(&Core::Segment(bar.line));
            let Some(normal) = (on_bar_m - on_thing_m).try_normalize(f64::MIN_POSITIVE) else { return false };
            let (plane, motions_m) = ((&on_thing_m, &normal), (chuck_m, sphere_m));
            let height_m = swing.least_height_of_bar_m(posture, thing.joints, &bar.line, plane, motions_m);
            height_m >= gap_m + thing.radius_m + self.solids.bar_radius_m + growth_m
        })
    }

    /// A thing without the ends of its capsule that would always be too near to an end of the bar.
    fn core_beside_bar(&self, bar: &Bar, at: usize, cores: &[Core]) -> Core {
        let [chuck, sphere] = self.bar_ends.beside(bar.id, at).map(|beside| beside.ends);
        let is_cut = [0, 1].map(|end| [chuck[end], sphere[end]].contains(&End::Cut));
        cores[at].without_ends(is_cut, self.things[at].radius_m)
    }

    fn bar_gap_m(&self, bar: &Bar, at: usize, core: &Core) -> f64 {
        core.distance_m(&Core::Segment(bar.line)) - self.things[at].radius_m - self.solids.bar_radius_m
    }

    /// Whether a gap is one that a thing, or an end of its capsule, keeps to an end of the bar in every posture.
    fn is_at_bar_end(&self, bar: &Bar, at: usize, cores: &[Core], gap_m: f64) -> bool {
        let radii_m = self.things[at].radius_m + self.solids.bar_radius_m;
        let beside = self.bar_ends.beside(bar.id, at);
        beside.into_iter().zip([bar.line.from_m, bar.line.to_m]).any(|(beside, end_m)| {
            let end = Core::Point(end_m);
            let is_at = |core: &Core| gap_m > core.distance_m(&end) - radii_m - AT_STILL_END_M;
            let capsule_ends = || cores[at].ends().into_iter().flatten().zip(beside.ends);
            (beside.is_still && is_at(&cores[at])) || capsule_ends().any(|(core, what)| what == End::Still && is_at(&core))
        })
    }
}
