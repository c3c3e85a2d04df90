//! A rig: chucks on the table, spheres on the tool, the bar.

use ballbar::{Pairing, Vector3};

use super::solids::Solids;

/// A chuck (base frame) or a sphere (tool frame).
#[derive(Clone, Debug, PartialEq)]
pub struct NamedPoint {
    /// Its name in poses and pairings.
    pub name: String,
    /// Its centre, metres.
    pub position_m: Vector3<f64>,
}

/// Indices of a chuck and a sphere of a rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PairingId {
    /// Index into [`Rig::chucks`].
    pub chuck: usize,
    /// Index into [`Rig::spheres`].
    pub sphere: usize,
}

/// The telescoping bar.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// Lengths at mid travel, one an extension rod, metres.
    pub lengths_m: Vec<f64>,
    /// Travel of the LVDT from end to end, metres.
    pub travel_m: f64,
}

impl Bar {
    /// Whether the bar, with one or another extension, can have this length.
    pub fn reaches(&self, length_m: f64) -> bool {
        self.lengths_m.iter().any(|middle_m| (length_m - middle_m).abs() <= self.travel_m / 2.0)
    }
}

/// Where the bar can be attached.
#[derive(Clone, Debug)]
pub struct Rig {
    /// Chucks on the table, base frame.
    pub chucks: Vec<NamedPoint>,
    /// Spheres on the tool, end-effector frame.
    pub spheres: Vec<NamedPoint>,
    /// The bar, where it is described.
    pub bar: Option<Bar>,
    /// Sizes of what must not meet, for planning.
    pub solids: Solids,
}

impl Rig {
    /// Centres of the two ends of a pairing.
    pub fn pairing(&self, id: PairingId) -> Pairing<f64> {
        Pairing { chuck_base_m: self.chucks[id.chuck].position_m, sphere_tool_m: self.spheres[id.sphere].position_m }
    }

    /// `A:1`.
    pub fn pairing_name(&self, id: PairingId) -> String {
        format!("{}:{}", self.chucks[id.chuck].name, self.spheres[id.sphere].name)
    }

    /// Every chuck with every sphere, chuck by chuck.
    pub fn all_pairings(&self) -> Vec<PairingId> {
        let spheres = 0..self.spheres.len();
        (0..self.chucks.len()).flat_map(|chuck| spheres.clone().map(move |sphere| PairingId { chuck, sphere })).collect()
    }

    /// Index of a chuck of that name.
    pub fn chuck(&self, name: &str) -> Option<usize> {
        self.chucks.iter().position(|chuck| chuck.name == name)
    }

    /// Index of a sphere of that name.
    pub fn sphere(&self, name: &str) -> Option<usize> {
        self.spheres.iter().position(|sphere| sphere.name == name)
    }
}
