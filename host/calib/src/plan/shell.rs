//! One shell, planned: a posture for each crossing, all of them joined by ways on which the bar can stay attached.

use std::collections::BTreeMap;

use ballbar::JointVector;
use nalgebra::DMatrix;

use super::cell::Cell;
use super::grid::Crossing;
use super::order::{improve, short_order};
use super::posture::{Hindrance, Shell};
use super::progress::Part;
use super::way;

/// A posture at a crossing.
#[derive(Clone, Debug)]
pub(super) struct Node {
    /// Its crossing's index; `None` for the posture that a family begins with, which is not measured.
    pub(super) crossing: Option<usize>,
    pub(super) q: JointVector<f64>,
    /// Gradient of its length times plausible deviations, metres.
    pub(super) row: Vec<f64>,
}

/// Postures on a shell and the ways between them.
#[derive(Clone, Debug)]
pub(super) struct ShellRoads {
    pub(super) shell: Shell,
    pub(super) crossings: Vec<Crossing>,
    /// What kept crossings from being reached; crossings that are not here have a node.
    pub(super) hindrances: BTreeMap<usize, Hindrance>,
    /// All joined with one another by ways.
    pub(super) nodes: Vec<Node>,
    /// From the node of the lower index to that of the higher; `None` where none was found.
    pub(super) ways: BTreeMap<(usize, usize), Option<Vec<JointVector<f64>>>>,
}

/// One stop of a tour.
#[derive(Clone, Debug)]
pub(super) enum Stop {
    /// A point on the way.
    Via(JointVector<f64>),
    /// A pose to measure at: an index into the nodes.
    Measure(usize),
}

/// Tours that are looked at, each without the legs that turned out to be blocked in those before.
pub(super) const TOURS: usize = 25;

impl ShellRoads {
    /// Forgets all nodes that are not kept.
    pub(super) fn keep(&mut self, is_kept: impl Fn(usize) -> bool) {
        let mut new_index = vec![None; self.nodes.len()];
        let mut kept = Vec::new();
        for (i, node) in std::mem::take(&mut self.nodes).into_iter().enumerate() {
            if is_kept(i) {
                new_index[i] = Some(kept.len());
                kept.push(node);
            }
        }
        let ways = std::mem::take(&mut self.ways).into_iter();
        self.ways = ways.filter_map(|((a, b), way)| Some(((new_index[a]?, new_index[b]?), way))).collect();
        self.nodes = kept;
        for index in 0..self.crossings.len() {
            if self.nodes.iter().all(|node| node.crossing != Some(index)) {
                self.hindrances.entry(index).or_insert(Hindrance::NoWay);
            }
        }
    }

    /// For each crossing that was reached the node that was taken first.
    pub(super) fn one_per_crossing(&self) -> Vec<usize> {
        let first = |i: &usize| {
            let crossing = self.nodes[*i].crossing;
            crossing.is_some() && self.nodes[..*i].iter().all(|node| node.crossing != crossing)
        };
        (0..self.nodes.len()).filter(first).collect()
    }

    /// What hindered, and at how many crossings.
    pub(super) fn hindrance_counts(&self) -> Vec<(Hindrance, usize)> {
        let mut counts = BTreeMap::<Hindrance, usize>::new();
        for hindrance in self.hindrances.values() {
            *counts.entry(*hindrance).or_default() += 1;
        }
        counts.into_iter().collect()
    }

