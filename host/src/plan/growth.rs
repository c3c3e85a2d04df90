//! Choosing a shell's postures: the most telling ones that ways join with one another.

use std::collections::{BTreeMap, BTreeSet};

use ballbar::JointVector;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::cell::Cell;
use super::experience::Experience;
use super::grid::{Crossing, Grid};
use super::posture::{Shell, find};
use super::shell::{Node, ShellRoads};
use super::way;

/// Postures looked for at a crossing.
const POSTURES: usize = 16;
/// Of the postures at a crossing so many are tried, the most telling first, before it is put off.
const FIRST_CHOICES: usize = 4;
/// Neighbours to which a way is tried from a new posture.
const NEIGHBOURS: usize = 3;
/// How many poses a shell should have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    /// Crossings with a posture.
    pub(super) crossings: usize,
    /// Postures at a crossing, at most.
    pub(super) per_crossing: usize,
}

impl ShellRoads {
    /// Chooses postures. Where part of the grid is not reached, longitudes between the others make up for it.
    ///
    /// Of a crossing's postures the one is taken that tells most beyond those taken so far. It has to be joined to them by a way; a
    /// posture that is not starts an island, and only the largest island counts in the end. `tick` is called for each crossing with a
    /// posture.
    pub(super) fn new(cell: &Cell<'_>, shell: Shell, grid: &Grid, wanted: Wanted, rng: &mut ChaCha8Rng, tick: &dyn Fn()) -> Self {
        let roads = Self { shell, hindrances: BTreeMap::new(), nodes: Vec::new(), ways: BTreeMap::new(), crossings: Vec::new() };
        let experience = Experience::new(cell.robot.chain.parameter_count());
        let mut growth = Growth { cell, roads, islands: Islands::default(), experience, choices: Vec::new(), tick };
        for crossing in grid.crossings() {
            growth.grow(crossing, rng);
        }
        growth.join_islands();
        growth.join_put_off(wanted.per_crossing);
        for mut between in grid.between() {
            between.shuffle(rng);
            for crossing in between {
                if growth.reached() >= wanted.crossings {
                    break;
                }
                growth.grow(crossing, rng);
            }
        }
        growth.join_put_off(wanted.per_crossing);
        let largest = growth.islands.largest();
        let islands = growth.islands;
        growth.roads.keep(|node| islands.of[node] == largest);
        growth.roads
    }
}

/// A shell's postures, being chosen.
struct Growth<'a, 'c> {
    cell: &'a Cell<'c>,
    roads: ShellRoads,
    islands: Islands,
    experience: Experience,
    /// Of each crossing the postures that are not nodes.
    choices: Vec<Vec<Node>>,
    tick: &'a dyn Fn(),
}

impl Growth<'_, '_> {
    /// Crossings with a posture on the largest island.
    fn reached(&self) -> usize {
        let largest = self.islands.largest();
        let nodes = self.roads.nodes.iter().zip(&self.islands.of);
        nodes.filter(|(_, island)| **island == largest).map(|(node, _)| node.crossing).collect::<BTreeSet<_>>().len()
    }

    /// Takes a crossing in, with the posture that tells most of those that can be joined.
    fn grow(&mut self, crossing: Crossing, rng: &mut ChaCha8Rng) {
        let index = self.roads.crossings.len();
        self.roads.crossings.push(crossing);
        let found = find(self.cell, &self.roads.shell, &crossing, POSTURES, rng);
        if found.postures.is_empty() {
            self.roads.hindrances.insert(index, found.hindrance());
        }
        let row = |q: &JointVector<f64>| self.cell.plausible_row(q, &self.roads.shell.pairing);
        let mut nodes: Vec<Node> = found.postures.into_iter().map(|q| Node { crossing: index, row: row(&q), q }).collect();
        nodes.sort_by(|a, b| self.experience.novelty(&b.row).total_cmp(&self.experience.novelty(&a.row)));
        if !nodes.is_empty() {
            let best = nodes.iter().take(FIRST_CHOICES).enumerate();
            let largest = self.islands.largest();
            let to_largest = best.clone().find_map(|(at, node)| Some((at, self.neighbour(node, |island| island == largest)?)));
            let joined = to_largest
                .or_else(|| best.clone().find_map(|(at, node)| Some((at, self.neighbour(node, |island| island != largest)?))));
            let node = match joined {
                Some((at, way)) => self.push(nodes.remove(at), Some(way)),
                None => self.push(nodes.remove(0), None),
            };
            self.experience.add(&self.roads.nodes[node].row);
        }
        self.choices.push(nodes);
    }

