//! Between which things motion changes the gap, and how it does.

use super::things::{Thing, What};
use crate::plan::contact::Contact;

/// Two things whose gap depends on the posture, as indices; the first is moved by fewer joints.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub(super) a: usize,
    pub(super) b: usize,
    pub(super) contact: Contact,
    /// Of the ends of the first thing's capsule, and of the second one's.
    pub(super) ends: [[End; 2]; 2],
}

/// Whether an end of a capsule keeps its gap to another thing in every posture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum End {
    /// No, or there is none.
    Moves,
    /// Yes, and it is far enough away.
    Still,
    /// Yes, but nearer than the clearance: the capsule is looked at without that rounded end.
    Cut,
}

/// A gap at a still end is no less than at the end itself, but for rounding.
pub(super) const AT_STILL_END_M: f64 = 1e-6;

/// Every two things that joints move against one another, but the robot's foot and the table that it stands on.
pub(super) fn candidates(things: &[Thing]) -> impl Iterator<Item = Pair> + '_ {
    let foot = things.iter().find_map(|thing| match thing.what {
        What::Link(body) => Some(body.link),
        _ => None,
    });
    let each = (0..things.len()).flat_map(move |b| (0..b).map(move |a| (a, b)));
    each.filter(|&(a, b)| things[a].joints < things[b].joints).filter_map(move |(a, b)| {
        let contact = match (&things[a].what, &things[b].what) {
            (What::Table { .. }, What::Link(body)) if Some(body.link) == foot => return None,
            (What::Table { .. }, What::Link(body)) => Contact::LinkTable(body.link + 1),
            (What::ChuckPlate(_) | What::Chuck { .. }, What::Link(body)) => Contact::LinkChucks(body.link + 1),
            (What::Link(one), What::Link(other)) => Contact::Links(one.link + 1, other.link + 1),
            (What::Link(body), What::SpherePlate(_)) => Contact::ToolLink(body.link + 1),
            (What::Link(body), What::Sphere { .. }) => Contact::SphereLink(body.link + 1),
            _ => Contact::ToolTable,
        };
        Some(Pair { a, b, contact, ends: [[End::Moves; 2]; 2] })
    })
}

/// The gaps of two things over many postures.
pub(in crate::plan) struct Gap {
    pub(super) pair: Pair,
    pub(in crate::plan) whole: Range,
    /// Of the ends of either thing's capsule.
    pub(super) of_ends: [[Range; 2]; 2],
}

/// A gap that differs by less, from posture to posture, is one that motion cannot change.
pub(in crate::plan) const CONSTANT_M: f64 = 0.005;

/// From the least to the most.
#[derive(Clone, Copy, Debug)]
pub(in crate::plan) struct Range {
    pub(in crate::plan) least_m: f64,
    pub(in crate::plan) most_m: f64,
}

impl Range {
    const UNSEEN: Self = Self { least_m: f64::INFINITY, most_m: f64::NEG_INFINITY };

    pub(super) fn see(&mut self, gap_m: f64) {
        (self.least_m, self.most_m) = (self.least_m.min(gap_m), self.most_m.max(gap_m));
    }

    /// Of a thing so much thinner.
    pub(super) fn plus(self, thinner_m: f64) -> Self {
        Self { least_m: self.least_m + thinner_m, most_m: self.most_m + thinner_m }
    }

    /// Motion cannot change it.
    pub(in crate::plan) fn is_constant(&self) -> bool {
        self.most_m - self.least_m < CONSTANT_M
    }

    /// Of the end of a capsule that has these gaps.
    pub(super) fn end(&self, clearance_m: f64) -> End {
        match self {
            range if !range.is_constant() => End::Moves,
            range if range.least_m >= clearance_m => End::Still,
            _ => End::Cut,
        }
    }
}

impl Gap {
    pub(super) fn unseen(pair: Pair) -> Self {
        Self { pair, whole: Range::UNSEEN, of_ends: [[Range::UNSEEN; 2]; 2] }
    }

    pub(super) fn ends(&self, clearance_m: f64) -> [[End; 2]; 2] {
        self.of_ends.map(|ends| ends.map(|range| range.end(clearance_m)))
    }

    /// Whether the thing stands first or second in the pair, if the pair is of it and the other.
    pub(super) fn side_of(&self, thing: usize, other: usize) -> Option<usize> {
        [(self.pair.a, self.pair.b), (self.pair.b, self.pair.a)].iter().position(|pair| *pair == (thing, other))
    }

    /// Motion cannot change it, or not at the end of a capsule.
    pub(in crate::plan) fn has_constant_part(&self) -> bool {
        self.whole.is_constant() || self.of_ends.iter().flatten().any(Range::is_constant)
    }

    /// The two things.
    pub(in crate::plan) fn of<'a>(&self, things: &'a [Thing]) -> (&'a Thing, &'a Thing) {
        (&things[self.pair.a], &things[self.pair.b])
    }

    pub(super) fn is_of_links(&self, things: &[Thing]) -> bool {
        matches!(self.of(things), (Thing { what: What::Link(_), .. }, Thing { what: What::Link(_), .. }))
    }
}
