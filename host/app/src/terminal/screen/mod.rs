//! What a person sees of a run that goes on: a steady screen on a terminal, lines elsewhere.

mod gauge;
mod layout;
mod picture;
mod terminal;
#[cfg(test)]
mod tests;

use std::io::{IsTerminal, stdin};
use std::time::{Duration, Instant};

pub(crate) use picture::{Bar, Joint, Picture, Poses};
use terminal::Terminal;

use super::out::{is_seen, tell};
pub(crate) use crate::platform::Key;
use crate::terminal::EndRequest;
use crate::text::one_line;

/// The steady screen, or lines on stderr.
pub(crate) struct Screen {
    terminal: Option<Terminal>,
    /// The latest of what was noted, for the steady screen.
    notes: Vec<String>,
    shown: Instant,
}

const REDRAW: Duration = Duration::from_millis(100);
const SAY: Duration = Duration::from_secs(1);
/// More notes than any window is high.
const KEPT_NOTES: usize = 200;
/// Notes that are said again when the steady screen is gone.
const LAST_NOTES: usize = 10;

impl Screen {
    /// A steady screen needs a terminal at both ends: one to draw on and one to take keys from.
    pub(crate) fn open(end: &EndRequest) -> Self {
        let is_dumb = std::env::var_os("TERM").is_some_and(|name| name == "dumb");
        let is_terminal = is_seen() && stdin().is_terminal() && !is_dumb;
        // A terminal that cannot be taken still shows lines.
        let terminal = is_terminal.then(|| Terminal::take(end.clone())).and_then(Result::ok);
        Self { terminal, notes: Vec::new(), shown: Instant::now() }
    }

    /// Whether keys are heard, and a picture seen.
    pub(crate) fn is_steady(&self) -> bool {
        self.terminal.is_some()
    }

    /// The next key that was pressed; none without a steady screen.
    pub(crate) fn key(&mut self) -> Option<Key> {
        self.terminal.as_mut()?.key()
    }

    /// Forgets every press of a key so far: it was not meant for what is asked now.
    pub(crate) fn forget(&mut self, key: Key) {
        if let Some(terminal) = &mut self.terminal {
            terminal.forget(key);
        }
    }

    /// Draws the picture, when it is time to and there is a steady screen.
    pub(crate) fn draw(&mut self, picture: impl FnOnce() -> Picture) {
        if let Some(terminal) = &mut self.terminal
            && self.shown.elapsed() >= REDRAW
        {
            self.shown = Instant::now();
            terminal.draw(&picture().made_visible(), &self.notes);
        }
    }

    /// Says how things stand, when it is time to and there is no steady screen.
    pub(crate) fn say(&mut self, line: impl FnOnce() -> String) {
        if self.terminal.is_none() && self.shown.elapsed() >= SAY {
            self.shown = Instant::now();
            tell(&line());
        }
    }

    /// Says something that stays.
    pub(crate) fn note(&mut self, text: &str) {
        if self.terminal.is_none() {
            return text.lines().for_each(tell);
        }
        self.notes.extend(text.lines().map(|line| one_line(line).into_owned()));
        let surplus = self.notes.len().saturating_sub(KEPT_NOTES);
        self.notes.drain(..surplus);
    }

    /// Gives the terminal back, and says the latest notes again.
    pub(crate) fn close(&mut self) {
        if self.terminal.take().is_some() {
            let first = self.notes.len().saturating_sub(LAST_NOTES);
            self.notes.drain(..).skip(first).for_each(|note| tell(&note));
        }
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        self.close();
    }
}