    /// Looks for ways from other islands to the largest.
    fn join_islands(&mut self) {
        for node in 0..self.roads.nodes.len() {
            let largest = self.islands.largest();
            let island = self.islands.of[node];
            if island == largest {
                continue;
            }
            if let Some((other, vias)) = self.neighbour(&self.roads.nodes[node], |island| island == largest) {
                self.roads.ways.insert((other.min(node), other.max(node)), Some(reversed_if(vias, other > node)));
                self.islands.join(island, largest);
            }
        }
    }

    /// Joins crossings that were put off to the largest island, and more postures where more are wanted.
    fn join_put_off(&mut self, per_crossing: usize) {
        let largest = self.islands.largest();
        for index in 0..self.choices.len() {
            let at_crossing = (0..self.roads.nodes.len()).filter(|&i| self.roads.nodes[i].crossing == index);
            let mut have = at_crossing.filter(|&i| self.islands.of[i] == largest).count();
            for node in std::mem::take(&mut self.choices[index]) {
                if have >= per_crossing {
                    break;
                }
                if let Some(way) = self.neighbour(&node, |island| island == largest) {
                    self.push(node, Some(way));
                    have += 1;
                }
            }
        }
    }

    /// A node of certain islands to which a way leads, and its via points from there.
    fn neighbour(&self, node: &Node, is_wanted: impl Fn(usize) -> bool) -> Option<(usize, Vec<JointVector<f64>>)> {
        let nodes = &self.roads.nodes;
        let members = (0..nodes.len()).filter(|&i| is_wanted(self.islands.of[i]));
        let mut near: Vec<(usize, f64)> = members.map(|i| (i, self.cell.seconds(&nodes[i].q, &node.q))).collect();
        near.sort_by(|a, b| a.1.total_cmp(&b.1));
        let mut near = near.iter().take(NEIGHBOURS);
        near.find_map(|&(i, _)| Some((i, way::attached(self.cell, &self.roads.shell, &nodes[i].q, &node.q)?)))
    }

    fn push(&mut self, node: Node, joined: Option<(usize, Vec<JointVector<f64>>)>) -> usize {
        let index = self.roads.nodes.len();
        if self.roads.nodes.iter().all(|other| other.crossing != node.crossing) {
            (self.tick)();
        }
        self.roads.nodes.push(node);
        match joined {
            Some((other, vias)) => {
                self.roads.ways.insert((other, index), Some(vias));
                self.islands.of.push(self.islands.of[other]);
            }
            None => self.islands.of.push(index),
        }
        index
    }
}

fn reversed_if(mut vias: Vec<JointVector<f64>>, is_reversed: bool) -> Vec<JointVector<f64>> {
    if is_reversed {
        vias.reverse();
    }
    vias
}

/// Which nodes are joined: the number of each one's island.
#[derive(Default)]
struct Islands {
    of: Vec<usize>,
}

impl Islands {
    fn join(&mut self, one: usize, other: usize) {
        self.of.iter_mut().filter(|island| **island == one).for_each(|island| *island = other);
    }

    /// The island of most nodes, of several the first.
    fn largest(&self) -> usize {
        let mut counts = BTreeMap::<usize, usize>::new();
        for &island in &self.of {
            *counts.entry(island).or_default() += 1;
        }
        counts.into_iter().max_by_key(|&(island, count)| (count, std::cmp::Reverse(island))).map_or(0, |(island, _)| island)
    }
}
