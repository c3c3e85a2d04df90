//! Quadrature counters: extension of their width, and the check by the index pulse.

/// Width of a hardware counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CounterWidth {
    /// Wraps every 65,536 counts; the position stays right as long as it moves by fewer than 32,768 counts between two reads.
    Bits16,
    /// Wraps with the position itself.
    Bits32,
}

/// A position in counts, kept by reading a counter that wraps.
#[derive(Clone, Copy, Debug)]
pub struct ExtendedCounter {
    width: CounterWidth,
    last: u32,
    position: i32,
}

impl ExtendedCounter {
    /// Position zero, with the counter standing at `counter`.
    pub fn new(width: CounterWidth, counter: u32) -> Self {
        Self { width, last: counter, position: 0 }
    }

    /// Takes the counter as it stands now; returns the position.
    pub fn update(&mut self, counter: u32) -> i32 {
        self.position = self.position_at(counter);
        self.last = counter;
        self.position
    }

    /// The position that belongs to a counter read shortly before or after the last update.
    pub fn position_at(&self, counter: u32) -> i32 {
        let moved = match self.width {
            CounterWidth::Bits16 => i32::from((counter as u16).wrapping_sub(self.last as u16) as i16),
            CounterWidth::Bits32 => counter.wrapping_sub(self.last) as i32,
        };
        self.position.wrapping_add(moved)
    }
}

/// Checks that index pulses come whole turns of the encoder from the first one: counts that were lost or invented show, also when
/// they are few a turn.
#[derive(Clone, Copy, Debug, Default)]
pub struct IndexCheck {
    counts_per_index: u32,
    reference: Option<i32>,
    pulses: u32,
    errors: u32,
}

/// A pulse has a width, and its two edges are seen from the two directions: so far apart may pulses be without an error.
const INDEX_TOLERANCE_COUNTS: u32 = 4;

impl IndexCheck {
    /// Pulses come every `counts_per_index` counts; with 0 they are counted and not checked.
    pub fn new(counts_per_index: u32) -> Self {
        Self { counts_per_index, ..Self::default() }
    }

    /// A pulse came at this position. After an error the new pulse is what the next ones are compared with, so that a slip counts
    /// once.
    pub fn pulse(&mut self, position: i32) {
        self.pulses = self.pulses.saturating_add(1);
        let Some(reference) = self.reference else {
            self.reference = Some(position);
            return;
        };
        if self.counts_per_index == 0 {
            return;
        }
        let apart = reference.abs_diff(position) % self.counts_per_index;
        if apart.min(self.counts_per_index - apart) > INDEX_TOLERANCE_COUNTS {
            self.errors = self.errors.saturating_add(1);
            self.reference = Some(position);
        }
    }

    /// Forgets where pulses were: positions were preset, and the next pulse begins anew.
    pub fn restart(&mut self) {
        self.reference = None;
    }

    /// From here on pulses are this far apart; what was counted stays.
    pub fn set_counts_per_index(&mut self, counts_per_index: u32) {
        if self.counts_per_index != counts_per_index {
            self.counts_per_index = counts_per_index;
            self.restart();
        }
    }

    /// Pulses seen.
    pub fn pulses(&self) -> u32 {
        self.pulses
    }

    /// Pulses that were no whole number of turns from the first, or from the last error.
    pub fn errors(&self) -> u32 {
        self.errors
    }
}
