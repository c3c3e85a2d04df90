//! Hardware of a board that does what a test says.

use std::collections::VecDeque;
use std::convert::Infallible;

use ballbar::CounterWidth::{self, Bits16, Bits32};
use ballbar_firmware::{
    BoardFacts, ENCODERS, EncoderBank, EncoderLatch, Hardware, LvdtScan, MemoryFlash, MonotonicClock, ParameterFlash,
    TriggeredAdc,
};
use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write, WriteReady};

/// Flash that does not stall.
pub type Memory = MemoryFlash<Box<[u8]>>;

/// Erased flash that does not stall.
pub fn empty_memory() -> Memory {
    Memory::new(vec![0xff; Memory::BYTES].into())
}

/// Encoders whose true positions a test sets.
#[derive(Clone, Debug, Default)]
pub struct FakeEncoders {
    /// Positions, counts; the counters show as many bits of them as they have.
    pub positions: [i64; ENCODERS],
    /// Positions at index pulses since the last latch.
    pub at_index: [Option<i64>; ENCODERS],
}

impl EncoderBank for FakeEncoders {
    const WIDTHS: [CounterWidth; ENCODERS] = [Bits16, Bits16, Bits16, Bits32, Bits16, Bits32];

    fn latch(&mut self) -> EncoderLatch {
        let shown = |joint: usize, position: i64| match Self::WIDTHS[joint] {
            Bits16 => u32::from(position as u16),
            Bits32 => position as u32,
        };
        let at_index = std::mem::take(&mut self.at_index);
        EncoderLatch {
            counters: std::array::from_fn(|joint| shown(joint, self.positions[joint])),
            at_index: std::array::from_fn(|joint| at_index[joint].map(|position| shown(joint, position))),
        }
    }
}

/// A converter that scans what stands at its input when it is started.
#[derive(Clone, Debug)]
pub struct FakeAdc {
    /// What it would scan now.
    pub input: LvdtScan,
    /// Whether it is never done in time.
    pub is_stuck: bool,
    scan: Option<LvdtScan>,
}

impl Default for FakeAdc {
    /// In the middle.
    fn default() -> Self {
        Self { input: LvdtScan { code: 32_768, saturated: false }, is_stuck: false, scan: None }
    }
}

impl TriggeredAdc for FakeAdc {
    fn start(&mut self) {
        self.scan = (!self.is_stuck).then_some(self.input);
    }

    fn finish(&mut self) -> Option<LvdtScan> {
        self.scan.take()
    }
}

/// A clock that a test sets.
#[derive(Clone, Debug, Default)]
pub struct FakeClock {
    /// Microseconds since start.
    pub now_us: u64,
}

impl MonotonicClock for FakeClock {
    fn now_us(&mut self) -> u64 {
        self.now_us
    }
}

/// A link with a ring for transmission, as DMA has one, that a slow wire empties.
#[derive(Clone, Debug)]
pub struct FakeLink {
    /// Bytes on their way to the board.
    pub to_board: VecDeque<u8>,
    /// Bytes that have left the board.
    pub on_the_wire: Vec<u8>,
    /// How fast the wire takes them.
    pub bytes_per_s: u32,
    /// Whether every call ends with an error.
    pub is_broken: bool,
    ring: VecDeque<u8>,
    /// Parts of a byte that the wire could have taken besides, in millionths.
    rest: u64,
}

/// Of the F405's transmission ring.
const RING_BYTES: usize = 4_096;
/// 921,600 baud, 8N1.
pub const FULL_SPEED: u32 = 92_160;

impl Default for FakeLink {
    /// Nothing on it, at full speed.
    fn default() -> Self {
        Self {
            to_board: VecDeque::new(),
            on_the_wire: Vec::new(),
            bytes_per_s: FULL_SPEED,
            is_broken: false,
            ring: VecDeque::new(),
            rest: 0,
        }
    }
}

