//! Postures in which the tool holds the bar's sphere at a point: tool orientations that keep the bar off its own fixture, every
//! branch of the arm, and of those the ones that keep all margins.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt;

use ballbar::{JointVector, Pairing, Pose, Vector3};
use nalgebra::{Rotation3, Unit};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::cell::Cell;
use super::contact::Contact;
use super::grid::Crossing;
use crate::kinematics::Thoroughness;
use crate::model::PairingId;

/// Why a point is not measured, in the order in which postures are tested.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Hindrance {
    /// No tool orientation tried brings the sphere there.
    OutOfReach,
    /// Joint limits, or their margin, forbid every posture.
    Limits,
    /// Every posture is too near a singularity.
    Singular,
    /// A plausible true robot might pull the bar out of its travel.
    Travel,
    /// Something is in the way.
    Contact(Contact),
    /// There is a posture, but no way to it from the others with the bar attached.
    NoWay,
}

impl fmt::Display for Hindrance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfReach => f.write_str("out of reach"),
            Self::Limits => f.write_str("joint limits"),
            Self::Singular => f.write_str("near a singularity"),
            Self::Travel => f.write_str("a true robot might leave the bar's travel"),
            Self::Contact(contact) => contact.fmt(f),
            Self::NoWay => f.write_str("no way with the bar attached"),
        }
    }
}

/// Postures that keep all margins, and what the others met.
#[derive(Clone, Debug, Default)]
pub(super) struct Found {
    pub(super) postures: Vec<JointVector<f64>>,
    hindrances: BTreeMap<Hindrance, usize>,
}

impl Found {
    /// What most of those met that came farthest in the tests.
    pub(super) fn hindrance(&self) -> Hindrance {
        let contacts = self.hindrances.iter().filter(|(hindrance, _)| matches!(hindrance, Hindrance::Contact(_)));
        let most = contacts.max_by_key(|(_, count)| **count).or_else(|| self.hindrances.iter().next_back());
        most.map_or(Hindrance::OutOfReach, |(hindrance, _)| *hindrance)
    }
}

/// Where the bar is attached, and how long it is at mid travel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shell {
    pub(super) id: PairingId,
    pub(super) pairing: Pairing<f64>,
    pub(super) bar_m: f64,
}

/// Tool orientations tried at a point at most.
const ORIENTATIONS: usize = 80;
/// Orientations that must be without any solution before a point counts as out of reach.
const HOPELESS: usize = 24;
/// Lean of the bar against the sphere plate's normal, at most: flat on the plate it would meet the plate in any case.
const STEEPEST_LEAN_RAD: f64 = FRAC_PI_2;

/// Travel that a posture must leave beyond the margin, so that ways from it to others have room, metres.
const ROOM_FOR_WAYS_M: f64 = 0.004;

/// Looks for up to `wanted` postures at a crossing.
pub(super) fn find(cell: &Cell<'_>, shell: &Shell, crossing: &Crossing, wanted: usize, rng: &mut ChaCha8Rng) -> Found {
    let mut found = Found::default();
    let target_m = shell.pairing.chuck_base_m + crossing.along_bar() * shell.bar_m;
    let mut any_solution = false;
    for tried in 0..ORIENTATIONS {
        if found.postures.len() >= wanted || (tried >= HOPELESS && !any_solution) {
            break;
        }
        let solutions = solutions(cell, shell, crossing, &target_m, &mut found, rng);
        any_solution |= !solutions.is_empty() || found.hindrances.contains_key(&Hindrance::Limits);
        for q in solutions {
            match hindrance(cell, shell, &q) {
                None => found.postures.push(q),
                Some(hindrance) => *found.hindrances.entry(hindrance).or_default() += 1,
            }
        }
    }
    found
}

/// Joint vectors of one tool orientation; of arms that cannot choose it, of one random start.
fn solutions(
    cell: &Cell<'_>,
    shell: &Shell,
    crossing: &Crossing,
    target_m: &Vector3<f64>,
    found: &mut Found,
    rng: &mut ChaCha8Rng,
) -> Vec<JointVector<f64>> {
    /// An arm with fewer joints cannot turn its tool freely.
    const FREE_JOINTS: usize = 6;
    let inverse = &cell.inverse;
    let branches = if inverse.skeleton().joints() < FREE_JOINTS {
        let start = inverse.random_start(rng);
        let q = inverse.skeleton().reach_point(&start, &shell.pairing.sphere_tool_m, target_m);
        let q = q.map(|q| inverse.unwound(&q));
        if q.is_some_and(|q| !inverse.is_within_limits(&q)) {
            *found.hindrances.entry(Hindrance::Limits).or_default() += 1;
        }
        q.filter(|q| inverse.is_within_limits(q)).into_iter().collect()
    } else {
        let rotation = orientation(&cell.scene.sphere_plate_normal(), &-crossing.along_bar(), rng);
        let pose = Pose { rotation, translation_m: target_m - rotation * shell.pairing.sphere_tool_m };
        let branches = inverse.branches(&pose, Thoroughness::SOME, rng);
        if branches.beyond_limits > 0 {
            *found.hindrances.entry(Hindrance::Limits).or_default() += branches.beyond_limits;
        }
        branches.within_limits
    };
    if branches.is_empty() {
        *found.hindrances.entry(Hindrance::OutOfReach).or_default() += 1;
    }
    branches
}

/// A random turn of the tool that lets the bar leave the sphere plate on its free side.
fn orientation(normal_tool: &Vector3<f64>, towards_chuck: &Vector3<f64>, rng: &mut ChaCha8Rng) -> nalgebra::Matrix3<f64> {
    // Even over the cap of leans.
    let lean_rad = rng.random_range(STEEPEST_LEAN_RAD.cos()..1.0).acos();
    let (about_bar_rad, roll_rad) = (rng.random_range(0.0..TAU), rng.random_range(0.0..TAU));
    let across = towards_chuck.cross(&if towards_chuck.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() });
    let lean_axis = Rotation3::from_axis_angle(&Unit::new_normalize(*towards_chuck), about_bar_rad) * Unit::new_normalize(across);
    let normal_base = Rotation3::from_axis_angle(&lean_axis, lean_rad) * towards_chuck;
    let upright = Rotation3::rotation_between(normal_tool, &normal_base)
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Unit::new_normalize(perpendicular(normal_tool)), PI));
    (Rotation3::from_axis_angle(&Unit::new_normalize(normal_base), roll_rad) * upright).into_inner()
}

fn perpendicular(v: &Vector3<f64>) -> Vector3<f64> {
    v.cross(&if v.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() })
}

/// The first margin that a posture does not keep.
pub(super) fn hindrance(cell: &Cell<'_>, shell: &Shell, q: &JointVector<f64>) -> Option<Hindrance> {
    if !cell.keeps_limits(q) {
        return Some(Hindrance::Limits);
    }
    let posture = cell.posture(q);
    if cell.singularity(&posture) < cell.margins.singularity {
        return Some(Hindrance::Singular);
    }
    if cell.travel_margin_m(q, &shell.pairing, shell.bar_m) < cell.margins.travel_m + ROOM_FOR_WAYS_M {
        return Some(Hindrance::Travel);
    }
    let nearest = cell.nearest(&posture, Some(shell.id));
    (nearest.gap_m < cell.margins.clearance_m).then_some(Hindrance::Contact(nearest.contact))
}
