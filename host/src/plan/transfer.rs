//! The way from the last pose of one shell to the first of the next, with the bar taken off.

use ballbar::JointVector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::cell::Cell;
use super::way::{is_clear, is_sound};

/// Samples of the joint space before a way counts as not there.
const SAMPLES: usize = 3000;
/// Longest branch of a tree, seconds of motion.
const BRANCH_S: f64 = 1.0;
/// Tries to leave out pieces of a way.
const SHORTCUTS: usize = 100;

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
        let Some(tip) = trees[near].branch(cell, &cell.inverse.random_start(&mut rng)) else { continue };
        let tip_q = trees[near].nodes[tip].0;
        while let Some(other) = trees[far].branch(cell, &tip_q) {
            if trees[far].nodes[other].0 != tip_q {
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

/// Joint vectors that clear ways lead to from a root, each with its parent.
struct Tree {
    nodes: Vec<(JointVector<f64>, Option<usize>)>,
}

impl Tree {
    fn new(root: &JointVector<f64>) -> Self {
        Self { nodes: vec![(*root, None)] }
    }

    /// Grows from the nearest node towards a joint vector, by one branch or all the way; `None` when that is blocked.
    fn branch(&mut self, cell: &Cell<'_>, towards: &JointVector<f64>) -> Option<usize> {
        let seconds = |node: usize| cell.seconds(&self.nodes[node].0, towards);
        let nearest = (0..self.nodes.len()).min_by(|&x, &y| seconds(x).total_cmp(&seconds(y)))?;
        let from = self.nodes[nearest].0;
        let share = BRANCH_S / cell.seconds(&from, towards);
        let mut tip = *towards;
        if share < 1.0 {
            for (value, from) in tip.as_array_mut().iter_mut().zip(from.as_array()) {
                *value = from + share * (*value - from);
            }
        }
        if !is_sound(cell, None, &tip, 0.0) || !is_clear(cell, None, &from, &tip) {
            return None;
        }
        self.nodes.push((tip, Some(nearest)));
        Some(self.nodes.len() - 1)
    }

    fn to_root(&self, node: usize) -> Vec<JointVector<f64>> {
        std::iter::successors(Some(node), |&node| self.nodes[node].1).map(|node| self.nodes[node].0).collect()
    }
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
