//! Choosing a shell's postures: the most telling ones that ways join with one another.

use std::collections::{BTreeMap, BTreeSet};

use ballbar::JointVector;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::cell::Cell;
use super::experience::Experience;
use super::grid::{Crossing, Grid};
use super::posture::{Shell, find};
use super::progress::Part;
use super::shell::{Node, ShellRoads};
use super::way;

/// Postures looked for at a crossing.
const POSTURES: usize = 16;
/// Of the postures at a crossing so many are tried, the most telling first, before it is put off.
const FIRST_CHOICES: usize = 4;
/// Of a later family so many are tried, those nearest to it.
const NEAREST_CHOICES: usize = 8;
/// Neighbours to which a way is tried from a new posture.
const NEIGHBOURS: usize = 3;
/// Families of postures that are looked for: with the elbow above and below, the arm to the left and to the right.
pub(super) const FAMILIES: usize = 3;
/// A later family that reaches fewer than this share of the first one's crossings is given up.
const SHARE_OF_FIRST: f64 = 0.3;
/// Beginnings of later families that are tried.
const BEGINNINGS: usize = 5;

/// How many poses a shell should have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    /// Crossings with a posture.
    pub(super) crossings: usize,
    /// Postures at a crossing, at most.
    pub(super) per_crossing: usize,
}

/// Families of postures on a shell, the largest first. Ways join those of a family with one another; none was found from family to
/// family.
///
/// Where part of the grid is not reached, longitudes between the others make up for it. `progress` is told of every crossing.
pub(super) fn families(
    cell: &Cell<'_>,
    shell: Shell,
    grid: &Grid,
    wanted: Wanted,
    rng: &mut ChaCha8Rng,
    progress: &Part<'_>,
) -> Vec<ShellRoads> {
    let mut first = Growth::new(cell, shell, wanted, progress);
    first.grow_all(grid, rng);
    let least = (SHARE_OF_FIRST * first.reached() as f64).ceil() as usize;
    let mut grown = vec![first];
    for start in grown[0].strangers(BEGINNINGS) {
        let is_known = |family: &Growth<'_, '_>| family.neighbour(&start, |island| island == family.home()).is_some();
        if grown.len() == FAMILIES || grown.iter().any(is_known) {
            continue;
        }
        let mut growth = Growth::new(cell, shell, wanted, progress);
        growth.begin(start);
        growth.grow_all(grid, rng);
        if growth.reached() >= least {
            grown.push(growth);
        }
    }
    for growth in &mut grown {
        growth.fill(grid, wanted, rng);
    }
    grown.into_iter().map(Growth::harvest).collect()
}

/// A shell's postures, being chosen.
struct Growth<'a, 'c> {
    cell: &'a Cell<'c>,
    roads: ShellRoads,
    islands: Islands,
    /// The island that counts; the largest when it is not given.
    home: Option<usize>,
    experience: Experience,
    /// Of each crossing the postures that are not nodes.
    choices: Vec<Vec<Node>>,
    most: usize,
    progress: &'a Part<'a>,
}

impl<'a, 'c> Growth<'a, 'c> {
    fn new(cell: &'a Cell<'c>, shell: Shell, wanted: Wanted, progress: &'a Part<'a>) -> Self {
        Self {
            cell,
            roads: ShellRoads {
                shell,
                hindrances: BTreeMap::new(),
                nodes: Vec::new(),
                ways: BTreeMap::new(),
                crossings: Vec::new(),
            },
            islands: Islands::default(),
            home: None,
            experience: Experience::new(cell.chain().parameter_count()),
            choices: Vec::new(),
            most: wanted.crossings,
            progress,
        }
    }

    fn home(&self) -> usize {
        self.home.unwrap_or_else(|| self.islands.largest())
    }

    /// The nodes of the island that counts, and the ways between them.
    fn harvest(mut self) -> ShellRoads {
        let (home, islands) = (self.home(), self.islands);
        self.roads.keep(|node| islands.of[node] == home);
        self.roads
    }

    /// Takes the grid in.
    fn grow_all(&mut self, grid: &Grid, rng: &mut ChaCha8Rng) {
        for crossing in grid.crossings() {
            self.grow(crossing, rng);
        }
        self.join_islands();
        self.join_put_off(1);
    }

    /// Takes crossings between those of the grid in, until there are enough, and more postures at each where more are wanted.
    fn fill(&mut self, grid: &Grid, wanted: Wanted, rng: &mut ChaCha8Rng) {
        for mut between in grid.between() {
            between.shuffle(rng);
            for crossing in between {
                if self.reached() >= wanted.crossings {
                    break;
                }
                self.grow(crossing, rng);
            }
        }
        self.join_put_off(wanted.per_crossing);
    }

