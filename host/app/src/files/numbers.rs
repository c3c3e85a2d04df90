//! TOML texts and the numbers in them, checked where they stand.

use std::fmt;

use serde::de::value::SeqAccessDeserializer;
use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use toml::Spanned;

use super::problem::{Problem, short};
use super::source::{InputError, Source};

/// Reads a TOML text into its serde form.
pub(super) fn deserialize<T: for<'de> Deserialize<'de>>(source: &Source) -> Result<T, InputError> {
    /// A key of the file may be in it.
    const SHOWN: usize = 500;
    toml::from_str(source.text()).map_err(|error| {
        let problem = Problem::Toml(short(&error.message().replace('\n', ", "), SHOWN));
        match error.span() {
            Some(span) => InputError::at(source, span, problem),
            None => InputError::of_file(source.name(), problem),
        }
    })
}

/// A number for all of some things, or a list of one for each.
pub(super) enum OneOrList {
    One(f64),
    List(Vec<Spanned<f64>>),
}

impl<'de> Deserialize<'de> for OneOrList {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        // By hand, since serde's untagged enums lose the places of what they hold.
        deserializer.deserialize_any(OneOrListVisitor)
    }
}

struct OneOrListVisitor;

impl<'de> Visitor<'de> for OneOrListVisitor {
    type Value = OneOrList;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number or a list of numbers")
    }

    fn visit_f64<E>(self, number: f64) -> Result<OneOrList, E> {
        Ok(OneOrList::One(number))
    }

    fn visit_i64<E>(self, number: i64) -> Result<OneOrList, E> {
        Ok(OneOrList::One(number as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<OneOrList, A::Error> {
        Ok(OneOrList::List(Vec::deserialize(SeqAccessDeserializer::new(seq))?))
    }
}

/// What a number of a file may be.
#[derive(Clone, Copy, Debug)]
pub(super) enum Range {
    /// Any that a length in millimetres or an angle in degrees can be: a million at most, so that squares stay far from the
    /// ends of what a number can hold.
    Plausible,
    /// Plausible and above zero.
    Positive,
    /// A standard deviation in millimetres: a nanometre to a kilometre.
    Deviation,
    /// A standard deviation in millimetres or degrees, or zero.
    Tolerance,
    /// A standard deviation of a part, such as a scale's, or zero.
    PartTolerance,
    /// A mass in kilograms.
    Mass,
    /// A joint's scale.
    Scale,
    /// Encoder counts per turn or millimetre.
    Counts,
    /// Encoder counts from one index pulse to the next.
    IndexCounts,
    /// Finite.
    Finite,
}

impl Range {
    /// Whether a number is in it. No range has infinities or what is not a number.
    pub(super) fn contains(self, x: f64) -> bool {
        const MOST: f64 = 1e6;
        match self {
            Self::Plausible => x.abs() <= MOST,
            Self::Positive => x > 0.0 && x <= MOST,
            Self::Deviation => (1e-6..=MOST).contains(&x),
            Self::Tolerance => x == 0.0 || Self::Deviation.contains(x),
            Self::PartTolerance => x == 0.0 || (1e-9..=1e3).contains(&x),
            Self::Mass => (0.0..=1e5).contains(&x),
            Self::Scale => (1e-3..=1e3).contains(&x.abs()),
            Self::Counts => x > 0.0 && x <= 1e12,
            Self::IndexCounts => (16.0..=1e6).contains(&x) && x.fract() == 0.0,
            Self::Finite => x.is_finite(),
        }
    }

    /// The range in words.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Plausible => "a number from -1e6 to 1e6",
            Self::Positive => "a number above 0, at most 1e6",
            Self::Deviation => "a number from 1e-6 to 1e6",
            Self::Tolerance => "0, or a number from 1e-6 to 1e6",
            Self::PartTolerance => "0, or a number from 1e-9 to 1e3",
            Self::Mass => "a number from 0 to 1e5",
            Self::Scale => "a number of size 0.001 to 1000",
            Self::Counts => "a number above 0, at most 1e12",
            Self::IndexCounts => "a whole number from 16 to 1e6",
            Self::Finite => "a finite number",
        }
    }
}

/// A vector of three plausible numbers.
pub(super) fn vector(source: &Source, field: &'static str, numbers: &Spanned<Vec<Spanned<f64>>>) -> Result<[f64; 3], InputError> {
    let [x, y, z] = numbers.as_ref().as_slice() else {
        let problem = Problem::VectorLength { field, found: numbers.as_ref().len() };
        return Err(InputError::at(source, numbers.span(), problem));
    };
    let number = |component| in_range(source, field, component, Range::Plausible);
    Ok([number(x)?, number(y)?, number(z)?])
}

/// A number in a range.
pub(super) fn in_range(source: &Source, field: &str, number: &Spanned<f64>, range: Range) -> Result<f64, InputError> {
    let found = *number.as_ref();
    if range.contains(found) {
        return Ok(found);
    }
    let problem = Problem::Number { field: field.to_owned(), found: found.to_string(), expected: range.words() };
    Err(InputError::at(source, number.span(), problem))
}

/// A tolerance in a range of tolerances.
pub(super) fn tolerance(source: &Source, field: &'static str, number: &Spanned<f64>, range: Range) -> Result<f64, InputError> {
    let found = *number.as_ref();
    if range.contains(found) {
        // Zero with a minus before it is zero.
        return Ok(found.abs());
    }
    let problem = Problem::Tolerance { field, found: found.to_string(), expected: range.words() };
    Err(InputError::at(source, number.span(), problem))
}
