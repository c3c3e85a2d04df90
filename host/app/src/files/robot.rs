//! `robot.toml`: a robot, and when and from what it was calibrated.

use std::fmt;
use std::ops::Range;

use ballbar::{Chain, Coupling, Encoder, JointKind, JointTerms, MAX_JOINTS};
use ballbar_calib::model::{Calibration, EncoderFacts, JointLimits, Robot};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use toml::Spanned;
use toml_edit::{DocumentMut, Item, Table, value};

use super::builtin::ROBOTS;
use super::numbers::{Range as Of, deserialize, in_range, vector};
use super::problem::{Problem, short};
use super::robot_terms::{BodyToml, JointTermsToml, TermsReader, eccentricity, set_center, set_terms};
use super::source::{InputError, Source};
use crate::text::one_line;
use crate::units::{ScreenUnit, m_from_mm, tidy};

/// A robot's name is not longer: it goes to screens and into the files of others.
pub const MOST_NAME_BYTES: usize = 200;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RobotToml {
    name: Option<Spanned<String>>,
    links: Vec<LinkToml>,
    joints: Vec<Spanned<JointToml>>,
    gravity: Option<Spanned<Vec<Spanned<f64>>>>,
    payload: Option<Spanned<BodyToml>>,
    calibration: Option<Calibration>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LinkToml {
    translation_mm: Spanned<Vec<Spanned<f64>>>,
    rotation_deg: Spanned<Vec<Spanned<f64>>>,
    mass_kg: Option<Spanned<f64>>,
    center_mm: Option<Spanned<Vec<Spanned<f64>>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JointToml {
    #[serde(rename = "type")]
    kind: KindToml,
    offset_deg: Option<Spanned<f64>>,
    offset_mm: Option<Spanned<f64>>,
    scale: Spanned<f64>,
    min_deg: Option<Spanned<f64>>,
    max_deg: Option<Spanned<f64>>,
    min_mm: Option<Spanned<f64>>,
    max_mm: Option<Spanned<f64>>,
    counts_per_rev: Option<Spanned<f64>>,
    counts_per_mm: Option<Spanned<f64>>,
    counts_per_index: Option<Spanned<f64>>,
    sign: Option<Spanned<f64>>,
    coupling: Option<CouplingsToml>,
    eccentricity_deg: Option<Spanned<Vec<Spanned<f64>>>>,
    compliance_deg_per_nm: Option<Spanned<f64>>,
    compliance_mm_per_n: Option<Spanned<f64>>,
    backlash_deg: Option<Spanned<f64>>,
    backlash_mm: Option<Spanned<f64>>,
}

/// One table or a list of them.
struct CouplingsToml(Vec<CouplingToml>);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CouplingToml {
    joint: Spanned<usize>,
    ratio: Spanned<f64>,
}

impl<'de> Deserialize<'de> for CouplingsToml {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        // By hand, since serde's untagged enums lose the places of what they hold.
        deserializer.deserialize_any(CouplingsVisitor)
    }
}

struct CouplingsVisitor;

impl<'de> Visitor<'de> for CouplingsVisitor {
    type Value = CouplingsToml;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a coupling { joint = 5, ratio = 0.18 } or a list of them")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<CouplingsToml, A::Error> {
        Ok(CouplingsToml(vec![CouplingToml::deserialize(MapAccessDeserializer::new(map))?]))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<CouplingsToml, A::Error> {
        Ok(CouplingsToml(Vec::deserialize(SeqAccessDeserializer::new(seq))?))
    }
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum KindToml {
    Revolute,
    Prismatic,
}

/// Takes a built-in robot or reads a file.
///
/// # Errors
/// [`InputError`] naming the line and what is wrong there.
pub fn open_robot(argument: &str) -> Result<Robot, InputError> {
    parse_robot(&robot_source(argument)?)
}

/// The text of a built-in robot or of a file.
///
/// # Errors
/// [`InputError`] when there is neither.
pub fn robot_source(argument: &str) -> Result<Source, InputError> {
    Source::named_or_read(argument, &ROBOTS, "robot")
}

/// Reads a robot from its TOML text.
///
/// # Errors
/// As [`open_robot`].
pub fn parse_robot(source: &Source) -> Result<Robot, InputError> {
    let file: RobotToml = deserialize(source)?;
    let joints = file.joints.len();
    let of_file = |problem| InputError::of_file(source.name(), problem);
    if !(1..=MAX_JOINTS).contains(&joints) {
        return Err(of_file(Problem::JointCount { found: joints }));
    }
    if file.links.len() != joints + 1 {
        return Err(of_file(Problem::LinkCount { found: file.links.len(), expected: joints + 1, joints }));
    }

    let mut parameters = Vec::new();
    let mut kinds = Vec::new();
    let mut limits = Vec::new();
    let mut encoders = Vec::new();
    let mut terms = TermsReader::new(source);
    for (i, link) in file.links.iter().enumerate() {
        terms.link(i, &link.mass_kg, &link.center_mm)?;
        parameters.extend(vector(source, "translation_mm", &link.translation_mm)?.map(m_from_mm));
        parameters.extend(vector(source, "rotation_deg", &link.rotation_deg)?.map(f64::to_radians));
        if let Some(joint) = file.joints.get(i) {
            let reader = JointReader { source, number: i + 1, span: joint.span(), joint: joint.as_ref() };
            let (kind, offset, scale) = reader.model()?;
            kinds.push(kind);
            parameters.extend([offset, scale]);
            limits.push(reader.limits()?);
            encoders.push(reader.encoder()?);
            terms.joint(i, &reader.terms()?);
        }
    }
    let chain = Chain::new(&kinds, &parameters).map_err(|error| of_file(Problem::Toml(error.to_string())))?;
    let terms = terms.finish(&kinds, &file.gravity, &file.payload)?;
    let name = match &file.name {
        Some(name) => robot_name(source, name)?,
        None => one_line(source.name()).into_owned(),
    };
    Ok(Robot { name, source: source.name().to_owned(), chain, terms, limits, encoders, calibration: file.calibration })
}

/// A robot's text, comments and all, with other parameters, other joint terms and centres of mass where they have changed, and a `[calibration]` table.
///
/// # Errors
/// The reason why the text could not be edited.
pub fn calibrated_toml(
    source: &Source,
    chain: &Chain<f64>,
    terms: &JointTerms<f64>,
    calibration: &Calibration,
) -> Result<String, toml_edit::TomlError> {
    let written = parse_robot(source).map_or_else(|_| JointTerms::none(), |robot| robot.terms);
    let mut document: DocumentMut = source.text().parse()?;
    for i in 0..=chain.joints() {
        let Some(link) = chain.link(i) else { continue };
        let translation = link.translation_m.map(|m| ScreenUnit::Millimetre.from_si(m));
        let rotation = [link.alpha_rad, link.beta_rad, link.gamma_rad].map(f64::to_degrees);
        set_numbers(&mut document["links"][i]["translation_mm"], translation.iter().copied());
        set_numbers(&mut document["links"][i]["rotation_deg"], rotation.into_iter());
        if let Some(joint) = i.checked_sub(1) {
            set_center(&mut document["links"][i], &written.masses.links[joint], &terms.masses.links[joint]);
        }
        if let Some(joint) = chain.joint(i) {
            let unit = ScreenUnit::from(joint.kind);
            set_number(&mut document["joints"][i][&format!("offset_{}", unit.name())], unit.from_si(joint.offset));
            set_number(&mut document["joints"][i]["scale"], joint.scale);
            set_terms(&mut document["joints"][i], joint.kind, written.of_joint(i), terms.of_joint(i));
        }
    }
    document.insert("calibration", Item::Table(calibration_table(calibration)));
    let text = document.to_string();
    Ok(if text.starts_with(CALIBRATED_NOTE) { text } else { format!("{CALIBRATED_NOTE}{text}") })
}

/// A name that fits a line.
fn robot_name(source: &Source, name: &Spanned<String>) -> Result<String, InputError> {
    const SHOWN: usize = 80;
    let text = name.as_ref();
    if text.len() > MOST_NAME_BYTES || text.contains(char::is_control) {
        let problem = Problem::RobotName { found: short(text, SHOWN), bytes: text.len() };
        return Err(InputError::at(source, name.span(), problem));
    }
    Ok(text.clone())
}

/// Joint `i` of a file, being checked.
struct JointReader<'a> {
    source: &'a Source,
    number: usize,
    span: Range<usize>,
    joint: &'a JointToml,
}

impl JointReader<'_> {
    fn kind(&self) -> (JointKind, &'static str) {
        match self.joint.kind {
            KindToml::Revolute => (JointKind::Revolute, "revolute"),
            KindToml::Prismatic => (JointKind::Prismatic, "prismatic"),
        }
    }

    fn model(&self) -> Result<(JointKind, f64, f64), InputError> {
        let joint = self.joint;
        let (_, offset) = self.value("offset", ("offset_deg", &joint.offset_deg), ("offset_mm", &joint.offset_mm))?;
        let scale = in_range(self.source, "scale", &joint.scale, Of::Scale)?;
        Ok((self.kind().0, offset, scale))
    }

    fn limits(&self) -> Result<JointLimits, InputError> {
        let joint = self.joint;
        let (span, min) = self.value("min", ("min_deg", &joint.min_deg), ("min_mm", &joint.min_mm))?;
        let (_, max) = self.value("max", ("max_deg", &joint.max_deg), ("max_mm", &joint.max_mm))?;
        if min >= max {
            let unit = ScreenUnit::from(self.kind().0);
            let problem = Problem::Limits { joint: self.number, min: tidy(unit.from_si(min)), max: tidy(unit.from_si(max)) };
            return Err(InputError::at(self.source, span, problem));
        }
        Ok(JointLimits { min, max })
    }

    fn encoder(&self) -> Result<EncoderFacts, InputError> {
        let joint = self.joint;
        let ((own_key, own), (_, other)) =
            self.by_kind(("counts_per_rev", &joint.counts_per_rev), ("counts_per_mm", &joint.counts_per_mm));
        if let Some(other) = other {
            return Err(self.wrong_unit(other.span(), "counts_per_rev", "counts_per_mm"));
        }
        let counts = own.as_ref().map(|counts| in_range(self.source, own_key, counts, Of::Counts)).transpose()?;
        let unit_si = match self.kind().0 {
            JointKind::Revolute => std::f64::consts::TAU,
            JointKind::Prismatic => m_from_mm(1.0),
        };
        let counts_per_index = match &self.joint.counts_per_index {
            Some(counts) => in_range(self.source, "counts_per_index", counts, Of::IndexCounts)? as u32,
            None => 0,
        };
        let sign = if self.rises()? { 1.0 } else { -1.0 };
        Ok(EncoderFacts {
            encoder: counts.map(|counts| Encoder { counts_per_unit: sign * counts / unit_si, counts_per_index }),
            couplings: self.couplings()?,
        })
    }

    /// Coefficients of the joint's terms in SI, and where they stand.
    fn terms(&self) -> Result<JointTermsToml, InputError> {
        let joint = self.joint;
        let ((compliance_key, compliance), (_, other)) = self.by_kind(
            ("compliance_deg_per_nm", &joint.compliance_deg_per_nm),
            ("compliance_mm_per_n", &joint.compliance_mm_per_n),
        );
        let ((backlash_key, backlash), (_, other_backlash)) =
            self.by_kind(("backlash_deg", &joint.backlash_deg), ("backlash_mm", &joint.backlash_mm));
        if let Some(other) = other {
            return Err(self.wrong_unit(other.span(), "compliance_deg_per_nm", "compliance_mm_per_n"));
        }
        if let Some(other) = other_backlash {
            return Err(self.wrong_unit(other.span(), "backlash_deg", "backlash_mm"));
        }
        let unit = ScreenUnit::from(self.kind().0);
        let si = |key, number: &Option<Spanned<f64>>| match number {
            Some(number) => {
                in_range(self.source, key, number, Of::Plausible).map(|value| Some((unit.to_si(value), number.span())))
            }
            None => Ok(None),
        };
        Ok(JointTermsToml {
            eccentricity_rad: joint.eccentricity_deg.as_ref().map(|list| eccentricity(self.source, list)).transpose()?,
            compliance: si(compliance_key, compliance)?,
            backlash: si(backlash_key, backlash)?,
        })
    }

    fn rises(&self) -> Result<bool, InputError> {
        let Some(sign) = &self.joint.sign else { return Ok(true) };
        match *sign.as_ref() {
            1.0 => Ok(true),
            -1.0 => Ok(false),
            found => {
                let problem = Problem::Number { field: "sign".into(), found: found.to_string(), expected: "1 or -1" };
                Err(InputError::at(self.source, sign.span(), problem))
            }
        }
    }

    fn couplings(&self) -> Result<Vec<Coupling<f64>>, InputError> {
        let list = self.joint.coupling.as_ref().map_or(&[][..], |couplings| &couplings.0);
        let mut couplings: Vec<Coupling<f64>> = Vec::new();
        for CouplingToml { joint, ratio } in list {
            let to = *joint.as_ref();
            let is_nearer = (1..self.number).contains(&to);
            if !is_nearer || couplings.iter().any(|other| usize::from(other.driven_by) == to - 1) {
                return Err(InputError::at(self.source, joint.span(), Problem::Coupling { joint: self.number, to }));
            }
            let ratio = in_range(self.source, "ratio", ratio, Of::Plausible)?;
            couplings.push(Coupling { joint: (self.number - 1) as u8, driven_by: (to - 1) as u8, ratio });
        }
        Ok(couplings)
    }

    /// The value of a key that has one name for angles and one for slides, in SI, and its place in the text.
    fn value(&self, stem: &str, deg: Key<'_>, mm: Key<'_>) -> Result<(Range<usize>, f64), InputError> {
        let ((own_key, own), (_, other)) = self.by_kind(deg, mm);
        if let Some(other) = other {
            return Err(self.wrong_unit(other.span(), deg.0, mm.0));
        }
        let unit = ScreenUnit::from(self.kind().0);
        let Some(own) = own else {
            let key = format!("{stem}_{}", unit.name());
            return Err(InputError::at(self.source, self.span.clone(), Problem::JointKeyMissing { joint: self.number, key }));
        };
        Ok((own.span(), unit.to_si(in_range(self.source, own_key, own, Of::Plausible)?)))
    }

    /// The key that fits this joint, then the one that does not.
    fn by_kind<'k>(&self, angle: Key<'k>, slide: Key<'k>) -> (Key<'k>, Key<'k>) {
        match self.kind().0 {
            JointKind::Revolute => (angle, slide),
            JointKind::Prismatic => (slide, angle),
        }
    }

    fn wrong_unit(&self, span: Range<usize>, deg_key: &'static str, mm_key: &'static str) -> InputError {
        let (kind, name) = self.kind();
        let (expected, key) = match kind {
            JointKind::Revolute => (deg_key, mm_key),
            JointKind::Prismatic => (mm_key, deg_key),
        };
        InputError::at(self.source, span, Problem::JointUnit { key, kind: name, expected: expected.to_owned() })
    }
}

