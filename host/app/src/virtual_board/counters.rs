//! What a board's hardware makes of an encoder's position: a counter of some width, and index pulses.

use ballbar::CounterWidth;
use ballbar_firmware::ENCODERS;

/// Widths of the counters: a PUMA's joints 4 and 6 span more than 16 bits and have the 32-bit ones, as on the real board.
pub const COUNTER_WIDTHS: [CounterWidth; ENCODERS] = {
    let mut widths = [CounterWidth::Bits16; ENCODERS];
    widths[3] = CounterWidth::Bits32;
    widths[5] = CounterWidth::Bits32;
    widths
};

/// The hardware counter of encoder `i` at a position in counts.
pub(super) fn counter(i: usize, counts: i32, start_counts: i32) -> u32 {
    let since_start = counts.wrapping_sub(start_counts) as u32;
    match COUNTER_WIDTHS[i] {
        CounterWidth::Bits16 => since_start & 0xffff,
        CounterWidth::Bits32 => since_start,
    }
}

/// The last index that was crossed between two positions; indices stand at the whole multiples of `per_index`.
pub(super) fn last_index(before: i32, now: i32, per_index: u32) -> Option<i32> {
    let per_index = i32::try_from(per_index).ok().filter(|&per_index| per_index > 0)?;
    let (turn_before, turn) = (before.div_euclid(per_index), now.div_euclid(per_index));
    match turn.cmp(&turn_before) {
        std::cmp::Ordering::Equal => None,
        std::cmp::Ordering::Greater => Some(turn.wrapping_mul(per_index)),
        std::cmp::Ordering::Less => Some((turn + 1).wrapping_mul(per_index)),
    }
}
