//! URDF files, the robot descriptions of ROS: reading the chain between two links of one.
//!
//! The writer of such a file may be hostile. The file is bounded before it is read, XML is read without document types, so that no
//! entity is ever expanded, elements are bounded in number, names in length, and the tree is proved to be one before it is walked.

mod chain;
mod elements;
mod tree;

use std::path::Path;

use roxmltree::{Document, ParsingOptions};

use super::problem::Problem;
use super::source::{InputError, Source};
use ballbar_calib::model::Robot;

/// Our own element within a URDF joint, `<ballbar_encoder offset="…" scale="…"/>`: what URDF has no place for. Readers that do not
/// know it pass over it.
pub const ENCODER_ELEMENT: &str = "ballbar_encoder";

/// Far more than the largest published descriptions have.
const MOST_BYTES: u64 = 8 << 20;
const MOST_NODES: u32 = 200_000;
/// The parser compares every attribute of an element with all others, and carries every namespace on to all elements within.
const MOST_ATTRIBUTES: usize = 200;
const MOST_NAMESPACES: usize = 100;

/// Names of the links that the chain begins and ends with; the root and the only end of the tree when not given.
#[derive(Clone, Copy, Debug, Default)]
pub struct UrdfEnds<'a> {
    /// The base link.
    pub base: Option<&'a str>,
    /// The tool link.
    pub tip: Option<&'a str>,
}

/// A chain taken from a URDF.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The robot.
    pub robot: Robot,
    /// Its `robot.toml`.
    pub toml: String,
    /// The link that the chain begins with.
    pub base: String,
    /// The link that it ends with.
    pub tip: String,
    /// Names of the joints that move, from the base.
    pub joints: Vec<String>,
    /// What a user should know of it.
    pub remarks: Vec<String>,
}

/// Reads the chain between two links of a URDF file.
///
/// # Errors
/// [`InputError`] naming the line and what is wrong there.
pub fn read_urdf(path: &Path, ends: UrdfEnds<'_>) -> Result<Imported, InputError> {
    parse_urdf(&Source::read_xml(path, MOST_BYTES)?, ends)
}

/// Takes the chain between two links from the text of a URDF.
///
/// # Errors
/// As [`read_urdf`].
pub fn parse_urdf(source: &Source, ends: UrdfEnds<'_>) -> Result<Imported, InputError> {
    check_is_bounded(source)?;
    let options = ParsingOptions { allow_dtd: false, nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(source.text(), options).map_err(|error| {
        let at = error.pos();
        let problem = Problem::Xml(elements::short(&error.to_string()));
        InputError::at(source, byte_of(source.text(), at.row as usize, at.col as usize), problem)
    })?;
    let robot = elements::read(source, &document)?;
    let path = tree::path(source, &robot, ends)?;
    chain::imported(source, &robot, &path)
}

/// Refuses what would take the parser more than a moment.
fn check_is_bounded(source: &Source) -> Result<(), InputError> {
    let refuse = |at: usize, what: String| Err(InputError::at(source, at..at + 1, Problem::Xml(what)));
    let (text, mut at, mut namespaces) = (source.text(), 0, 0);
    while let Some(open) = text[at..].find('<').map(|further| at + further) {
        let rest = &text[open..];
        let behind = |end: &str| rest.find(end).map_or(rest.len(), |found| found + end.len());
        let length = match rest {
            _ if rest.starts_with("<!--") => behind("-->"),
            _ if rest.starts_with("<![CDATA[") => behind("]]>"),
            _ if rest.starts_with("<?") => behind("?>"),
            _ => {
                let (length, attributes) = tag(rest);
                if attributes > MOST_ATTRIBUTES {
                    return refuse(open, format!("an element with more than {MOST_ATTRIBUTES} attributes"));
                }
                namespaces += rest[..length].matches("xmlns").count();
                if namespaces > MOST_NAMESPACES {
                    return refuse(open, format!("more than {MOST_NAMESPACES} namespaces"));
                }
                length
            }
        };
        at = open + length;
    }
    Ok(())
}

/// Length of the tag that a text begins with, and how many quoted values it has.
fn tag(text: &str) -> (usize, usize) {
    let (mut quote, mut values) = (None, 0);
    for (i, byte) in text.bytes().enumerate() {
        match (quote, byte) {
            (None, b'>') => return (i + 1, values),
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(open), _) if open == byte => {
                quote = None;
                values += 1;
            }
            _ => {}
        }
    }
    (text.len(), values)
}

/// The character at a row and column, both from 1.
fn byte_of(text: &str, row: usize, column: usize) -> std::ops::Range<usize> {
    let line_start: usize = text.split_inclusive('\n').take(row.saturating_sub(1)).map(str::len).sum();
    let line = &text[line_start..];
    let within: usize = line.chars().take(column.saturating_sub(1)).map(char::len_utf8).sum();
    let start = line_start + within;
    start..start + text[start..].chars().next().map_or(0, char::len_utf8)
}
