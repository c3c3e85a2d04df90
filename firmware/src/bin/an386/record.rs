//! What the plant answers to a tick: only what has changed, because every received byte holds the emulation up by some 28 µs.
//!
//! ```text
//! byte 1       bits 0..5: counter i has changed; bit 6: the LVDT's code has; bit 7: byte 2 follows
//! byte 2       bits 0..5: encoder i has passed its index; bit 6: saturation has begun or ended; bit 7: always 0
//! numbers      in this order: changes of the counters, of the code, and the counters at their indices less the counters now
//! ```
//!
//! Numbers are zigzag-coded (0, −1, 1, −2 are 0, 1, 2, 3) and sent seven bits a byte, the lowest first, with bit 7 set on all but
//! the last. Differences of counters wrap as the counters do.

use core::fmt;

use ballbar::CounterWidth;
use ballbar_firmware::{ENCODERS, EncoderBank, EncoderLatch, LvdtScan};

/// The board's inputs at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Inputs {
    /// Counters and index pulses.
    pub(crate) latch: EncoderLatch,
    /// The LVDT.
    pub(crate) scan: LvdtScan,
}

/// A record that no plant sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RecordError {
    /// Byte 2 is zero or has bit 7 set.
    Flags(u8),
    /// A number of more than 32 bits.
    Number,
    /// A code beyond 16 bits.
    Code,
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flags(flags) => write!(f, "flags {flags:#04x}"),
            Self::Number => f.write_str("number of more than 32 bits"),
            Self::Code => f.write_str("code beyond 16 bits"),
        }
    }
}

const CODE_CHANGED: u8 = 1 << 6;
const MORE_FLAGS: u8 = 1 << 7;
const SATURATION_CHANGED: u8 = 1 << 6;

impl Inputs {
    /// Reads the record of the next tick of a bank of type `E`, byte by byte from `next`.
    ///
    /// # Errors
    /// [`RecordError`]; the two ends are out of step then.
    pub(crate) fn read<E: EncoderBank>(&mut self, mut next: impl FnMut() -> u8) -> Result<(), RecordError> {
        let flags = next();
        let more_flags = if flags & MORE_FLAGS == 0 { 0 } else { next() };
        if flags & MORE_FLAGS != 0 && (more_flags == 0 || more_flags & MORE_FLAGS != 0) {
            return Err(RecordError::Flags(more_flags));
        }
        for (i, counter) in self.latch.counters.iter_mut().enumerate() {
            if flags & (1 << i) != 0 {
                *counter = moved(*counter, number(&mut next)?, E::WIDTHS[i]);
            }
        }
        if flags & CODE_CHANGED != 0 {
            let code = i32::from(self.scan.code).wrapping_add(number(&mut next)?);
            self.scan.code = u16::try_from(code).map_err(|_| RecordError::Code)?;
        }
        self.scan.saturated ^= more_flags & SATURATION_CHANGED != 0;
        self.latch.at_index = [None; ENCODERS];
        for (i, at_index) in self.latch.at_index.iter_mut().enumerate() {
            if more_flags & (1 << i) != 0 {
                *at_index = Some(moved(self.latch.counters[i], number(&mut next)?, E::WIDTHS[i]));
            }
        }
        Ok(())
    }
}

/// A counter after a change, as wide as it is.
fn moved(counter: u32, change: i32, width: CounterWidth) -> u32 {
    let moved = counter.wrapping_add_signed(change);
    match width {
        CounterWidth::Bits16 => moved & 0xffff,
        CounterWidth::Bits32 => moved,
    }
}

fn number(mut next: impl FnMut() -> u8) -> Result<i32, RecordError> {
    let mut zigzag = 0;
    for shift in (0..u32::BITS).step_by(7) {
        let byte = next();
        let bits = u32::from(byte & 0x7f);
        if shift + 7 > u32::BITS && bits >> (u32::BITS - shift) != 0 {
            break;
        }
        zigzag |= bits << shift;
        if byte & 0x80 == 0 {
            return Ok((zigzag >> 1).cast_signed() ^ -(zigzag & 1).cast_signed());
        }
    }
    Err(RecordError::Number)
}
