//! Where the segments of a log begin.

use ballbar::wire::{LogMark, ToHost};

use super::record::Record;

/// Follows a log. A segment begins at every mark of recording and port, and at a hello that stands where none belongs: a recording keeps a hello right
/// behind its mark, so that a mark before this one is damaged.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Segments {
    /// Nothing but hellos and replies has come since the mark.
    is_greeting: bool,
}

impl Segments {
    /// Whether a segment begins with the next record: another board may answer from there on, and its numbers and clock are others.
    pub(super) fn begins(&mut self, record: &Record) -> bool {
        let message = match record {
            Record::Message(message) => message,
            Record::Refused(_) | Record::Mark(_) => return false,
            Record::Damaged => {
                self.is_greeting = false;
                return false;
            }
        };
        match **message {
            ToHost::Mark(_) => {
                self.is_greeting = true;
                true
            }
            ToHost::Hello(_) => !std::mem::replace(&mut self.is_greeting, true),
            ToHost::Stream(_) => {
                self.is_greeting = false;
                false
            }
            ToHost::Reply(_) => false,
        }
    }
}

/// Time of a mark by the host's clock, milliseconds since 1970, UTC.
pub(super) fn unix_ms_of(mark: LogMark) -> u64 {
    let (LogMark::Opened { unix_ms } | LogMark::Lost { unix_ms } | LogMark::Back { unix_ms }) = mark;
    unix_ms
}