/// A key of the file and what stands there.
type Key<'a> = (&'static str, &'a Option<Spanned<f64>>);

/// Replaces a number and keeps the comment behind it.
pub(super) fn set_number(item: &mut Item, number: f64) {
    let decor = item.as_value().map(|old| old.decor().clone());
    *item = value(number);
    if let (Some(new), Some(decor)) = (item.as_value_mut(), decor) {
        *new.decor_mut() = decor;
    }
}

pub(super) fn set_numbers(item: &mut Item, numbers: impl Iterator<Item = f64>) {
    if let Some(array) = item.as_array_mut() {
        for (i, number) in numbers.enumerate() {
            array.replace(i, number);
        }
    }
}

/// Stands at the top of a calibrated robot's file.
const CALIBRATED_NOTE: &str =
    "# CALIBRATED: links and joints hold fitted parameters; comments are the design's. See [calibration] at the end.\n#\n";

fn calibration_table(calibration: &Calibration) -> Table {
    let mut table = Table::new();
    table
        .decor_mut()
        .set_prefix("\n# The links and joints of this file hold fitted parameters; comments beside them are the design's.\n");
    table.insert("when", value(&calibration.when));
    table.insert("by", value(&calibration.by));
    if let Some(verdict) = calibration.verdict {
        table.insert("verdict", value(verdict.name()));
    }
    if !calibration.reasons.is_empty() {
        table.insert("reasons", value(calibration.reasons.iter().collect::<toml_edit::Array>()));
    }
    table.insert("from_robot", value(&calibration.from_robot));
    table.insert("from_poses", value(calibration.from_poses.iter().collect::<toml_edit::Array>()));
    table.insert("poses", value(calibration.poses as i64));
    table.insert("free_parameters", value(calibration.free_parameters as i64));
    table.insert("rms_initial_mm", value(calibration.rms_initial_mm));
    table.insert("rms_mm", value(calibration.rms_mm));
    if let Some(rms_mm) = calibration.held_out_rms_mm {
        table.insert("held_out_rms_mm", value(rms_mm));
    }
    table
}
