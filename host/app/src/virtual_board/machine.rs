//! The hardware that the firmware's library asks for, made of a plant's states, queues of bytes and a file.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use ballbar::CounterWidth;
use ballbar_firmware::{
    BoardFacts, ENCODERS, EncoderBank, EncoderLatch, Hardware, LvdtScan, MonotonicClock, RATE_DEFAULT_HZ, TriggeredAdc,
};
use embedded_hal::digital::OutputPin;
use embedded_io::{Read, ReadReady, Write, WriteReady};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::counters::COUNTER_WIDTHS;
use super::flash_file::FlashFile;

/// The encoders' inputs, set before every tick.
#[derive(Default)]
pub(super) struct Encoders(pub(super) EncoderLatch);

impl EncoderBank for Encoders {
    const WIDTHS: [CounterWidth; ENCODERS] = COUNTER_WIDTHS;

    fn latch(&mut self) -> EncoderLatch {
        self.0
    }
}

/// The converter; its input is set before every tick, and a scan is done as soon as it is started.
#[derive(Default)]
pub(super) struct Converter {
    pub(super) input: LvdtScan,
    scan: Option<LvdtScan>,
}

impl TriggeredAdc for Converter {
    fn start(&mut self) {
        self.scan = Some(self.input);
    }

    fn finish(&mut self) -> Option<LvdtScan> {
        self.scan.take()
    }
}

/// Microseconds since power-up, set before every tick.
#[derive(Default)]
pub(super) struct Clock(pub(super) u64);

impl MonotonicClock for Clock {
    fn now_us(&mut self) -> u64 {
        self.0
    }
}

/// What the slow side of the board owns. It outlives a reset; the board, lent a reference, does not.
pub(super) struct Machine {
    pub(super) link: QueuedLink,
    pub(super) flash: FlashFile,
    pub(super) lamp: Lamp,
    pub(super) rate_hz: u16,
    pub(super) is_reset_asked: bool,
}

impl Machine {
    pub(super) fn new(flash: FlashFile) -> Self {
        Self { link: QueuedLink::default(), flash, lamp: Lamp::default(), rate_hz: RATE_DEFAULT_HZ, is_reset_asked: false }
    }
}

impl Hardware for &mut Machine {
    type Link = QueuedLink;
    type Flash = FlashFile;
    type Lamp = Lamp;

    fn facts(&self) -> BoardFacts {
        BoardFacts { name: "virtual", unique_id: *b"virtualboard", encoder_skew_ns: 0, lvdt_delay_ns: 0 }
    }

    fn link(&mut self) -> &mut QueuedLink {
        &mut self.link
    }

    fn flash(&mut self) -> &mut FlashFile {
        &mut self.flash
    }

    fn lamp(&mut self) -> &mut Lamp {
        &mut self.lamp
    }

    fn set_rate_hz(&mut self, rate_hz: u16) {
        self.rate_hz = rate_hz;
    }

    fn feed_watchdog(&mut self) {}

    fn reset(&mut self) {
        self.is_reset_asked = true;
    }

    fn stack_unused_bytes(&self) -> u32 {
        // The thread's stack is not painted; it is far larger than any board's.
        1 << 20
    }
}

/// The lamp, which tells a stream from idling: only while the board streams does it shine without a break.
#[derive(Default)]
pub(super) struct Lamp {
    lit_samples: u32,
}

impl Lamp {
    /// Whether it has shone for a fifth of a second, longer than any blink.
    pub(super) fn shines_steadily(&self, rate_hz: u16) -> bool {
        self.lit_samples > u32::from(rate_hz) / 5
    }
}

impl embedded_hal::digital::ErrorType for Lamp {
    type Error = Infallible;
}

impl OutputPin for Lamp {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.lit_samples = 0;
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.lit_samples = self.lit_samples.saturating_add(1);
        Ok(())
    }
}

/// The board's end of the serial line; the runner carries the bytes between the queues and the port.
#[derive(Default)]
pub(super) struct QueuedLink {
    pub(super) incoming: VecDeque<u8>,
    pub(super) outgoing: VecDeque<u8>,
    /// Damages what is written.
    pub(super) bit_errors: Option<BitErrors>,
}

/// Bytes that wait for the port at most; then the link is not ready, and the board has to drop messages.
const OUTGOING_CAPACITY: usize = 16_384;

impl embedded_io::ErrorType for QueuedLink {
    type Error = Infallible;
}

impl Read for QueuedLink {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Infallible> {
        let count = bytes.len().min(self.incoming.len());
        for (place, byte) in bytes.iter_mut().zip(self.incoming.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }
}

impl ReadReady for QueuedLink {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.incoming.is_empty())
    }
}

impl Write for QueuedLink {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let count = bytes.len().min(OUTGOING_CAPACITY.saturating_sub(self.outgoing.len()));
        let before = self.outgoing.len();
        self.outgoing.extend(&bytes[..count]);
        if let Some(bit_errors) = &mut self.bit_errors {
            bit_errors.damage(self.outgoing.range_mut(before..));
        }
        Ok(count)
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl WriteReady for QueuedLink {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.outgoing.len() < OUTGOING_CAPACITY)
    }
}

/// Flips one pseudo-random bit every so many bytes.
pub(super) struct BitErrors {
    every: u64,
    left: u64,
    rng: ChaCha8Rng,
    flips: Arc<AtomicU64>,
}

impl BitErrors {
    /// `flips` counts them.
    pub(super) fn new(every: u64, flips: Arc<AtomicU64>) -> Self {
        Self { every: every.max(1), left: every.max(1), rng: ChaCha8Rng::seed_from_u64(every), flips }
    }

    fn damage<'a>(&mut self, bytes: impl Iterator<Item = &'a mut u8>) {
        for byte in bytes {
            self.left -= 1;
            if self.left == 0 {
                self.left = self.every;
                *byte ^= 1 << self.rng.random_range(0..8_u32);
                self.flips.fetch_add(1, Ordering::Relaxed);
            }
        }
    }
}
