//! A rig: chucks on the table, spheres on the tool, the bar.

use std::fmt;

use ballbar::{Pairing, Vector3};
use thiserror::Error;

use super::solids::Solids;

/// A chuck (base frame) or a sphere (tool frame).
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NamedPoint {
    /// Its name in poses and pairings.
    pub name: String,
    /// Its centre, metres.
    pub position_m: Vector3<f64>,
    /// How well each coordinate of the centre is known: its standard deviation, metres, zero where it is exact. `None` where nobody says.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub tolerance_m: Option<f64>,
}

impl NamedPoint {
    /// A chuck or a sphere at `position_m`, `(x, y, z)` in metres.
    pub fn new(name: impl Into<String>, position_m: [f64; 3]) -> Self {
        Self { name: name.into(), position_m: Vector3::from(position_m), tolerance_m: None }
    }
}

/// Indices of a chuck and a sphere of a rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PairingId {
    /// Index into [`Rig::chucks`].
    pub chuck: usize,
    /// Index into [`Rig::spheres`].
    pub sphere: usize,
}

impl PairingId {
    /// Index of the chuck or of the sphere.
    pub fn at(self, end: End) -> usize {
        match end {
            End::Chuck => self.chuck,
            End::Sphere => self.sphere,
        }
    }
}

/// The telescoping bar.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Bar {
    /// Lengths at mid travel, one an extension rod, metres.
    pub lengths_m: Vec<f64>,
    /// Travel of the LVDT from end to end, metres.
    pub travel_m: f64,
    /// How well the lengths at mid travel are known, one standard deviation each, metres, zero where it is exact. `None` where nobody says.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub zero_tolerances_m: Option<Vec<f64>>,
    /// How well the LVDT's gain is known: the standard deviation of displacements from mid travel, as a part of them, zero where it is
    /// exact. `None` where nobody says.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub gain_tolerance: Option<f64>,
}

impl Bar {
    /// Lengths of one bar are the same when they are nearer than this: they are whole millimetres.
    pub(crate) const SAME_M: f64 = 1e-6;

    /// A bar of which nobody says how well it is known.
    pub fn new(lengths_m: Vec<f64>, travel_m: f64) -> Self {
        Self { lengths_m, travel_m, zero_tolerances_m: None, gain_tolerance: None }
    }

    /// How well the length with one rod is known, metres; where the bar has no such rod, or `None` is asked of, as that which is known worst.
    pub fn zero_tolerance_m(&self, length_m: Option<f64>) -> Option<f64> {
        let tolerances_m = self.zero_tolerances_m.as_deref()?;
        let is_asked = |known_m: &f64| length_m.is_some_and(|length_m| (known_m - length_m).abs() < Self::SAME_M);
        let rod = self.lengths_m.iter().position(is_asked);
        rod.and_then(|rod| tolerances_m.get(rod).copied()).or_else(|| tolerances_m.iter().copied().reduce(f64::max))
    }

    /// Whether its numbers are those that a bar can have.
    fn is_sound(&self) -> bool {
        let is_size = |size_m: &f64| size_m.is_finite() && *size_m > 0.0;
        let zeros_m = self.zero_tolerances_m.as_deref();
        !self.lengths_m.is_empty()
            && self.lengths_m.iter().chain([&self.travel_m]).all(is_size)
            && zeros_m.is_none_or(|zeros_m| zeros_m.len() == self.lengths_m.len())
            && zeros_m.unwrap_or_default().iter().chain(&self.gain_tolerance).all(is_tolerance)
    }

    /// Whether the bar, with one or another extension, can have this length.
    pub fn reaches(&self, length_m: f64) -> bool {
        self.lengths_m.iter().any(|middle_m| (length_m - middle_m).abs() <= self.travel_m / 2.0)
    }
}

/// Where the bar can be attached. [`Rig::new`] makes one from numbers.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "super::stored::RigParts"))]
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

/// Which end of the bar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum End {
    /// On the table.
    Chuck,
    /// On the tool.
    Sphere,
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Chuck => "chuck",
            Self::Sphere => "sphere",
        })
    }
}

/// Why numbers are no rig.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum RigError {
    /// There is no chuck, or no sphere.
    #[error("no {0}, expected one at least")]
    Empty(End),
    /// Two chucks, or two spheres, have one name.
    #[error("two {end}s are called `{name}`")]
    Duplicate {
        /// Which end of the bar.
        end: End,
        /// Their name.
        name: String,
    },
    /// A centre is infinite or not a number.
    #[error("{end} `{name}` is not at finite numbers")]
    NotFinite {
        /// Which end of the bar.
        end: End,
        /// The name of the chuck or sphere.
        name: String,
    },
    /// A centre's tolerance is infinite, below zero or not a number.
    #[error("{end} `{name}` has a tolerance that is no finite number from 0 on")]
    Tolerance {
        /// Which end of the bar.
        end: End,
        /// The name of the chuck or sphere.
        name: String,
    },
    /// The bar has no length, or its travel or a length is not above zero, or a tolerance is below, or there is not one for each length.
    #[error(
        "the bar's travel and lengths have to be finite and above zero, and a length there has to be; its tolerances from 0 on, one a length"
    )]
    Bar,
}

impl Rig {
    /// Chucks in the base frame, spheres in the tool frame, and the bar where it is known: planning and simulation keep to its travel. The
    /// solids are the usual ones; set [`Rig::solids`] where they are not.
    ///
    /// # Errors
    /// [`RigError`] when there is no chuck or no sphere, when a name stands twice, or when a number is none that a rig can have.
    pub fn new(chucks: Vec<NamedPoint>, spheres: Vec<NamedPoint>, bar: Option<Bar>) -> Result<Self, RigError> {
        Self { chucks, spheres, bar, solids: Solids::default() }.checked()
    }

