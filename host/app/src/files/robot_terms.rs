//! Joint terms and masses of a `robot.toml`.

use std::ops::Range;

use ballbar::{Body, JointKind, JointTerms, MAX_JOINTS, STANDARD_GRAVITY_M_S2, TERMS_PER_JOINT, TermKind, TermsError, Vector3};
use serde::Deserialize;
use toml::Spanned;
use toml_edit::{Array, Item};

use super::numbers::{Range as Of, in_range, vector};
use super::problem::Problem;
use super::robot::{set_number, set_numbers};
use super::source::{InputError, Source};
use crate::units::{ScreenUnit, m_from_mm};

/// A payload.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BodyToml {
    mass_kg: Spanned<f64>,
    center_mm: Spanned<Vec<Spanned<f64>>>,
}

/// Of one joint, in SI, each with its place in the text.
pub(super) struct JointTermsToml {
    pub(super) eccentricity_rad: Option<([f64; 4], Range<usize>)>,
    pub(super) compliance: Option<(f64, Range<usize>)>,
    pub(super) backlash: Option<(f64, Range<usize>)>,
}

/// The coefficients of sin q, cos q, sin 2q and cos 2q, radians.
pub(super) fn eccentricity(source: &Source, list: &Spanned<Vec<Spanned<f64>>>) -> Result<([f64; 4], Range<usize>), InputError> {
    let [a, b, c, d] = list.as_ref().as_slice() else {
        return Err(InputError::at(source, list.span(), Problem::Eccentricity { found: list.as_ref().len() }));
    };
    let rad = |number| in_range(source, "eccentricity_deg", number, Of::Plausible).map(f64::to_radians);
    Ok(([rad(a)?, rad(b)?, rad(c)?, rad(d)?], list.span()))
}

/// Gathers the terms of a file, and checks them when all are there.
pub(super) struct TermsReader<'a> {
    source: &'a Source,
    terms: JointTerms<f64>,
    /// Where each coefficient stands.
    places: [[Option<Range<usize>>; TERMS_PER_JOINT]; MAX_JOINTS],
    /// Where the mass behind each joint stands, and the payload's.
    masses: [Option<Range<usize>>; MAX_JOINTS + 1],
}

impl<'a> TermsReader<'a> {
    pub(super) fn new(source: &'a Source) -> Self {
        Self { source, terms: JointTerms::none(), places: Default::default(), masses: Default::default() }
    }

    /// Link `i`, from 0. The first stands still: what it weighs loads no joint.
    pub(super) fn link(
        &mut self,
        i: usize,
        mass_kg: &Option<Spanned<f64>>,
        center_mm: &Option<Spanned<Vec<Spanned<f64>>>>,
    ) -> Result<(), InputError> {
        let half = |span, found, missing| Err(InputError::at(self.source, span, Problem::HalfABody { found, missing }));
        let (mass, center) = match (mass_kg, center_mm) {
            (None, None) => return Ok(()),
            (Some(mass), None) => return half(mass.span(), "mass_kg", "center_mm"),
            (None, Some(center)) => return half(center.span(), "center_mm", "mass_kg"),
            (Some(mass), Some(center)) => (mass, center),
        };
        let body = body(self.source, mass, center)?;
        if let Some(joint) = i.checked_sub(1) {
            self.terms.masses.links[joint] = body;
            self.masses[joint] = Some(mass.span());
        }
        Ok(())
    }

    /// Joint `i`, from 0.
    pub(super) fn joint(&mut self, i: usize, joint: &JointTermsToml) {
        const ECCENTRICITY: [TermKind; 4] = [TermKind::SinQ, TermKind::CosQ, TermKind::Sin2Q, TermKind::Cos2Q];
        let mut set = |term, value, span: &Range<usize>| {
            self.terms.set_coefficient(i, term, value);
            self.places[i][term as usize] = Some(span.clone());
        };
        if let Some((values, span)) = &joint.eccentricity_rad {
            ECCENTRICITY.into_iter().zip(values).for_each(|(term, value)| set(term, *value, span));
        }
        if let Some((value, span)) = &joint.compliance {
            set(TermKind::Compliance, *value, span);
        }
        if let Some((value, span)) = &joint.backlash {
            set(TermKind::Backlash, *value, span);
        }
    }

