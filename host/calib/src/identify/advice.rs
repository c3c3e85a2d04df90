//! What a set of poses leaves open, and what to measure instead.

use ballbar::{Chain, JointKind, Vector3};

use crate::model::{Dataset, JointLimits, Rig};
use crate::units::ScreenUnit;

/// The most parameters of a chain that so many chucks and spheres can identify: `N − 6 + g(chucks) + g(spheres)`,
/// `g(1, 2, 3) = 0, 2, 3`, as long as three of them do not stand in one line.
///
/// Each side loses what it cannot see: one point the three turns about it, two points the turn about their line.
pub fn bound_by_ends(chain: &Chain<f64>, chucks: usize, spheres: usize) -> usize {
    let seen = |points: usize| [0, 0, 2, 3][points.min(3)];
    (chain.independent_parameters() + seen(chucks) + seen(spheres)).saturating_sub(6)
}

/// [`bound_by_ends`] of the chucks and spheres that the poses use, where they stand.
pub fn bound_by_pairings(chain: &Chain<f64>, dataset: &Dataset) -> usize {
    let (chucks, spheres) = ends_used(dataset);
    bound_by_ends(chain, chucks.spanned(), spheres.spanned())
}

/// The distinct centres of the chucks, or of the spheres, that some poses use.
struct Ends {
    noun: &'static str,
    centres_m: Vec<Vector3<f64>>,
}

impl Ends {
    fn new<'a>(noun: &'static str, centres_m: impl Iterator<Item = &'a Vector3<f64>>) -> Self {
        const APART_M: f64 = 1e-6;
        let mut distinct: Vec<Vector3<f64>> = Vec::new();
        for centre_m in centres_m {
            if distinct.iter().all(|other_m| (centre_m - other_m).norm() > APART_M) {
                distinct.push(*centre_m);
            }
        }
        Self { noun, centres_m: distinct }
    }

    /// As how many they count: 1 for a point, 2 for points in one line, 3 for a plane.
    fn spanned(&self) -> usize {
        const BESIDE_M: f64 = 1e-6;
        let [first_m, second_m, others_m @ ..] = self.centres_m.as_slice() else { return self.centres_m.len() };
        let along = (second_m - first_m).normalize();
        let is_beside = |other_m: &Vector3<f64>| along.cross(&(other_m - first_m)).norm() > BESIDE_M;
        if others_m.iter().any(is_beside) { 3 } else { 2 }
    }

    /// `one chuck`, `2 chucks`, `3 chucks in one line`.
    fn words(&self) -> String {
        match (self.centres_m.len(), self.spanned()) {
            (1, _) => format!("one {}", self.noun),
            (count, 2) if count > 2 => format!("{count} {}s in one line", self.noun),
            (count, _) => format!("{count} {}s", self.noun),
        }
    }
}

fn ends_used(dataset: &Dataset) -> (Ends, Ends) {
    let pairings = || dataset.rows.iter().map(|row| &row.measurement.pairing);
    let chucks = Ends::new("chuck", pairings().map(|pairing| &pairing.chuck_base_m));
    (chucks, Ends::new("sphere", pairings().map(|pairing| &pairing.sphere_tool_m)))
}

/// What about these poses leaves parameters unidentified, and what to measure instead; one sentence each.
pub fn remarks(chain: &Chain<f64>, dataset: &Dataset, rig: &Rig, limits: &[JointLimits]) -> Vec<String> {
    let mut remarks = Vec::new();
    let (chucks, spheres) = ends_used(dataset);
    let (bound, independent) = (bound_by_pairings(chain, dataset), chain.independent_parameters());
    if bound < independent {
        let pairings = dataset.pairings();
        let what = match pairings.as_slice() {
            [only] => format!("One pairing ({})", rig.pairing_name(*only)),
            several => format!("{} pairings of {} and {}", several.len(), chucks.words(), spheres.words()),
        };
        remarks.push(format!(
            "{what} can identify at most {bound} parameters; three chucks and three spheres could identify {independent}."
        ));
    }
    let poses = dataset.rows.len();
    if poses < independent {
        remarks.push(format!("{poses} poses cannot tell more than {poses} parameters, whatever they are. Measure more."));
    }
    let turns = [(&spheres, "end at", "the tool", "to"), (&chucks, "begin at", "the whole robot", "from")];
    for (ends, verb, what, preposition) in turns.into_iter().filter(|(ends, ..)| ends.spanned() < 3) {
        remarks.push(format!(
            "All lengths {verb} {}: turns of {what} about {} change none of them. Measure {preposition} three {}s that are not in one line.",
            ends.words(),
            if ends.spanned() == 1 { "it" } else { "their line" },
            ends.noun
        ));
    }
    remarks.extend(joints_that_hardly_moved(chain, dataset, limits));
    remarks
}

fn joints_that_hardly_moved(chain: &Chain<f64>, dataset: &Dataset, limits: &[JointLimits]) -> Vec<String> {
    const HARDLY: f64 = 0.1;
    let joints = chain.joint_kinds().iter().zip(limits).enumerate();
    joints
        .filter_map(|(i, (&kind, limits))| {
            let values = dataset.rows.iter().map(|row| row.measurement.q.as_array()[i]);
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (low.min(q), high.max(q)));
            let share = (high - low) / (limits.max - limits.min);
            let unit = ScreenUnit::from(kind);
            let verb = if kind == JointKind::Revolute { "turned" } else { "moved" };
            (share < HARDLY).then(|| {
                format!(
                    "Joint {} {verb} by {:.1} {} only, {:.0} % of its range: its scale and the links beside it are hard to tell apart.",
                    i + 1,
                    unit.from_si(high - low),
                    unit.name(),
                    100.0 * share
                )
            })
        })
        .collect()
}
