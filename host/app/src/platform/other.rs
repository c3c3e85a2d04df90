//! Windows, and what else is no Unix.

use std::collections::VecDeque;
use std::time::Duration;

use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};

use super::Key;

/// A file has the permissions of its folder.
pub(crate) fn with_usual_permissions(_: &mut tempfile::Builder<'_, '_>) {}

/// The keys of the console.
#[derive(Default)]
pub(crate) struct Keyboard;

const WAIT: Duration = Duration::from_millis(50);

impl Keyboard {
    /// The key of the next 50 milliseconds; an error when there is no terminal any more.
    pub(crate) fn wait(&mut self) -> std::io::Result<VecDeque<Key>> {
        if !event::poll(WAIT)? {
            return Ok(VecDeque::new());
        }
        let Event::Key(key) = event::read()? else { return Ok(VecDeque::new()) };
        let is_plain = !key.modifiers.intersects(KeyModifiers::CONTROL | KeyModifiers::ALT);
        let key = match key.code {
            _ if key.kind != KeyEventKind::Press => None,
            KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => Some(Key::End),
            KeyCode::Enter => Some(Key::Enter),
            KeyCode::Char(letter) if is_plain => Some(Key::Letter(letter.to_ascii_lowercase())),
            _ => None,
        };
        Ok(key.into_iter().collect())
    }
}
