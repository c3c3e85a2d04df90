//! What a board has to offer: the traits behind which all hardware lies.
//!
//! Two sides meet in the library. The fast side, [`Sampler`](crate::Sampler), runs in the sampling interrupt and owns the encoders,
//! the converter and the clock. The slow side, [`Board`](crate::Board), runs in the main loop and owns the link, the flash and the
//! rest. Where a trait of embedded-io, embedded-storage or embedded-hal says it already, that one is taken.

use ballbar::CounterWidth;
use embedded_hal::digital::OutputPin;
use embedded_io::{Read, ReadReady, Write, WriteReady};
use embedded_storage::nor_flash::NorFlash;

/// Encoders that the interface board counts.
pub const ENCODERS: usize = 6;

/// All encoders at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EncoderLatch {
    /// The hardware counters as they stand; a 16-bit one fills the lower half.
    pub counters: [u32; ENCODERS],
    /// Each counter as it stood at the encoder's index pulse, where one came since the last latch. When several came, one of them.
    pub at_index: [Option<u32>; ENCODERS],
}

/// The bank of hardware quadrature counters.
pub trait EncoderBank {
    /// Width of each counter.
    const WIDTHS: [CounterWidth; ENCODERS];

    /// Reads every counter, one straight after the other, and takes the index pulses since the last call.
    fn latch(&mut self) -> EncoderLatch;
}

/// One oversampled conversion of the LVDT's signal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LvdtScan {
    /// Sum of the scan's conversions, scaled to 16 bits.
    pub code: u16,
    /// Whether one of the conversions stood at an end of the converter's range.
    pub saturated: bool,
}

/// A converter that is started by the sampling interrupt and is done, by itself, long before the next one.
pub trait TriggeredAdc {
    /// Starts a scan of the LVDT.
    fn start(&mut self);

    /// Takes the scan that [`start`](Self::start) began; `None` when it is not done, which is a fault of the converter.
    fn finish(&mut self) -> Option<LvdtScan>;
}

/// Time since start, which never steps back and never wraps.
pub trait MonotonicClock {
    /// Microseconds since start. Called at least 100 times a second, so that a narrow counter may be extended in it; where flash
    /// stalls the processor, the counter must also bridge the longest stall.
    fn now_us(&mut self) -> u64;
}

/// The serial link to the host. All four are non-blocking as the library calls them: it reads and writes only when the link says
/// that it is ready, and takes what a call gives.
pub trait Link: Read + ReadReady + Write + WriteReady {}
impl<T: Read + ReadReady + Write + WriteReady> Link for T {}

/// Flash for the parameters: two slots, each of one or more whole erase blocks.
///
/// What a power cut may do: an erase that is cut leaves any bits in the block that it was erasing; a write that is cut leaves any
/// bits in the words that were not yet written, which were all ones before. Other blocks and words stay as they are.
pub trait ParameterFlash: NorFlash {
    /// Whether the processor stands still while this flash erases or writes, because it fetches its program from it.
    const STALLS_SAMPLING: bool;
    /// Bytes of one slot, a multiple of the erase block; the second slot follows the first.
    const SLOT_BYTES: u32;
}

/// What a reader of a board's numbers needs to know of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoardFacts {
    /// What the board is called in its hello, at most 16 bytes.
    pub name: &'static str,
    /// A number of this very board.
    pub unique_id: [u8; 12],
    /// Time from the first to the last counter of a latch, at most, nanoseconds.
    pub encoder_skew_ns: u32,
    /// Time from the latch of the encoders to the middle of the LVDT's scan, nanoseconds. The delay of analogue filters before the
    /// converter is not in it.
    pub lvdt_delay_ns: u32,
}

/// The slow side's hardware.
pub trait Hardware {
    /// The serial link to the host.
    type Link: Link;
    /// Where the parameters are kept.
    type Flash: ParameterFlash;
    /// The board's lamp; high is on.
    type Lamp: OutputPin;

    /// What this board is.
    fn facts(&self) -> BoardFacts;
    /// The link.
    fn link(&mut self) -> &mut Self::Link;
    /// The flash.
    fn flash(&mut self) -> &mut Self::Flash;
    /// The lamp.
    fn lamp(&mut self) -> &mut Self::Lamp;
    /// Sets the rate of the sampling interrupt; the library asks only for rates from 100 to 5,000 Hz.
    fn set_rate_hz(&mut self, rate_hz: u16);
    /// Holds off the watchdog for another period, which is to be between one and ten seconds.
    fn feed_watchdog(&mut self);
    /// Resets the processor; returns only where there is none to reset.
    fn reset(&mut self);
    /// Bytes of the stack that were never used since start.
    fn stack_unused_bytes(&self) -> u32;
}