    /// What [`Rig::new`] promises of a rig, whoever has put it together.
    pub(super) fn checked(self) -> Result<Self, RigError> {
        check_points(End::Chuck, &self.chucks)?;
        check_points(End::Sphere, &self.spheres)?;
        if self.bar.as_ref().is_none_or(Bar::is_sound) { Ok(self) } else { Err(RigError::Bar) }
    }

    /// Centres of the two ends of a pairing.
    ///
    /// # Panics
    /// When `id` is of another rig, and this one has no such chuck or sphere. [`Rig::has`] tells.
    pub fn pairing(&self, id: PairingId) -> Pairing<f64> {
        Pairing { chuck_base_m: self.chucks[id.chuck].position_m, sphere_tool_m: self.spheres[id.sphere].position_m }
    }

    /// Whether a pairing's chuck and sphere are of this rig.
    pub fn has(&self, id: PairingId) -> bool {
        id.chuck < self.chucks.len() && id.sphere < self.spheres.len()
    }

    /// `A:1`.
    ///
    /// # Panics
    /// As [`Rig::pairing`].
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

fn is_tolerance(tolerance: &f64) -> bool {
    tolerance.is_finite() && *tolerance >= 0.0
}

fn check_points(end: End, points: &[NamedPoint]) -> Result<(), RigError> {
    if points.is_empty() {
        return Err(RigError::Empty(end));
    }
    for (i, NamedPoint { name, position_m, tolerance_m }) in points.iter().enumerate() {
        if points[..i].iter().any(|other| other.name == *name) {
            return Err(RigError::Duplicate { end, name: name.clone() });
        }
        if !position_m.iter().all(|x| x.is_finite()) {
            return Err(RigError::NotFinite { end, name: name.clone() });
        }
        if !tolerance_m.iter().all(is_tolerance) {
            return Err(RigError::Tolerance { end, name: name.clone() });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(positions_m: &[(&str, f64)]) -> Vec<NamedPoint> {
        positions_m.iter().map(|&(name, x_m)| NamedPoint::new(name, [x_m, 0.0, 0.0])).collect()
    }

    #[test]
    fn a_rig_has_ends_with_names_of_their_own_at_finite_places() {
        let good = || points(&[("A", 0.0), ("B", 0.1)]);
        let rig = Rig::new(good(), good(), None).unwrap();
        assert_eq!(rig.all_pairings().len(), 4);
        assert!(rig.has(PairingId { chuck: 1, sphere: 1 }) && !rig.has(PairingId { chuck: 1, sphere: 2 }));
        assert_eq!(Rig::new(good(), vec![], None), Err(RigError::Empty(End::Sphere)));
        let twice = RigError::Duplicate { end: End::Chuck, name: "A".to_owned() };
        assert_eq!(Rig::new(points(&[("A", 0.0), ("A", 0.1)]), good(), None), Err(twice));
        let nowhere = RigError::NotFinite { end: End::Sphere, name: "B".to_owned() };
        assert_eq!(Rig::new(good(), points(&[("A", 0.0), ("B", f64::NAN)]), None), Err(nowhere));
        for tolerance_m in [-1e-3, f64::NAN, f64::INFINITY] {
            let mut ends = good();
            ends[1].tolerance_m = Some(tolerance_m);
            let refused = RigError::Tolerance { end: End::Chuck, name: "B".to_owned() };
            assert_eq!(Rig::new(ends, good(), None), Err(refused));
        }
    }

    #[test]
    fn a_bar_has_a_length_and_travel() {
        let with = |bar| Rig::new(points(&[("A", 0.0)]), points(&[("1", 0.0)]), Some(bar));
        let rig = |lengths_m: &[f64], travel_m| with(Bar::new(lengths_m.to_vec(), travel_m));
        assert!(rig(&[0.46, 0.61], 0.075).is_ok());
        for (lengths_m, travel_m) in [(&[][..], 0.075), (&[0.46, 0.0], 0.075), (&[0.46], f64::NAN), (&[f64::INFINITY], 0.075)] {
            assert_eq!(rig(lengths_m, travel_m), Err(RigError::Bar));
        }
        let known = |zero_tolerances_m: &[f64], gain_tolerance| {
            let plain = Bar::new(vec![0.46, 0.61], 0.075);
            Bar { zero_tolerances_m: Some(zero_tolerances_m.to_vec()), gain_tolerance: Some(gain_tolerance), ..plain }
        };
        assert!(with(known(&[0.0, 2e-4], 0.0)).is_ok());
        for (zero_tolerances_m, gain_tolerance) in
            [(&[2e-4][..], 1e-3), (&[2e-4, -2e-4], 1e-3), (&[2e-4, f64::INFINITY], 1e-3), (&[0.0, 0.0], f64::NAN)]
        {
            assert_eq!(with(known(zero_tolerances_m, gain_tolerance)), Err(RigError::Bar));
        }
    }

    #[test]
    fn a_rod_has_the_tolerance_of_its_length() {
        let plain = Bar::new(vec![0.61, 0.46], 0.075);
        assert_eq!(plain.zero_tolerance_m(Some(0.46)), None);
        let bar = Bar { zero_tolerances_m: Some(vec![5e-4, 2e-4]), ..plain };
        let tolerances_m = [Some(0.46), Some(0.61), Some(0.5), None].map(|length_m| bar.zero_tolerance_m(length_m));
        assert_eq!(tolerances_m, [2e-4, 5e-4, 5e-4, 5e-4].map(Some));
    }
}
