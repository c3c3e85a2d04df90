//! The one way of text to stdout and stderr. Nothing from outside reaches a terminal but through here, so that no name and no path moves
//! its cursor, and no message can forget it; the crate's other code has no access to the streams (`clippy.toml`).
#![expect(clippy::disallowed_methods, reason = "the streams are taken here, and handed to nobody")]

use std::error::Error;
use std::fmt;
use std::io::{IsTerminal, Result as IoResult, Stderr, Write, stderr, stdout};

use miette::{Diagnostic, LabeledSpan, Report, Severity, SourceCode};

use crate::text::{one_line, visible};

/// Prints a result for people.
pub(crate) fn print_text(text: &str) -> IoResult<()> {
    print_raw(&visible(text))
}

/// Prints the text of a file for programs: as it is, unless a terminal shows it.
pub(crate) fn print_document(text: &str) -> IoResult<()> {
    if stdout().is_terminal() { print_text(text) } else { print_raw(text) }
}

fn print_raw(text: &str) -> IoResult<()> {
    match stdout().write_all(text.as_bytes()).and_then(|()| stdout().flush()) {
        // A reader that has seen enough, like `head`, is no failure.
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}

/// Says something on stderr that is no result; one line. Without a stderr nobody is there to be told.
pub(crate) fn tell(line: &str) {
    let _ = writeln!(stderr(), "{}", one_line(line));
}

/// Asks something on stderr, and leaves the cursor behind it.
pub(crate) fn ask(words: &str) {
    let _ = write!(stderr(), "{}", one_line(words));
}

/// Says something that is no result and no error.
pub(crate) fn warn(message: &str) {
    tell(&format!("warning: {message}"));
}

/// Whether stderr is a terminal.
pub(crate) fn is_seen() -> bool {
    stderr().is_terminal()
}

/// Says several lines on stderr.
pub(crate) fn tell_lines(text: &str) {
    let _ = stderr().write_all(visible(text).as_bytes());
}

/// The terminal itself, for what it is to obey: frames of a screen, whose texts were made visible before.
pub(crate) fn terminal() -> Stderr {
    stderr()
}

/// Shows an error on stderr.
pub fn show_error(report: Report) {
    let shown = format!("{:?}", Report::new(Shown::new(report)));
    let _ = writeln!(stderr(), "{}", visible_with_styles(&shown));
}

/// An error whose words are safe to show. The lines of a file that it points at are made so by whoever points.
#[derive(Debug)]
struct Shown {
    report: Report,
    cause: Option<Box<Cause>>,
}

/// What lies behind an error.
#[derive(Debug)]
struct Cause {
    words: String,
    cause: Option<Box<Cause>>,
}

impl Shown {
    fn new(report: Report) -> Self {
        fn cause(error: Option<&(dyn Error + 'static)>) -> Option<Box<Cause>> {
            error.map(|error| Box::new(Cause { words: one_line(&error.to_string()).into_owned(), cause: cause(error.source()) }))
        }
        let cause = cause(report.source());
        Self { report, cause }
    }
}

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&one_line(&self.report.to_string()))
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.words)
    }
}

impl Error for Shown {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.cause.as_deref().map(|cause| cause as _)
    }
}

impl Error for Cause {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.cause.as_deref().map(|cause| cause as _)
    }
}

impl Diagnostic for Shown {
    fn severity(&self) -> Option<Severity> {
        self.report.severity()
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.report.help().map(|help| Box::new(one_line(&help.to_string()).into_owned()) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.report.source_code()
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let shown = |label: LabeledSpan| {
            LabeledSpan::new_with_span(label.label().map(|words| one_line(words).into_owned()), *label.inner())
        };
        Some(Box::new(self.report.labels()?.map(shown)))
    }
}

/// A rendered text with the colours that the renderer gave it, and everything else that is hidden made visible.
fn visible_with_styles(text: &str) -> String {
    const INTRODUCER: &str = "\u{1b}[";
    let mut pieces = text.split(INTRODUCER);
    let mut shown = visible(pieces.next().unwrap_or_default()).into_owned();
    for piece in pieces {
        let digits = piece.len() - piece.trim_start_matches(|c: char| c.is_ascii_digit() || c == ';').len();
        let styled = if piece[digits..].starts_with('m') { digits + 1 } else { 0 };
        shown += &if styled > 0 { INTRODUCER.into() } else { visible(INTRODUCER) };
        shown += &piece[..styled];
        shown += &visible(&piece[styled..]);
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_stay_and_nothing_else_is_obeyed() {
        let text = "\u{1b}[31;1mred\u{1b}[0m \u{1b}[2J\u{1b}]0;title\u{7} \u{9b}31m\n";
        let shown = "\u{1b}[31;1mred\u{1b}[0m \\u{1b}[2J\\u{1b}]0;title\\u{7} \\u{9b}31m\n";
        assert_eq!(visible_with_styles(text), shown);
        assert_eq!(visible_with_styles("\u{1b}[31\u{202e}m \u{1b}"), "\\u{1b}[31\\u{202e}m \\u{1b}");
    }
}
