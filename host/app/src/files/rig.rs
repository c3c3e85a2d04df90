//! `rig.toml`: chucks on the table, spheres on the tool, the bar.

use ballbar::Vector3;
use ballbar_calib::model::{Bar, NamedPoint, Rig};
use serde::Deserialize;
use toml::Spanned;
use toml_edit::DocumentMut;

use super::builtin::RIGS;
use super::edit::set_numbers;
use super::numbers::{OneOrList, Range, deserialize, in_range, tolerance, vector};
use super::problem::Problem;
use super::solids::SolidsToml;
use super::source::{InputError, Source};
use crate::units::{m_from_mm, mm_from_m};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RigToml {
    /// Of all chucks and spheres that say nothing else.
    tolerance_mm: Option<Spanned<f64>>,
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
    tolerance_mm: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BarToml {
    lengths_mm: Spanned<Vec<Spanned<f64>>>,
    travel_mm: Spanned<f64>,
    zero_tolerance_mm: Option<Spanned<OneOrList>>,
    gain_tolerance: Option<Spanned<f64>>,
}

/// Takes a built-in rig or reads a file.
///
/// # Errors
/// [`InputError`] naming the line and what is wrong there.
pub fn open_rig(argument: &str) -> Result<Rig, InputError> {
    parse_rig(&rig_source(argument)?)
}

/// The text of a built-in rig or of a file.
///
/// # Errors
/// [`InputError`] when there is neither.
pub fn rig_source(argument: &str) -> Result<Source, InputError> {
    Source::named_or_read(argument, &RIGS, "rig")
}

/// A rig's text, comments and all, with its chucks and spheres where they were found to be.
///
/// # Errors
/// The reason why the text could not be edited.
pub fn fitted_rig_toml(source: &Source, rig: &Rig) -> Result<String, toml_edit::TomlError> {
    let mut document: DocumentMut = source.text().parse()?;
    for (key, points) in [("chucks", &rig.chucks), ("spheres", &rig.spheres)] {
        for (i, point) in points.iter().enumerate() {
            set_numbers(&mut document[key][i]["position_mm"], point.position_m.iter().map(|&m| mm_from_m(m)));
        }
    }
    Ok(document.to_string())
}

/// Reads a rig from its TOML text.
///
/// # Errors
/// As [`open_rig`].
pub fn parse_rig(source: &Source) -> Result<Rig, InputError> {
    let file: RigToml = deserialize(source)?;
    let tolerance_m = tolerance_m(source, file.tolerance_mm.as_ref())?;
    Ok(Rig {
        chucks: points(source, "chuck", &file.chucks, tolerance_m)?,
        spheres: points(source, "sphere", &file.spheres, tolerance_m)?,
        bar: file.bar.map(|bar| read_bar(source, &bar)).transpose()?,
        solids: file.solids.read(source)?,
    })
}

fn points(
    source: &Source,
    what: &'static str,
    points: &[PointToml],
    usual_tolerance_m: Option<f64>,
) -> Result<Vec<NamedPoint>, InputError> {
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
        let tolerance_m = tolerance_m(source, point.tolerance_mm.as_ref())?.or(usual_tolerance_m);
        named.push(NamedPoint { name: name.clone(), position_m, tolerance_m });
    }
    Ok(named)
}

fn tolerance_m(source: &Source, tolerance_mm: Option<&Spanned<f64>>) -> Result<Option<f64>, InputError> {
    tolerance_mm.map(|mm| tolerance(source, "tolerance_mm", mm, Range::Tolerance).map(m_from_mm)).transpose()
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
    let gain = |part| tolerance(source, "gain_tolerance", part, Range::PartTolerance);
    Ok(Bar {
        lengths_m: lengths.collect::<Result<_, _>>()?,
        travel_m: m_from_mm(in_range(source, "travel_mm", &bar.travel_mm, Range::Positive)?),
        zero_tolerances_m: bar.zero_tolerance_mm.as_ref().map(|mm| zero_tolerances_m(source, bar, mm)).transpose()?,
        gain_tolerance: bar.gain_tolerance.as_ref().map(gain).transpose()?,
    })
}

/// One for each length, also where the file says it once for all.
fn zero_tolerances_m(source: &Source, bar: &BarToml, mm: &Spanned<OneOrList>) -> Result<Vec<f64>, InputError> {
    let lengths = bar.lengths_mm.as_ref().len();
    let metres = |mm: &Spanned<f64>| tolerance(source, "zero_tolerance_mm", mm, Range::Tolerance).map(m_from_mm);
    match mm.as_ref() {
        OneOrList::One(number) => Ok(vec![metres(&Spanned::new(mm.span(), *number))?; lengths]),
        OneOrList::List(list) if list.len() == lengths => list.iter().map(metres).collect(),
        OneOrList::List(list) => Err(InputError::at(source, mm.span(), Problem::RodTolerances { found: list.len(), lengths })),
    }
}
