//! TOML texts and the numbers in them, checked where they stand.

use serde::Deserialize;
use toml::Spanned;

use super::problem::Problem;
use super::source::{InputError, Source};

/// Reads a TOML text into its serde form.
pub(super) fn deserialize<T: for<'de> Deserialize<'de>>(source: &Source) -> Result<T, InputError> {
    toml::from_str(source.text()).map_err(|error| {
        let problem = Problem::Toml(error.message().replace('\n', ", "));
        match error.span() {
            Some(span) => InputError::at(source, span, problem),
            None => InputError::of_file(source.name(), problem),
        }
    })
}

/// A number that is finite.
pub(super) fn finite(source: &Source, field: &str, number: &Spanned<f64>) -> Result<f64, InputError> {
    checked(source, field, number, f64::is_finite, "a finite number")
}

/// A number that is finite and above zero.
pub(super) fn positive(source: &Source, field: &str, number: &Spanned<f64>) -> Result<f64, InputError> {
    checked(source, field, number, |x| x.is_finite() && x > 0.0, "a number above zero")
}

fn checked(
    source: &Source,
    field: &str,
    number: &Spanned<f64>,
    is_good: fn(f64) -> bool,
    expected: &'static str,
) -> Result<f64, InputError> {
    let found = *number.as_ref();
    if is_good(found) {
        return Ok(found);
    }
    let problem = Problem::Number { field: field.to_owned(), found: found.to_string(), expected };
    Err(InputError::at(source, number.span(), problem))
}
