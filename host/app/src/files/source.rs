//! The text that a file or a built-in holds, and what is wrong at some place in it.

use std::io::Read;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};
use thiserror::Error;

use super::problem::Problem;
use super::{encoding, reading};
use crate::text::{one_line, visible};

/// A named text. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Source {
    name: Arc<str>,
    text: Arc<str>,
}

/// A hundred times what the longest robot or rig has.
pub(super) const MOST_TOML_BYTES: u64 = 1 << 20;
/// Of poses, plans and targets: a million rows fit in.
const MOST_ROWS_BYTES: u64 = 128 << 20;

impl Source {
    /// A text that comes from no file. Whatever ends its lines, here they end in `\n`, and no byte order mark begins it.
    pub fn new(name: &str, text: &str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        Self { name: name.into(), text: text.replace("\r\n", "\n").replace('\r', "\n").into() }
    }

    /// Reads a file of rows: of poses, of targets, or a plan; 128 MiB at most.
    ///
    /// # Errors
    /// As [`Source::read_at_most`].
    pub fn read_rows(path: &Path) -> Result<Self, InputError> {
        Self::read_at_most(path, MOST_ROWS_BYTES)
    }

    /// Reads a file of a robot or of a rig; a mebibyte at most.
    ///
    /// # Errors
    /// As [`Source::read_at_most`].
    pub fn read_toml(path: &Path) -> Result<Self, InputError> {
        Self::read_at_most(path, MOST_TOML_BYTES)
    }

    /// Reads a file of at most so many bytes; a longer one is not read to its end. UTF-8, or UTF-16 with its byte order mark.
    ///
    /// # Errors
    /// [`Problem::Unreadable`] when it cannot be opened, [`Problem::TooLong`], [`Problem::NotText`], [`Problem::ZeroByte`].
    pub fn read_at_most(path: &Path, most_bytes: u64) -> Result<Self, InputError> {
        let name = path.display().to_string();
        encoding::decode(&name, &read_bytes(&name, path, most_bytes)?, None)
    }

    /// As [`Source::read_at_most`], in the encoding that an XML document says it has.
    ///
    /// # Errors
    /// As [`Source::read_at_most`], and [`Problem::Encoding`].
    pub(super) fn read_xml(path: &Path, most_bytes: u64) -> Result<Self, InputError> {
        let name = path.display().to_string();
        let bytes = read_bytes(&name, path, most_bytes)?;
        let declared = encoding::declared(&name, &bytes)?;
        encoding::decode(&name, &bytes, declared)
    }

    /// Takes a built-in of that name, or else reads the file of that name, of a mebibyte at most.
    ///
    /// # Errors
    /// [`Problem::NoSuchFile`] with the built-in names when there is neither, or as [`Source::read_at_most`].
    pub fn named_or_read(argument: &str, builtins: &[(&str, &str)], what: &'static str) -> Result<Self, InputError> {
        if let Some((name, text)) = builtins.iter().find(|(name, _)| *name == argument) {
            return Ok(Self::new(&format!("{name} (built in)"), text));
        }
        let path = Path::new(argument);
        if !path.exists() {
            let names = builtins.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
            return Err(InputError::of_file(argument, Problem::NoSuchFile { what, builtins: names }));
        }
        Self::read_toml(path)
    }

    /// What to call it in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The whole text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Line number, from 1, of a byte.
    pub fn line_of(&self, byte: usize) -> usize {
        1 + self.text.as_bytes().iter().take(byte).filter(|&&b| b == b'\n').count()
    }
}

/// The bytes of a file, which is not read to its end when it is too long.
fn read_bytes(name: &str, path: &Path, most_bytes: u64) -> Result<Vec<u8>, InputError> {
    let refuse = |problem| InputError::of_file(name, problem);
    let read = || {
        let file = reading::open(path)?;
        let length = file.metadata()?.len();
        let mut bytes = Vec::new();
        if length <= most_bytes {
            // A device has no length, and a file may grow while it is read.
            file.take(most_bytes + 1).read_to_end(&mut bytes)?;
        }
        Ok((length, bytes))
    };
    let (length, bytes) = read().map_err(|error: std::io::Error| refuse(Problem::Unreadable(error.to_string())))?;
    let is_too_long = length > most_bytes || bytes.len() as u64 > most_bytes;
    if is_too_long { Err(refuse(Problem::TooLong { most_bytes })) } else { Ok(bytes) }
}

/// A [`Problem`] and where it is.
#[derive(Debug, Error)]
#[error("{}: {problem}", .place)]
pub struct InputError {
    place: String,
    problem: Box<Problem>,
    at: Option<Box<(NamedSource<String>, Range<usize>)>>,
}

impl InputError {
    /// A problem of a whole file.
    pub(super) fn of_file(name: &str, problem: Problem) -> Self {
        Self { place: name.to_owned(), problem: Box::new(problem), at: None }
    }

    /// A problem at some bytes of a text.
    pub(super) fn at(source: &Source, span: Range<usize>, problem: Problem) -> Self {
        let place = format!("{}:{}", source.name(), source.line_of(span.start));
        let at = can_be_shown(source.text(), &span).then(|| Box::new(shown(source, &span)));
        Self { place, problem: Box::new(problem), at }
    }

    /// What is wrong.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }
}

/// The text as a terminal may show it, and where the span then is.
fn shown(source: &Source, span: &Range<usize>) -> (NamedSource<String>, Range<usize>) {
    let text = source.text();
    let [start, end] = [span.start, span.end].map(|byte| text.floor_char_boundary(byte));
    let [before, within, after] = [&text[..start], &text[start..end], &text[end..]].map(visible);
    let shown_span = before.len()..before.len() + within.len();
    (NamedSource::new(one_line(source.name()), [before, within, after].concat()), shown_span)
}

/// Whether the lines around a span fit a screen: a file of one line a megabyte long is not to be printed.
fn can_be_shown(text: &str, span: &Range<usize>) -> bool {
    const LONGEST: usize = 2_000;
    let bytes = text.as_bytes();
    let before = bytes[..span.start.min(bytes.len())].iter().rev().take(LONGEST);
    let lines_before = before.filter(|&&b| b == b'\n').count();
    let after = bytes[span.start.min(bytes.len())..].iter().take(LONGEST);
    let lines_after = after.filter(|&&b| b == b'\n').count();
    (lines_before >= 2 || span.start < LONGEST) && (lines_after >= 2 || bytes.len() < span.start + LONGEST)
}

impl Diagnostic for InputError {
    fn help<'a>(&'a self) -> Option<Box<dyn std::fmt::Display + 'a>> {
        self.problem.help().map(|help| Box::new(help) as Box<dyn std::fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.at.as_ref().map(|at| &at.0 as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let (_, span) = self.at.as_deref()?;
        Some(Box::new(std::iter::once(LabeledSpan::underline(span.clone()))))
    }
}
