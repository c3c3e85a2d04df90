//! What a set of poses leaves open, and what to measure instead.

use ballbar::{Chain, JointKind};

use crate::files::{Dataset, JointLimits, Rig};
use crate::units::ScreenUnit;

/// The most parameters of a chain that so many chucks and spheres can identify: `N − 6 + g(chucks) + g(spheres)`,
/// `g(1, 2, 3) = 0, 2, 3`, as long as three of them do not stand in one line.
///
/// Each side loses what it cannot see: one point the three turns about it, two points the turn about their line.
pub fn bound_by_ends(chain: &Chain<f64>, chucks: usize, spheres: usize) -> usize {
    let seen = |points: usize| [0, 0, 2, 3][points.min(3)];
    (chain.independent_parameters() + seen(chucks) + seen(spheres)).saturating_sub(6)
}

/// [`bound_by_ends`] of the chucks and spheres that the poses use.
pub fn bound_by_pairings(chain: &Chain<f64>, dataset: &Dataset) -> usize {
    let (chucks, spheres) = ends_used(dataset);
    bound_by_ends(chain, chucks, spheres)
}

fn ends_used(dataset: &Dataset) -> (usize, usize) {
    let count = |mut ends: Vec<usize>| {
        ends.sort_unstable();
        ends.dedup();
        ends.len()
    };
    let pairings = dataset.pairings();
    (count(pairings.iter().map(|p| p.chuck).collect()), count(pairings.iter().map(|p| p.sphere).collect()))
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
            several => format!("{} pairings of {} and {}", several.len(), plural(chucks, "chuck"), plural(spheres, "sphere")),
        };
        remarks.push(format!(
            "{what} can identify at most {bound} parameters; three chucks and three spheres could identify {independent}."
        ));
    }
    let poses = dataset.rows.len();
    if poses < independent {
        remarks.push(format!("{poses} poses cannot tell more than {poses} parameters, whatever they are. Measure more."));
    }
    if spheres < 3 {
        remarks.push(format!("All lengths end at {}: turns of the tool about {} change none of them. Measure to three spheres that are not in one line.",
            plural(spheres, "sphere"), if spheres == 1 { "it" } else { "their line" }));
    }
    if chucks < 3 {
        remarks.push(format!("All lengths begin at {}: turns of the whole robot about {} change none of them. Measure from three chucks that are not in one line.",
            plural(chucks, "chuck"), if chucks == 1 { "it" } else { "their line" }));
    }
    remarks.extend(joints_that_hardly_moved(chain, dataset, limits));
    remarks
}

fn plural(count: usize, noun: &str) -> String {
    if count == 1 { format!("one {noun}") } else { format!("{count} {noun}s") }
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
