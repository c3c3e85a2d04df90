//! What of a stream was lost, and where.

use ballbar::wire::{Status, Stream};
use serde::Serialize;

/// Losses of a stream since it was begun to be watched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct StreamLosses {
    /// Stream messages that arrived.
    pub messages: u64,
    /// Numbers missing between them.
    pub missing: u64,
    /// Of these, dropped by the board because the link was slow.
    pub dropped_by_board: u64,
    /// The others: damaged or lost on the line.
    pub lost_on_line: u64,
    /// Samples that the board's main loop was too slow for.
    pub overruns: u64,
}

impl std::ops::Add for StreamLosses {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            messages: self.messages + other.messages,
            missing: self.missing + other.missing,
            dropped_by_board: self.dropped_by_board + other.dropped_by_board,
            lost_on_line: self.lost_on_line + other.lost_on_line,
            overruns: self.overruns + other.overruns,
        }
    }
}

/// Follows the numbers of a stream.
#[derive(Clone, Copy, Debug, Default)]
pub struct StreamTally {
    last: Option<Numbers>,
    losses: StreamLosses,
}

#[derive(Clone, Copy, Debug)]
struct Numbers {
    sequence: u32,
    dropped: u32,
    overruns: u32,
}

impl StreamTally {
    /// Takes the next message.
    pub fn take(&mut self, stream: &Stream) {
        let now = Numbers { sequence: stream.sequence, dropped: stream.dropped, overruns: stream.overruns };
        self.losses.messages += 1;
        if let Some(last) = self.last.replace(now) {
            self.count(last, now);
        }
    }

    /// Counts what is missing between two messages.
    fn count(&mut self, last: Numbers, now: Numbers) {
        let missing = u64::from(now.sequence.wrapping_sub(last.sequence).wrapping_sub(1));
        let dropped = u64::from(now.dropped.wrapping_sub(last.dropped));
        self.losses.missing += missing;
        self.losses.dropped_by_board += dropped.min(missing);
        self.losses.lost_on_line += missing.saturating_sub(dropped);
        self.losses.overruns += u64::from(now.overruns.wrapping_sub(last.overruns));
    }

    /// The stream has ended; `status` was asked for behind it. What is missing behind the last message shows here only.
    pub fn end(&mut self, status: &Status) {
        if let Some(last) = self.last.take() {
            let now = Numbers { sequence: status.stream_messages, dropped: status.dropped, overruns: status.overruns };
            self.count(last, now);
        }
    }

    /// The board was reset or the port lost: numbers begin anew, and what lies between is not counted.
    pub fn interrupt(&mut self) {
        self.last = None;
    }

    /// What was lost so far.
    pub fn losses(&self) -> StreamLosses {
        self.losses
    }
}
