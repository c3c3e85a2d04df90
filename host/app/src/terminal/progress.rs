//! Progress of long work.

use indicatif::{ProgressBar, ProgressStyle};

use super::out;

/// A progress bar on stderr, drawn only where that is a terminal.
pub(crate) fn progress(steps: u64, what: &'static str) -> ProgressBar {
    if !out::is_seen() {
        return ProgressBar::hidden();
    }
    let style =
        ProgressStyle::with_template("{msg:28} {wide_bar} {pos}/{len} {eta:>4}").unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(steps).with_style(style).with_message(what)
}