    /// The terms, with what the whole file says of gravity and payload.
    pub(super) fn finish(
        mut self,
        kinds: &[JointKind],
        gravity: &Option<Spanned<Vec<Spanned<f64>>>>,
        payload: &Option<Spanned<BodyToml>>,
    ) -> Result<JointTerms<f64>, InputError> {
        if let Some(gravity) = gravity {
            let direction = Vector3::from(vector(self.source, "gravity", gravity)?).try_normalize(0.0);
            let direction = direction.ok_or_else(|| InputError::at(self.source, gravity.span(), Problem::NoGravity))?;
            self.terms.masses.gravity_base_m_s2 = direction * STANDARD_GRAVITY_M_S2;
        }
        if let Some(payload) = payload {
            self.terms.masses.payload = body(self.source, &payload.as_ref().mass_kg, &payload.as_ref().center_mm)?;
            self.masses[kinds.len()] = Some(payload.span());
        }
        match self.terms.check(kinds) {
            Ok(()) => Ok(self.terms),
            Err(error) => Err(match self.place_of(error) {
                Some(span) => InputError::at(self.source, span, Problem::Terms(error)),
                None => InputError::of_file(self.source.name(), Problem::Terms(error)),
            }),
        }
    }

    fn place_of(&self, error: TermsError) -> Option<Range<usize>> {
        let term = |joint: u8, term: TermKind| self.places.get(usize::from(joint))?[term as usize].clone();
        match error {
            TermsError::Size { joint, term: kind } => term(joint, kind),
            TermsError::EccentricSlide { joint } => term(joint, TermKind::SinQ),
            TermsError::NoLoad { joint } => term(joint, TermKind::Compliance),
            TermsError::Mass { joint } => self.masses.get(usize::from(joint))?.clone(),
            _ => None,
        }
    }
}

fn body(source: &Source, mass_kg: &Spanned<f64>, center_mm: &Spanned<Vec<Spanned<f64>>>) -> Result<Body<f64>, InputError> {
    Ok(Body {
        mass_kg: in_range(source, "mass_kg", mass_kg, Of::Mass)?,
        center_m: Vector3::from(vector(source, "center_mm", center_mm)?.map(m_from_mm)),
    })
}

/// Writes a link's centre of mass where it has moved by more than anybody knows of one: what is nearer keeps its digits.
pub(super) fn set_center(link: &mut Item, before: &Body<f64>, now: &Body<f64>) {
    const NEAR_M: f64 = 1e-4;
    if before.mass_kg > 0.0 && (before.center_m - now.center_m).norm() > NEAR_M {
        let mm = now.center_m.map(|m| ScreenUnit::Millimetre.from_si(m));
        set_numbers(&mut link["center_mm"], mm.iter().copied());
    }
}

/// Writes the terms of a joint where they are not those that its text holds already.
pub(super) fn set_terms(joint: &mut Item, kind: JointKind, before: [f64; TERMS_PER_JOINT], now: [f64; TERMS_PER_JOINT]) {
    let unit = ScreenUnit::from(kind);
    let [s1, c1, s2, c2, compliance, backlash] = now;
    if before[..4] != now[..4] {
        let numbers = [s1, c1, s2, c2].map(f64::to_degrees);
        joint["eccentricity_deg"] = toml_edit::value(numbers.into_iter().collect::<Array>());
    }
    let compliance_key = match kind {
        JointKind::Revolute => "compliance_deg_per_nm",
        JointKind::Prismatic => "compliance_mm_per_n",
    };
    let numbers = [(compliance_key.to_owned(), 4, compliance), (format!("backlash_{}", unit.name()), 5, backlash)];
    for (key, term, value) in numbers {
        if before[term] != value {
            set_number(&mut joint[&key], unit.from_si(value));
        }
    }
}
