//! The timer of the sampling interrupt.
//!
//! It is a one-shot timer that the interrupt sets anew: with a periodic one, a processor that sleeps and time that passes by counted
//! instructions (`-icount …,sleep=off`), the emulator runs at half the rate.

use core::sync::atomic::{AtomicU32, Ordering};

use ballbar_firmware::RATE_DEFAULT_HZ;

use crate::pac::{CLOCK_HZ, FREE_TIMER, SAMPLING_TIMER};

/// Counts of a period.
static PERIOD: AtomicU32 = AtomicU32::new(period(RATE_DEFAULT_HZ));

/// Changes the rate, from the next period on.
pub(crate) fn set_rate_hz(rate_hz: u16) {
    PERIOD.store(period(rate_hz), Ordering::Relaxed);
}

const fn period(rate_hz: u16) -> u32 {
    CLOCK_HZ / rate_hz as u32
}

/// The running timer.
pub(crate) struct SamplingTimer {
    /// What the free timer shows when the interrupt is due.
    due_at: u32,
}

impl SamplingTimer {
    /// Starts at [`RATE_DEFAULT_HZ`].
    pub(crate) fn start() -> Self {
        let counts = PERIOD.load(Ordering::Relaxed);
        SAMPLING_TIMER.start_once(counts);
        Self { due_at: FREE_TIMER.elapsed().wrapping_add(counts) }
    }

    /// Clears the interrupt and sets the next. One that is due already, because the plant took long to answer, is left out.
    pub(crate) fn acknowledge(&mut self) {
        SAMPLING_TIMER.clear_interrupt();
        let period = PERIOD.load(Ordering::Relaxed);
        self.due_at = self.due_at.wrapping_add(period);
        let mut counts = self.due_at.wrapping_sub(FREE_TIMER.elapsed());
        if counts == 0 || counts > period {
            self.due_at = self.due_at.wrapping_sub(counts).wrapping_add(period);
            counts = period;
        }
        SAMPLING_TIMER.set_once(counts);
    }
}
