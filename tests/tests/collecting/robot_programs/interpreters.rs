//! Small interpreters of the five languages. Each accepts what a program of moves may contain by the language's grammar and nothing
//! else, and carries it out on a machine that keeps account of everything.

mod fanuc;
mod judge;
mod krl;
mod machine;
mod rapid;
mod urscript;
mod val;

use std::collections::BTreeMap;

use host_cal::robot_link::program::{Dialect, ProgramFile};

pub(crate) use judge::{expected_axes, judge};
use machine::Axis;
pub(crate) use machine::{Event, Machine};

/// What an interpreter does not accept, or a judge.
pub(crate) type Complaint = String;

/// Carries a program out.
pub(crate) fn run(dialect: Dialect, files: &[ProgramFile], machine: &mut Machine) -> Result<(), Complaint> {
    match dialect {
        Dialect::Val => val::run(files, machine),
        Dialect::UrScript => urscript::run(files, machine),
        Dialect::Krl => krl::run(files, machine),
        Dialect::Rapid => rapid::run(files, machine),
        Dialect::FanucLs => fanuc::run(files, machine),
    }
}

/// What a controller that holds the files knows by name, of whatever kind; in one case, as these languages have it.
pub(crate) fn global_names(dialect: Dialect, files: &[ProgramFile]) -> Vec<String> {
    let mut names = match dialect {
        Dialect::Val => val::global_names(files),
        Dialect::UrScript => urscript::global_names(files),
        Dialect::Krl => krl::global_names(files),
        Dialect::Rapid => rapid::global_names(files),
        Dialect::FanucLs => fanuc::global_names(files),
    };
    names.extend(files.iter().map(|file| format!("file {}", file.name)));
    names.into_iter().map(|name| name.to_uppercase()).collect()
}

/// Names that stand more than once.
pub(crate) fn doubles(names: &[String]) -> Vec<String> {
    let mut counts = BTreeMap::<&String, usize>::new();
    for name in names {
        *counts.entry(name).or_default() += 1;
    }
    counts.into_iter().filter(|(_, count)| *count > 1).map(|(name, _)| name.clone()).collect()
}

fn wrong<T>(what: &str, found: &str) -> Result<T, Complaint> {
    Err(format!("{what}: `{found}`"))
}

fn number(text: &str) -> Result<f64, Complaint> {
    let digits = text.strip_prefix('-').unwrap_or(text);
    let is_plain = digits.starts_with(|c: char| c.is_ascii_digit()) && digits.chars().all(|c| c.is_ascii_digit() || c == '.');
    match text.parse() {
        Ok(value) if is_plain => Ok(value),
        _ => wrong("no plain number", text),
    }
}

fn whole(text: &str, least: usize, most: usize) -> Result<usize, Complaint> {
    match text.parse() {
        Ok(value) if (least..=most).contains(&value) && text == value.to_string() => Ok(value),
        _ => wrong("no whole number in range", text),
    }
}

fn between<'a>(text: &'a str, begin: &str, end: &str) -> Option<&'a str> {
    text.strip_prefix(begin)?.strip_suffix(end)
}

/// A variable from which a number is taken: `x-1.5`, or `x+1.5` for one below zero; the number.
fn taken_away(text: &str, variable: &str) -> Result<f64, Complaint> {
    let Some(rest) = text.strip_prefix(variable) else { return wrong("not taken from the joint", text) };
    match (rest.strip_prefix('-'), rest.strip_prefix('+')) {
        (Some(digits), _) if !digits.starts_with('-') => number(digits),
        (_, Some(digits)) if !digits.starts_with('-') => Ok(-number(digits)?),
        _ => wrong("no sign and number", rest),
    }
}

fn is_name(text: &str, most: usize) -> bool {
    text.len() <= most
        && text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// A text between quotes.
fn quoted(text: &str, most: usize) -> Result<String, Complaint> {
    match between(text, "\"", "\"") {
        Some(words) if !words.contains('"') && !words.is_empty() && words.len() <= most => Ok(words.to_owned()),
        _ => wrong("no text between quotes", text),
    }
}
