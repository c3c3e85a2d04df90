//! What of a stream was lost, and what was not believed.

use std::fmt;

use serde::Serialize;

use super::plausible::Implausible;

/// Losses of a stream since it was begun to be watched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct StreamLosses {
    /// Stream messages that arrived and are believed.
    pub messages: u64,
    /// Numbers missing between them.
    pub missing: u64,
    /// Of these, dropped by the board because the link was slow.
    pub dropped_by_board: u64,
    /// The others: damaged or lost on the line.
    pub lost_on_line: u64,
    /// Samples that the board's main loop was too slow for.
    pub overruns: u64,
    /// Messages that arrived whole and are not believed.
    pub refused: RefusedMessages,
}

/// Messages that arrived whole and are not believed, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RefusedMessages {
    /// Values of more or fewer encoders or joints than the board has.
    pub wrong_count: u64,
    /// A number that is infinite or none.
    pub not_finite: u64,
    /// A number that no board measures, or that does not agree with the messages before.
    pub out_of_range: u64,
    /// A number or a time before those that came already.
    pub went_back: u64,
    /// The message came already; nothing is lost with it.
    pub repeated: u64,
}

impl StreamLosses {
    /// Messages and samples that are lost: missing, or refused and no mere repetition.
    pub fn lost(&self) -> u64 {
        self.missing + self.overruns + self.refused.lost()
    }
}

impl RefusedMessages {
    pub(super) fn count(&mut self, reason: Implausible) {
        *match reason {
            Implausible::WrongCount { .. } => &mut self.wrong_count,
            Implausible::NotFinite(_) => &mut self.not_finite,
            Implausible::OutOfRange(_) | Implausible::Parameters(_) => &mut self.out_of_range,
            Implausible::WentBack(_) => &mut self.went_back,
            Implausible::Repeated => &mut self.repeated,
        } += 1;
    }

    /// All of them.
    pub fn all(&self) -> u64 {
        self.lost() + self.repeated
    }

    /// Those with which something is lost.
    pub fn lost(&self) -> u64 {
        self.wrong_count + self.not_finite + self.out_of_range + self.went_back
    }
}

impl fmt::Display for RefusedMessages {
    /// `3 messages that cannot be true (2 of another number of encoders, 1 that came already)`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [
            (self.wrong_count, "of another number of encoders"),
            (self.not_finite, "not finite"),
            (self.out_of_range, "out of range"),
            (self.went_back, "that go back"),
            (self.repeated, "that came already"),
        ];
        let named: Vec<String> =
            parts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect();
        write!(f, "{} messages that cannot be true ({})", self.all(), named.join(", "))
    }
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
            refused: self.refused + other.refused,
        }
    }
}

impl std::ops::Add for RefusedMessages {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            wrong_count: self.wrong_count + other.wrong_count,
            not_finite: self.not_finite + other.not_finite,
            out_of_range: self.out_of_range + other.out_of_range,
            went_back: self.went_back + other.went_back,
            repeated: self.repeated + other.repeated,
        }
    }
}

/// Says once for each reason that messages are refused; their number is counted elsewhere.
#[derive(Clone, Debug, Default)]
pub struct Refusals(Vec<std::mem::Discriminant<Implausible>>);

impl Refusals {
    /// What to say, where this reason is new.
    pub fn note(&mut self, reason: Implausible) -> Option<String> {
        let kind = std::mem::discriminant(&reason);
        if self.0.contains(&kind) {
            return None;
        }
        self.0.push(kind);
        Some(format!("a message of the board is not believed: {reason}; others like it are counted"))
    }
}