    /// Postures that were not taken and are far from the family's: of the farthest fifth those with most others about them.
    fn strangers(&self, count: usize) -> Vec<Node> {
        const FARTHEST: f64 = 0.2;
        const ABOUT_RAD: f64 = 1.0;
        let home = self.home();
        let nodes = || self.roads.nodes.iter().zip(&self.islands.of).filter(|(_, island)| **island == home);
        let far_s = |node: &Node| nodes().map(|(other, _)| self.cell.seconds(&other.q, &node.q)).fold(f64::INFINITY, f64::min);
        let mut left: Vec<(f64, &Node)> = self.choices.iter().flatten().map(|node| (far_s(node), node)).collect();
        left.sort_by(|a, b| b.0.total_cmp(&a.0));
        left.truncate((left.len() as f64 * FARTHEST) as usize);
        let about_s = ABOUT_RAD / self.cell.pace.turn_rad_s;
        let is_about = |a: &Node, b: &Node| self.cell.seconds(&a.q, &b.q) < about_s;
        let mut strangers: Vec<&Node> = Vec::new();
        for _ in 0..count {
            let apart = || left.iter().map(|(_, node)| *node).filter(|node| strangers.iter().all(|other| !is_about(other, node)));
            let Some(next) = apart().max_by_key(|node| left.iter().filter(|(_, other)| is_about(node, other)).count()) else {
                break;
            };
            strangers.push(next);
        }
        strangers.into_iter().cloned().collect()
    }

    /// Starts a later family with a posture of its own.
    fn begin(&mut self, start: Node) {
        self.home = Some(0);
        // Its crossing is counted with the others when they are taken in; here it is the seed that they join.
        self.roads.nodes.push(Node { crossing: None, ..start });
        self.islands.of.push(0);
    }

    /// Crossings with a posture on the island that counts.
    fn reached(&self) -> usize {
        let home = self.home();
        let nodes = self.roads.nodes.iter().zip(&self.islands.of).filter(|(_, island)| **island == home);
        nodes.filter_map(|(node, _)| node.crossing).collect::<BTreeSet<_>>().len()
    }

    /// Takes a crossing in, with the posture that tells most of those that can be joined.
    fn grow(&mut self, crossing: Crossing, rng: &mut ChaCha8Rng) {
        self.progress.tick();
        let index = self.roads.crossings.len();
        self.roads.crossings.push(crossing);
        let found = find(self.cell, &self.roads.shell, &crossing, POSTURES, rng);
        if found.postures.is_empty() {
            self.roads.hindrances.insert(index, found.hindrance());
        }
        let rows = self.cell.plausible_rows(&found.postures, &self.roads.shell.pairing);
        let mut nodes: Vec<Node> =
            found.postures.into_iter().zip(rows).map(|(q, row)| Node { crossing: Some(index), row, q }).collect();
        let tries = if self.home.is_some() { self.nearest_first(&mut nodes) } else { FIRST_CHOICES.min(nodes.len()) };
        let novelty = |node: &Node| self.experience.novelty(&node.row);
        let sortable = if self.home.is_some() { tries } else { nodes.len() };
        nodes[..sortable].sort_by(|a, b| novelty(b).total_cmp(&novelty(a)));

        let best = || nodes.iter().take(tries).enumerate();
        let home = self.home();
        let to_home = best().find_map(|(at, node)| Some((at, self.neighbour(node, |island| island == home)?)));
        let joined = match (to_home, self.home) {
            (None, None) => best().find_map(|(at, node)| Some((at, self.neighbour(node, |island| island != home)?))),
            (to_home, _) => to_home,
        };
        let taken = match joined {
            Some((at, way)) => Some((nodes.remove(at), Some(way))),
            None if self.home.is_none() && !nodes.is_empty() => Some((nodes.remove(0), None)),
            None => None,
        };
        self.choices.push(nodes);
        if let Some((node, way)) = taken {
            self.experience.add(&node.row);
            self.push(node, way);
        }
    }

    /// Sorts postures by their nearness to the family; how many of them to try.
    fn nearest_first(&self, nodes: &mut [Node]) -> usize {
        let near_s = |node: &Node| {
            let others = self.roads.nodes.iter().map(|other| self.cell.seconds(&other.q, &node.q));
            others.fold(f64::INFINITY, f64::min)
        };
        nodes.sort_by_cached_key(|node| ordered(near_s(node)));
        NEAREST_CHOICES.min(nodes.len())
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

    /// Joins crossings that were put off to the island that counts, and more postures where more are wanted.
    fn join_put_off(&mut self, per_crossing: usize) {
        let home = self.home();
        for index in 0..self.choices.len() {
            let at_crossing = (0..self.roads.nodes.len()).filter(|&i| self.roads.nodes[i].crossing == Some(index));
            let mut have = at_crossing.filter(|&i| self.islands.of[i] == home).count();
            let is_enough = have == 0 && self.reached() >= self.most;
            let mut left = Vec::new();
            for node in std::mem::take(&mut self.choices[index]) {
                let joined =
                    if have < per_crossing && !is_enough { self.neighbour(&node, |island| island == home) } else { None };
                match joined {
                    Some(way) => {
                        self.push(node, Some(way));
                        have += 1;
                    }
                    None => left.push(node),
                }
            }
            self.choices[index] = left;
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

    fn push(&mut self, node: Node, joined: Option<(usize, Vec<JointVector<f64>>)>) {
        let index = self.roads.nodes.len();
        self.roads.nodes.push(node);
        match joined {
            Some((other, vias)) => {
                self.roads.ways.insert((other, index), Some(vias));
                self.islands.of.push(self.islands.of[other]);
            }
            None => self.islands.of.push(index),
        }
    }
}

/// Seconds as a key to sort by: never negative, so that the bits are in order.
fn ordered(seconds: f64) -> u64 {
    seconds.to_bits()
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