    /// A short tour of some nodes, by way of others where no straighter way is.
    ///
    /// Legs are looked at when a tour wants them: a leg that turns out longer than the straight line, or blocked, counts with
    /// what it really takes, and the tour is improved again.
    pub(super) fn tour(&mut self, cell: &Cell<'_>, chosen: &[usize], progress: &Part<'_>) -> Vec<Stop> {
        let (a, b) = (|i: usize| &self.nodes[chosen[i]].q, |i: usize| &self.nodes[chosen[i]].q);
        let mut seconds = DMatrix::from_fn(chosen.len(), chosen.len(), |i, j| cell.seconds(a(i), b(j)));
        let mut order = short_order(&seconds);
        for _ in 0..TOURS {
            progress.tick();
            let mut is_as_long_as_thought = true;
            for pair in order.windows(2) {
                let (i, j) = (pair[0], pair[1]);
                let true_s = self.leg_seconds(cell, chosen[i], chosen[j]);
                if true_s > seconds[(i, j)] * 1.01 {
                    seconds[(i, j)] = true_s;
                    seconds[(j, i)] = true_s;
                    is_as_long_as_thought = false;
                }
            }
            if is_as_long_as_thought {
                break;
            }
            improve(&seconds, &mut order);
        }
        let mut stops = Vec::new();
        for (k, &i) in order.iter().enumerate() {
            if let Some(&before) = k.checked_sub(1).and_then(|k| order.get(k)) {
                stops.extend(self.leg(cell, chosen[before], chosen[i]).into_iter().map(Stop::Via));
            }
            stops.push(Stop::Measure(chosen[i]));
        }
        stops
    }

    /// Seconds of the leg between two nodes.
    fn leg_seconds(&mut self, cell: &Cell<'_>, a: usize, b: usize) -> f64 {
        let vias = self.leg(cell, a, b);
        let stops: Vec<&JointVector<f64>> = [&self.nodes[a].q].into_iter().chain(&vias).chain([&self.nodes[b].q]).collect();
        stops.windows(2).map(|pair| cell.seconds(pair[0], pair[1])).sum()
    }

    /// Via points from one node to another: of the way between them, or else of the quickest known detour by other nodes.
    fn leg(&mut self, cell: &Cell<'_>, a: usize, b: usize) -> Vec<JointVector<f64>> {
        let key = (a.min(b), a.max(b));
        if !self.ways.contains_key(&key) {
            let found = way::attached(cell, &self.shell, &self.nodes[key.0].q, &self.nodes[key.1].q);
            self.ways.insert(key, found);
        }
        if let Some(vias) = self.known(a, b) {
            return vias;
        }
        let by = self.detour(cell, a, b);
        let mut vias = Vec::new();
        for pair in by.windows(2) {
            vias.extend(self.known(pair[0], pair[1]).unwrap_or_default());
            if pair[1] != b {
                vias.push(self.nodes[pair[1]].q);
            }
        }
        vias
    }

    /// The via points of a way that was found, from `a` to `b`.
    fn known(&self, a: usize, b: usize) -> Option<Vec<JointVector<f64>>> {
        let mut vias = self.ways.get(&(a.min(b), a.max(b)))?.clone()?;
        if a > b {
            vias.reverse();
        }
        Some(vias)
    }

    /// The quickest chain of known ways (E. W. Dijkstra 1959). There is one: nodes were joined when they were taken.
    fn detour(&self, cell: &Cell<'_>, a: usize, b: usize) -> Vec<usize> {
        let mut roads: Vec<Vec<(usize, f64)>> = vec![Vec::new(); self.nodes.len()];
        for (&(i, j), way) in &self.ways {
            let Some(vias) = way else { continue };
            let stops: Vec<&JointVector<f64>> = [&self.nodes[i].q].into_iter().chain(vias).chain([&self.nodes[j].q]).collect();
            let seconds = stops.windows(2).map(|pair| cell.seconds(pair[0], pair[1])).sum();
            roads[i].push((j, seconds));
            roads[j].push((i, seconds));
        }
        let mut seconds = vec![f64::INFINITY; self.nodes.len()];
        let mut from = vec![None; self.nodes.len()];
        let mut open: Vec<usize> = (0..self.nodes.len()).collect();
        seconds[a] = 0.0;
        while let Some((at, &here)) = open.iter().enumerate().min_by(|x, y| seconds[*x.1].total_cmp(&seconds[*y.1])) {
            open.swap_remove(at);
            if here == b {
                break;
            }
            for &(next, leg_s) in &roads[here] {
                if seconds[here] + leg_s < seconds[next] {
                    seconds[next] = seconds[here] + leg_s;
                    from[next] = Some(here);
                }
            }
        }
        let mut by: Vec<usize> = std::iter::successors(Some(b), |&i| from[i]).collect();
        by.reverse();
        by
    }
}
