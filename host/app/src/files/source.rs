//! The text that a file or a built-in holds, and what is wrong at some place in it.

use std::ops::Range;
use std::sync::Arc;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};
use thiserror::Error;

use super::problem::Problem;
use crate::text::{one_line, visible};

/// A named text. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Source {
    name: Arc<str>,
    text: Arc<str>,
}

impl Source {
    /// A text that comes from no file. Whatever ends its lines, here they end in `\n`, and no byte order mark begins it.
    pub fn new(name: &str, text: &str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        Self { name: name.into(), text: text.replace("\r\n", "\n").replace('\r', "\n").into() }
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
