//! The text that a file or a built-in holds, and what is wrong at some place in it.

use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};
use thiserror::Error;

use super::problem::Problem;

/// A named text. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Source {
    name: Arc<str>,
    text: Arc<str>,
}

impl Source {
    /// A text that comes from no file. Whatever ends its lines, here they end in `\n`.
    pub fn new(name: &str, text: &str) -> Self {
        Self { name: name.into(), text: text.replace("\r\n", "\n").replace('\r', "\n").into() }
    }

    /// Reads a file, however long: of poses, or of plans.
    ///
    /// # Errors
    /// [`Problem::Unreadable`] when it cannot be opened or is not UTF-8.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let name = path.display().to_string();
        let text =
            std::fs::read_to_string(path).map_err(|error| InputError::of_file(&name, Problem::Unreadable(error.to_string())))?;
        Ok(Self::new(&name, &text))
    }

    /// Reads a file of at most so many bytes; a longer one is not read to its end.
    ///
    /// # Errors
    /// As [`Source::read`], and [`Problem::TooLong`].
    pub fn read_at_most(path: &Path, most_bytes: u64) -> Result<Self, InputError> {
        let name = path.display().to_string();
        let mut bytes = Vec::new();
        let unreadable = |reason: String| InputError::of_file(&name, Problem::Unreadable(reason));
        let read = File::open(path).and_then(|file| file.take(most_bytes + 1).read_to_end(&mut bytes));
        read.map_err(|error| unreadable(error.to_string()))?;
        if bytes.len() as u64 > most_bytes {
            return Err(InputError::of_file(&name, Problem::TooLong { most_bytes }));
        }
        let text = std::io::read_to_string(bytes.as_slice()).map_err(|error| unreadable(error.to_string()))?;
        Ok(Self::new(&name, &text))
    }

    /// Takes a built-in of that name, or else reads the file of that name, of a mebibyte at most.
    ///
    /// # Errors
    /// [`Problem::NoSuchFile`] with the built-in names when there is neither, or as [`Source::read_at_most`].
    pub fn named_or_read(argument: &str, builtins: &[(&str, &str)], what: &'static str) -> Result<Self, InputError> {
        /// A hundred times what the longest robot or rig has.
        const MOST_BYTES: u64 = 1 << 20;
        if let Some((name, text)) = builtins.iter().find(|(name, _)| *name == argument) {
            return Ok(Self::new(&format!("{name} (built in)"), text));
        }
        let path = Path::new(argument);
        if !path.exists() {
            let names = builtins.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
            return Err(InputError::of_file(argument, Problem::NoSuchFile { what, builtins: names }));
        }
        Self::read_at_most(path, MOST_BYTES)
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
        let show = || (NamedSource::new(source.name(), as_shown(source.text())), span.clone());
        Self { place, problem: Box::new(problem), at: can_be_shown(source.text(), &span).then(|| Box::new(show())) }
    }

    /// What is wrong.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }
}

/// A text of the same length in bytes, with nothing in it that a terminal would obey.
fn as_shown(text: &str) -> String {
    let shown = |c: char| match (c, c.len_utf8()) {
        ('\n' | '\t', _) => c,
        (c, 1) if c.is_control() => '?',
        // Of the control characters of two bytes, one of two.
        (c, _) if c.is_control() => '·',
        (c, _) => c,
    };
    text.chars().map(shown).collect()
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
