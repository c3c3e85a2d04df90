//! `rig.toml`: chucks on the table, spheres on the tool, the bar.

use ballbar::{Pairing, Vector3};
use serde::Deserialize;
use toml::Spanned;

use super::builtin::RIGS;
use super::numbers::{Range, deserialize, in_range, vector};
use super::problem::Problem;
use super::solids::{Solids, SolidsToml};
use super::source::{InputError, Source};
use crate::units::m_from_mm;

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
    /// The bar, where the file describes it.
    pub bar: Option<Bar>,
    /// Sizes of what must not meet, for planning.
    pub solids: Solids,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RigToml {
    chucks: Vec<PointToml>,
    spheres: Vec<PointToml>,
    bar: Option<BarToml>,
    #[serde(default)]
    solids: SolidsToml,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PointToml {
    name: Spanned<String>,
    position_mm: Spanned<Vec<Spanned<f64>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BarToml {
    lengths_mm: Spanned<Vec<Spanned<f64>>>,
    travel_mm: Spanned<f64>,
}

impl Rig {
    /// Takes a built-in rig or reads a file.
    ///
    /// # Errors
    /// [`InputError`] naming the line and what is wrong there.
    pub fn open(argument: &str) -> Result<Self, InputError> {
        Self::parse(&Source::named_or_read(argument, &RIGS, "rig")?)
    }

    /// Reads a rig from its TOML text.
    ///
    /// # Errors
    /// As [`Rig::open`].
    pub fn parse(source: &Source) -> Result<Self, InputError> {
        let file: RigToml = deserialize(source)?;
        Ok(Self {
            chucks: points(source, "chuck", &file.chucks)?,
            spheres: points(source, "sphere", &file.spheres)?,
            bar: file.bar.map(|bar| read_bar(source, &bar)).transpose()?,
            solids: file.solids.read(source)?,
        })
    }

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

fn points(source: &Source, what: &'static str, points: &[PointToml]) -> Result<Vec<NamedPoint>, InputError> {
    if points.is_empty() {
        return Err(InputError::of_file(source.name(), Problem::Empty(what)));
    }
    check_count(source, if what == "chuck" { "chucks" } else { "spheres" }, points.len())?;
    let mut named: Vec<NamedPoint> = Vec::new();
    for point in points {
        let name = point.name.as_ref();
        let refuse = |problem| Err(InputError::at(source, point.name.span(), problem));
        if name.is_empty() || name.trim() != name || name.contains([',', ':', '#', '"']) || name.contains(char::is_control) {
            return refuse(Problem::Name(name.clone()));
        }
        if named.iter().any(|other| other.name == *name) {
            return refuse(Problem::Duplicate { what, name: name.clone() });
        }
        let position_m = Vector3::from(vector(source, "position_mm", &point.position_mm)?.map(m_from_mm));
        named.push(NamedPoint { name: name.clone(), position_m });
    }
    Ok(named)
}

/// Every chuck is paired with every sphere, and every length with both: what is searched and told grows with their product.
fn check_count(source: &Source, what: &'static str, found: usize) -> Result<(), InputError> {
    const MOST: usize = 100;
    if found <= MOST { Ok(()) } else { Err(InputError::of_file(source.name(), Problem::TooMany { what, found, most: MOST })) }
}

fn read_bar(source: &Source, bar: &BarToml) -> Result<Bar, InputError> {
    check_count(source, "bar lengths", bar.lengths_mm.as_ref().len())?;
    if bar.lengths_mm.as_ref().is_empty() {
        return Err(InputError::at(source, bar.lengths_mm.span(), Problem::NoBarLength));
    }
    let lengths =
        bar.lengths_mm.as_ref().iter().map(|length| in_range(source, "lengths_mm", length, Range::Positive).map(m_from_mm));
    Ok(Bar {
        lengths_m: lengths.collect::<Result<_, _>>()?,
        travel_m: m_from_mm(in_range(source, "travel_mm", &bar.travel_mm, Range::Positive)?),
    })
}
