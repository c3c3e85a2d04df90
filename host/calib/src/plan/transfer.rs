//! Ways between any two joint vectors: from the last pose of one shell to the first of the next, with the bar taken off; and on a shell.

use std::f64::consts::{PI, TAU};

use ballbar::{JointKind, JointVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::cell::Cell;
use super::posture::Shell;
use super::swing::Swing;
use super::way::{self, is_clear, is_sound};
use crate::model::PairingId;

/// Samples of the joint space before a way counts as not there.
const SAMPLES: usize = 1500;
/// Longest branch of a tree, seconds of motion.
const BRANCH_S: f64 = 1.0;
/// Tries to leave out pieces of a way.
const SHORTCUTS: usize = 100;

/// Via points from one joint vector to another, with the bar on (ends and its length at mid travel, metres) or off; `None` when none
/// were found. The same seed gives the same way.
pub fn way_between(
    cell: &Cell<'_>,
    joined: Option<(PairingId, f64)>,
    a: &JointVector<f64>,
    b: &JointVector<f64>,
    seed: u64,
) -> Option<Vec<JointVector<f64>>> {
    match joined {
        None => free(cell, a, b, seed),
        Some((id, bar_m)) => way::attached(cell, &Shell { id, pairing: cell.rig.pairing(id), bar_m }, a, b),
    }
}

/// Brings poses that follow one another to `from`: shifts all of them by whole turns of single joints, where limits allow it and no way
/// was found otherwise. The via points to the first pose; `None` when none were found.
pub(super) fn approach(
    cell: &Cell<'_>,
    from: &JointVector<f64>,
    poses: &mut [&mut JointVector<f64>],
    seed: u64,
) -> Option<Vec<JointVector<f64>>> {
    let first = **poses.first()?;
    let mut shifts = turns(cell, poses);
    let shifted = |(joint, by): (usize, f64)| {
        let mut q = first;
        q.as_array_mut()[joint] += by;
        q
    };
    shifts.sort_by(|a, b| cell.seconds(from, &shifted(*a)).total_cmp(&cell.seconds(from, &shifted(*b))));
    shifts.insert(0, (0, 0.0));
    let (joint, by, vias) =
        shifts.into_iter().find_map(|shift| Some((shift.0, shift.1, free(cell, from, &shifted(shift), seed)?)))?;
    poses.iter_mut().for_each(|q| q.as_array_mut()[joint] += by);
    Some(vias)
}

/// Joints, and by how much they can be shifted, a turn either way, with all poses keeping their limits.
fn turns(cell: &Cell<'_>, poses: &[&mut JointVector<f64>]) -> Vec<(usize, f64)> {
    let encoders = cell.inverse.skeleton().encoders().iter().enumerate();
    let revolute = encoders.filter(|(_, encoder)| encoder.kind == JointKind::Revolute);
    let both = revolute.flat_map(|(joint, encoder)| [TAU, -TAU].map(|turn| (joint, turn / encoder.scale.abs())));
    let keeps = |&(joint, by): &(usize, f64)| {
        poses.iter().all(|pose| {
            let mut q = **pose;
            q.as_array_mut()[joint] += by;
            cell.keeps_limits(&q)
        })
    };
    both.filter(keeps).collect()
}

/// Via points from `a` to `b` without the bar; `None` when none were found.
///
/// Two trees grow towards random joint vectors and one another until they meet (J. J. Kuffner and S. M. LaValle, "RRT-Connect", IEEE
/// ICRA 2000); then pieces of the way that a straight one can replace are left out.
pub(super) fn free(cell: &Cell<'_>, a: &JointVector<f64>, b: &JointVector<f64>, seed: u64) -> Option<Vec<JointVector<f64>>> {
    if is_clear(cell, None, a, b) {
        return Some(Vec::new());
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut trees = [Tree::new(a), Tree::new(b)];
    for sample in 0..SAMPLES {
        let (near, far) = (sample % 2, 1 - sample % 2);
        let Some(tip) = trees[near].branch(cell, &sample_about(cell, a, b, &mut rng)) else { continue };
        let tip_q = trees[near].nodes[tip].0;
        let mut left_s = f64::INFINITY;
        while let Some(other) = trees[far].branch(cell, &tip_q) {
            let still_s = cell.seconds(&trees[far].nodes[other].0, &tip_q);
            if still_s > 0.0 {
                if still_s > left_s - BRANCH_S / 4.0 {
                    break;
                }
                left_s = still_s;
                continue;
            }
            let mut way = trees[near].to_root(tip);
            way.reverse();
            way.extend(trees[far].to_root(other).into_iter().skip(1));
            if near == 1 {
                way.reverse();
            }
            shorten(cell, &mut way, &mut rng);
            return way.get(1..way.len() - 1).map(<[_]>::to_vec);
        }
    }
    None
}

/// A joint vector within limits and no more than half a turn beyond the ends of the way.
fn sample_about(cell: &Cell<'_>, a: &JointVector<f64>, b: &JointVector<f64>, rng: &mut ChaCha8Rng) -> JointVector<f64> {
    let mut q = *a;
    let ends = a.as_array().iter().zip(b.as_array());
    for ((value, limits), (a, b)) in q.as_array_mut().iter_mut().zip(&cell.robot.limits).zip(ends) {
        *value = rng.random_range(limits.min.max(a.min(*b) - PI)..limits.max.min(a.max(*b) + PI));
    }
    q
}

/// Joint vectors that clear ways lead to from a root, each with its parent.
struct Tree {
    nodes: Vec<(JointVector<f64>, Option<usize>)>,
}

impl Tree {
    fn new(root: &JointVector<f64>) -> Self {
        Self { nodes: vec![(*root, None)] }
    }

    /// Grows from the nearest node towards a joint vector, by one branch, or what of it is clear, or all the way; `None` when
    /// even a short branch is blocked.
    fn branch(&mut self, cell: &Cell<'_>, towards: &JointVector<f64>) -> Option<usize> {
        let seconds = |node: usize| cell.seconds(&self.nodes[node].0, towards);
        let nearest = (0..self.nodes.len()).min_by(|&x, &y| seconds(x).total_cmp(&seconds(y)))?;
        let from = self.nodes[nearest].0;
        let whole = (BRANCH_S / cell.seconds(&from, towards)).min(1.0);
        let tip = [1.0, 0.5, 0.25, 0.125].into_iter().find_map(|part| {
            let tip = if whole * part < 1.0 { along(&from, towards, whole * part) } else { *towards };
            (is_sound(cell, None, &tip, &Swing::NONE) && is_clear(cell, None, &from, &tip)).then_some(tip)
        })?;
        self.nodes.push((tip, Some(nearest)));
        Some(self.nodes.len() - 1)
    }

    fn to_root(&self, node: usize) -> Vec<JointVector<f64>> {
        std::iter::successors(Some(node), |&node| self.nodes[node].1).map(|node| self.nodes[node].0).collect()
    }
}

fn along(from: &JointVector<f64>, towards: &JointVector<f64>, share: f64) -> JointVector<f64> {
    let mut q = *from;
    for (value, end) in q.as_array_mut().iter_mut().zip(towards.as_array()) {
        *value += share * (end - *value);
    }
    q
}

fn shorten(cell: &Cell<'_>, way: &mut Vec<JointVector<f64>>, rng: &mut ChaCha8Rng) {
    for _ in 0..SHORTCUTS {
        if way.len() < 3 {
            break;
        }
        let first = rng.random_range(0..way.len() - 2);
        let last = rng.random_range(first + 2..way.len());
        if is_clear(cell, None, &way[first], &way[last]) {
            way.drain(first + 1..last);
        }
    }
}
