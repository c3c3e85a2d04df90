//! The line to the simulated plant, in lockstep: encoders, LVDT and time of a tick.
//!
//! At every latch the board sends the microseconds since the one before, as `1hhhhhhh 0lllllll`, and waits for what the inputs are
//! at that moment ([`record`](crate::record)). Nothing depends on how long the answer takes: its time does not count, and a tick
//! that it delays is late by no more than that.
//!
//! After a reset the board sends the longest time of all, which no tick has; the plant answers with eight bytes of ones and one of
//! zeros, and both begin at zeros. No record holds so many ones, so that what was left of an old one is passed over.

use core::sync::atomic::{AtomicU8, AtomicU16, AtomicU32, Ordering};

use ballbar::CounterWidth::{self, Bits16, Bits32};
use ballbar_firmware::{ENCODERS, EncoderBank, EncoderLatch, LvdtScan, MonotonicClock, TriggeredAdc};

use crate::pac::{CLOCK_HZ, FREE_TIMER, PLANT_UART};
use crate::record::Inputs;

const COUNTS_PER_US: u32 = CLOCK_HZ / 1_000_000;
/// Says that the board has started.
const STARTED: u32 = (1 << 14) - 1;
/// Ones before the plant's first record.
const PREAMBLE_ONES: usize = 8;

// What came with the latest latch. Only the sampling interrupt uses these: the three drivers in it share one line.
static LATCHED_AT_US: AtomicU32 = AtomicU32::new(0);
static LATCHED_CODE: AtomicU16 = AtomicU16::new(0);
static LATCHED_SATURATION: AtomicU8 = AtomicU8::new(0);

/// The encoders of the plant.
pub(crate) struct PlantEncoders {
    inputs: Inputs,
    /// What the free timer showed at the latest latch, but for less than a microsecond.
    latched_at: u32,
}

impl PlantEncoders {
    /// Greets the plant; waits until it answers.
    pub(crate) fn start() -> Self {
        PLANT_UART.start(false);
        send_time(STARTED);
        let mut ones = 0;
        loop {
            match PLANT_UART.read() {
                0xff => ones += 1,
                0 if ones >= PREAMBLE_ONES => break,
                _ => ones = 0,
            }
        }
        Self { inputs: Inputs::default(), latched_at: FREE_TIMER.elapsed() }
    }
}

impl EncoderBank for PlantEncoders {
    /// As on the real board.
    const WIDTHS: [CounterWidth; ENCODERS] = [Bits16, Bits16, Bits16, Bits32, Bits16, Bits32];

    fn latch(&mut self) -> EncoderLatch {
        // Time that does not fit is made up for at the next tick; only a plant that took half a second to answer needs that.
        let elapsed_us = (FREE_TIMER.elapsed().wrapping_sub(self.latched_at) / COUNTS_PER_US).min(STARTED - 1);
        self.latched_at = self.latched_at.wrapping_add(elapsed_us * COUNTS_PER_US);
        LATCHED_AT_US.store(LATCHED_AT_US.load(Ordering::Relaxed).wrapping_add(elapsed_us), Ordering::Relaxed);

        send_time(elapsed_us);
        if let Err(error) = self.inputs.read::<Self>(|| PLANT_UART.read()) {
            #[expect(clippy::panic, reason = "nothing that was sampled from here on would be true")]
            {
                panic!("plant out of step: {error}");
            }
        }
        LATCHED_CODE.store(self.inputs.scan.code, Ordering::Relaxed);
        LATCHED_SATURATION.store(self.inputs.scan.saturated.into(), Ordering::Relaxed);
        self.inputs.latch
    }
}

fn send_time(us: u32) {
    PLANT_UART.write((us >> 7) as u8 | 0x80);
    PLANT_UART.write(us as u8 & 0x7f);
}

/// The LVDT of the plant: a scan is what came with the latch, and is done at the next tick, as on the real board.
#[derive(Default)]
pub(crate) struct PlantLvdt {
    scan: Option<LvdtScan>,
}

impl TriggeredAdc for PlantLvdt {
    fn start(&mut self) {
        self.scan = Some(LvdtScan {
            code: LATCHED_CODE.load(Ordering::Relaxed),
            saturated: LATCHED_SATURATION.load(Ordering::Relaxed) != 0,
        });
    }

    fn finish(&mut self) -> Option<LvdtScan> {
        self.scan.take()
    }
}

/// Time at the latest latch, as the plant was told it.
#[derive(Default)]
pub(crate) struct LatchClock {
    last_us: u32,
    us: u64,
}

impl MonotonicClock for LatchClock {
    fn now_us(&mut self) -> u64 {
        let now_us = LATCHED_AT_US.load(Ordering::Relaxed);
        self.us += u64::from(now_us.wrapping_sub(self.last_us));
        self.last_us = now_us;
        self.us
    }
}
