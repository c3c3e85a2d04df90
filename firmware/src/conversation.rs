//! Where the conversation with the host stands.

use ballbar::wire::{Refusal, Reply};

/// What has been asked and answered since the last hello.
#[derive(Default)]
pub(crate) struct Conversation {
    pub(crate) is_open: bool,
    last_id: Option<u16>,
    /// The last command that changed something, and what came of it: told again when the request is repeated.
    pub(crate) last_action: Option<(u16, Result<(), Refusal>)>,
    pub(crate) missing: u32,
}

impl Conversation {
    /// A hello came; a host of another version is greeted and nothing more.
    pub(crate) fn greet(&mut self, is_same_version: bool) {
        *self = Self { is_open: is_same_version, missing: self.missing, ..Self::default() };
    }

    /// Counts the requests that are missing before this one, and forgets the last action when this is no repetition of it.
    pub(crate) fn count(&mut self, id: u16) {
        self.last_action = self.last_action.filter(|&(last, _)| last == id);
        if let Some(last) = self.last_id.replace(id) {
            let ahead = id.wrapping_sub(last);
            // Half of the circle is behind: a repetition, or a host that began anew.
            if (2..0x8000).contains(&ahead) {
                self.missing = self.missing.wrapping_add(u32::from(ahead) - 1);
            }
        }
    }

    /// The answer to a payload that is no message of this version: under its number when it is a request, as far as one can tell,
    /// and under 0 otherwise.
    pub(crate) fn not_understood(&mut self, payload: &[u8]) -> Reply {
        let id = match postcard::take_from_bytes::<(u8, u16)>(payload) {
            Ok(((1, id), _)) => Some(id),
            _ => None,
        };
        // It came, so it is not missing.
        if let Some(id) = id.filter(|_| self.is_open) {
            self.count(id);
        }
        Reply { id: id.unwrap_or_default(), outcome: Err(Refusal::NotUnderstood) }
    }
}
