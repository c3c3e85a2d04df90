//! A line that shows how things stand.

use std::io::{IsTerminal, Write, stderr};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// A line on stderr that is drawn anew on a terminal, and said once a second elsewhere.
pub(super) struct LiveLine {
    bar: Option<ProgressBar>,
    shown: Instant,
}

const REDRAW: Duration = Duration::from_millis(100);
const SAY: Duration = Duration::from_secs(1);

impl LiveLine {
    pub(super) fn new() -> Self {
        let style = ProgressStyle::with_template("{wide_msg}").unwrap_or_else(|_| ProgressStyle::default_spinner());
        let bar = stderr().is_terminal().then(|| ProgressBar::new_spinner().with_style(style));
        Self { bar, shown: Instant::now() }
    }

    /// Shows the state, when it is time to.
    pub(super) fn show(&mut self, text: impl FnOnce() -> String) {
        let every = if self.bar.is_some() { REDRAW } else { SAY };
        if self.shown.elapsed() >= every {
            self.shown = Instant::now();
            self.say(&text());
        }
    }

    /// Shows the state, when it is time to and there is a terminal.
    pub(super) fn draw(&mut self, text: impl FnOnce() -> String) {
        if self.bar.is_some() {
            self.show(text);
        }
    }

    /// Says something that stays.
    pub(super) fn note(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| say(text)),
            None => say(text),
        }
    }

    pub(super) fn clear(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    fn say(&self, text: &str) {
        match &self.bar {
            Some(bar) => {
                bar.set_message(text.to_owned());
                bar.tick();
            }
            None => say(text),
        }
    }
}

fn say(text: &str) {
    let _ = writeln!(stderr(), "{text}");
}
