//! The fast side: all that happens in the sampling interrupt.
//!
//! One [`Sampler::tick`] latches the encoders, takes the LVDT's scan that the tick before started, starts the next one, and hands
//! the sample before over. A scan thus lies a constant time behind the latch that it belongs to ([`crate::BoardFacts`] says how
//! long), nothing waits for the converter, and a sample reaches the main loop one period after its latch.
//!
//! The 16-bit counters are extended here and not in the main loop: a sample that the queue had no room for then costs a sample
//! and never a turn of the counter.

use ballbar::{CounterWidth, ExtendedCounter, LvdtReading};
use heapless::spsc::{Producer, Queue};

use crate::{ENCODERS, EncoderBank, EncoderLatch, MonotonicClock, TriggeredAdc};

/// What the interrupt hands over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LatchedSample {
    /// Number of the tick since start, wrapping.
    pub index: u32,
    /// Time of the latch, microseconds since start.
    pub t_us: u64,
    /// Positions since start, counts.
    pub positions: [i32; ENCODERS],
    /// Positions at the index pulses that came since the latch before.
    pub at_index: [Option<i32>; ENCODERS],
    /// The LVDT; saturated also when the converter was not done in time.
    pub lvdt: LvdtReading,
}

/// Between the interrupt and the main loop, lock-free. 63 samples are 12 ms at the highest rate, 63 ms at the usual one.
pub type SampleQueue = Queue<LatchedSample, 64>;

/// Owns what the sampling interrupt touches.
pub struct Sampler<'q, E, A, C> {
    encoders: E,
    adc: A,
    clock: C,
    counters: [ExtendedCounter; ENCODERS],
    /// The latch whose scan is under way.
    latched: Option<LatchedSample>,
    next_index: u32,
    queue: Producer<'q, LatchedSample>,
}

impl<'q, E: EncoderBank, A: TriggeredAdc, C: MonotonicClock> Sampler<'q, E, A, C> {
    /// Positions are zero where the counters stand now.
    pub fn new(mut encoders: E, adc: A, clock: C, queue: Producer<'q, LatchedSample>) -> Self {
        let latch = encoders.latch();
        let mut counters = [ExtendedCounter::new(CounterWidth::Bits32, 0); ENCODERS];
        for ((counter, width), start) in counters.iter_mut().zip(E::WIDTHS).zip(latch.counters) {
            *counter = ExtendedCounter::new(width, start);
        }
        Self { encoders, adc, clock, counters, latched: None, next_index: 0, queue }
    }

    /// The sampling interrupt.
    pub fn tick(&mut self) {
        let latch = self.encoders.latch();
        let t_us = self.clock.now_us();
        let scan = self.adc.finish();
        self.adc.start();

        if let Some(mut sample) = self.latched.take() {
            sample.lvdt = scan.map_or(LvdtReading { code: 0, saturated: true }, |scan| LvdtReading {
                code: scan.code,
                saturated: scan.saturated,
            });
            // A full queue loses the sample; the main loop sees the gap in the indices and counts it.
            let _ = self.queue.enqueue(sample);
        }
        self.latched = Some(self.extend(&latch, t_us));
        self.next_index = self.next_index.wrapping_add(1);
    }

    fn extend(&mut self, latch: &EncoderLatch, t_us: u64) -> LatchedSample {
        let mut sample = LatchedSample { index: self.next_index, t_us, ..LatchedSample::default() };
        for (i, counter) in self.counters.iter_mut().enumerate() {
            sample.positions[i] = counter.update(latch.counters[i]);
            sample.at_index[i] = latch.at_index[i].map(|at| counter.position_at(at));
        }
        sample
    }

    /// The hardware, for a simulation that moves it between ticks.
    pub fn parts_mut(&mut self) -> (&mut E, &mut A, &mut C) {
        (&mut self.encoders, &mut self.adc, &mut self.clock)
    }
}