impl FakeLink {
    /// The wire takes what it can in this time.
    pub fn carry(&mut self, elapsed_us: u64) {
        let due = u64::from(self.bytes_per_s) * elapsed_us + self.rest;
        self.rest = due % 1_000_000;
        let bytes = ((due / 1_000_000) as usize).min(self.ring.len());
        self.on_the_wire.extend(self.ring.drain(..bytes));
    }

    fn result<T>(&self, value: T) -> Result<T, ErrorKind> {
        if self.is_broken { Err(ErrorKind::Other) } else { Ok(value) }
    }
}

impl ErrorType for FakeLink {
    type Error = ErrorKind;
}

impl ReadReady for FakeLink {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        // A broken link says that it is ready and then fails, which is the worse way to break.
        Ok(self.is_broken || !self.to_board.is_empty())
    }
}

impl Read for FakeLink {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        self.result(())?;
        assert!(!self.to_board.is_empty(), "a read that would block");
        let taken = self.to_board.len().min(buffer.len());
        for (place, byte) in buffer.iter_mut().zip(self.to_board.drain(..taken)) {
            *place = byte;
        }
        Ok(taken)
    }
}

impl WriteReady for FakeLink {
    fn write_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(self.is_broken || self.ring.len() < RING_BYTES)
    }
}

impl Write for FakeLink {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        self.result(())?;
        let taken = bytes.len().min(RING_BYTES - self.ring.len());
        assert!(taken > 0, "a write that would block");
        self.ring.extend(&bytes[..taken]);
        Ok(taken)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        self.on_the_wire.extend(self.ring.drain(..));
        self.result(())
    }
}

/// A lamp that remembers.
#[derive(Clone, Copy, Debug, Default)]
pub struct FakeLamp {
    /// Whether it is on.
    pub is_on: bool,
}

impl embedded_hal::digital::ErrorType for FakeLamp {
    type Error = Infallible;
}

impl embedded_hal::digital::OutputPin for FakeLamp {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.is_on = false;
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.is_on = true;
        Ok(())
    }
}

/// The slow side's hardware, which records what is done to it.
#[derive(Debug)]
pub struct FakeMachine<F> {
    /// The link.
    pub link: FakeLink,
    /// The flash.
    pub flash: F,
    /// The lamp.
    pub lamp: FakeLamp,
    /// The rate that was set last, Hz.
    pub rate_hz: u16,
    /// How often the watchdog was fed.
    pub feedings: u32,
    /// What had left the board at each reset, bytes.
    pub resets: Vec<usize>,
    /// What the stack is said to have left, bytes.
    pub stack_unused_bytes: u32,
}

/// What the fake board says of itself.
pub const FACTS: BoardFacts =
    BoardFacts { name: "fake", unique_id: *b"ABCDEFGHIJKL", encoder_skew_ns: 130, lvdt_delay_ns: 21_000 };

impl<F> FakeMachine<F> {
    /// Hardware that nothing has happened to.
    pub fn with(flash: F) -> Self {
        Self {
            link: FakeLink::default(),
            flash,
            lamp: FakeLamp::default(),
            rate_hz: 0,
            feedings: 0,
            resets: Vec::new(),
            stack_unused_bytes: 50_000,
        }
    }
}

impl<F: ParameterFlash> Hardware for FakeMachine<F> {
    type Link = FakeLink;
    type Flash = F;
    type Lamp = FakeLamp;

    fn facts(&self) -> BoardFacts {
        FACTS
    }
    fn link(&mut self) -> &mut FakeLink {
        &mut self.link
    }
    fn flash(&mut self) -> &mut F {
        &mut self.flash
    }
    fn lamp(&mut self) -> &mut FakeLamp {
        &mut self.lamp
    }
    fn set_rate_hz(&mut self, rate_hz: u16) {
        self.rate_hz = rate_hz;
    }
    fn feed_watchdog(&mut self) {
        self.feedings += 1;
    }
    fn reset(&mut self) {
        self.resets.push(self.link.on_the_wire.len());
    }
    fn stack_unused_bytes(&self) -> u32 {
        self.stack_unused_bytes
    }
}
