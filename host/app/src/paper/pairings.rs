//! Table I: how many parameters each choice of pairings identifies.

use std::collections::BTreeMap;

use ballbar::{Chain, Measurement};
use ballbar_calib::identify::{Observation, Spectrum};
use ballbar_calib::model::PairingId;
use nalgebra::DMatrix;

/// The Jacobian of each pairing, ready to be combined.
#[derive(Clone, Debug)]
pub struct PairingRanks {
    pairings: Vec<PairingId>,
    /// At most P + 1 rows each, with all singular values of the full Jacobian.
    triangles: Vec<DMatrix<f64>>,
}

/// All subsets of pairings that have as many pairings and use as many chucks and spheres.
#[derive(Clone, Debug, PartialEq)]
pub struct RankClass {
    /// Pairings in each subset.
    pub pairings: usize,
    /// Chucks that they use.
    pub chucks: usize,
    /// Spheres that they use.
    pub spheres: usize,
    /// Number of such subsets.
    pub subsets: usize,
    /// Smallest rank among them.
    pub min_rank: usize,
    /// Largest rank among them.
    pub max_rank: usize,
}

impl PairingRanks {
    /// Reduces each pairing's measurements to a triangle.
    pub fn new(chain: &Chain<f64>, measurements: &[(PairingId, Measurement<f64>)]) -> Self {
        let mut by_pairing: BTreeMap<PairingId, Vec<Measurement<f64>>> = BTreeMap::new();
        for (pairing, measurement) in measurements {
            by_pairing.entry(*pairing).or_default().push(*measurement);
        }
        let triangles = by_pairing.values().map(|rows| Observation::new(chain, rows).jacobian).collect();
        Self { pairings: by_pairing.into_keys().collect(), triangles }
    }

    /// Number of subsets but the empty one: 511 for nine pairings.
    pub fn subsets(&self) -> u32 {
        (1 << self.pairings.len()) - 1
    }

    /// The pairings of a subset, given by the bits of its number, from 1.
    pub fn members(&self, subset: u32) -> Vec<PairingId> {
        self.chosen(subset).map(|i| self.pairings[i]).collect()
    }

    /// Rank of the subset's poses together.
    pub fn rank(&self, subset: u32) -> usize {
        let parts: Vec<&DMatrix<f64>> = self.chosen(subset).map(|i| &self.triangles[i]).collect();
        let columns = parts.first().map_or(0, |part| part.ncols());
        let rows: usize = parts.iter().map(|part| part.nrows()).sum();
        let mut stacked = DMatrix::zeros(rows, columns);
        let mut at = 0;
        for part in parts {
            stacked.rows_mut(at, part.nrows()).copy_from(part);
            at += part.nrows();
        }
        Spectrum::new(&stacked).rank
    }

    /// Ranks of all subsets, by class; `on_subset` is called after each.
    pub fn classes(&self, mut on_subset: impl FnMut()) -> Vec<RankClass> {
        let mut classes: BTreeMap<(usize, usize, usize), RankClass> = BTreeMap::new();
        for subset in 1..=self.subsets() {
            let members = self.members(subset);
            let (chucks, spheres) = (distinct(members.iter().map(|p| p.chuck)), distinct(members.iter().map(|p| p.sphere)));
            let rank = self.rank(subset);
            let class = classes.entry((members.len(), chucks, spheres)).or_insert(RankClass {
                pairings: members.len(),
                chucks,
                spheres,
                subsets: 0,
                min_rank: rank,
                max_rank: rank,
            });
            class.subsets += 1;
            class.min_rank = class.min_rank.min(rank);
            class.max_rank = class.max_rank.max(rank);
            on_subset();
        }
        classes.into_values().collect()
    }

    fn chosen(&self, subset: u32) -> impl Iterator<Item = usize> {
        (0..self.pairings.len()).filter(move |i| subset >> i & 1 == 1)
    }
}

fn distinct(values: impl Iterator<Item = usize>) -> usize {
    values.collect::<std::collections::BTreeSet<_>>().len()
}
