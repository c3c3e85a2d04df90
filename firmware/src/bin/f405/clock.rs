//! Time since start, from the system timer at 168 MHz / 8 = 21 MHz.
//!
//! Not from the cycle counter (DWT_CYCCNT), which stands still while the main loop sleeps in `wfi` and no debugger is attached.
//! The system timer's 24 bits last for 2²⁴ / 21 MHz = 0.799 s: longer than the 0.5 s for which an erase of the flash may keep the
//! sampling interrupt, and with it the call that extends the counter, from running.

use ballbar_firmware::MonotonicClock;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

const TICKS_PER_US: u32 = 21;
const LAST_TICK: u32 = (1 << 24) - 1;

/// The system timer, extended to 64 bits of microseconds.
pub(crate) struct Clock {
    last: u32,
    us: u64,
    rest_ticks: u32,
}

impl Clock {
    /// Starts at zero.
    pub(crate) fn start(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::External);
        timer.set_reload(LAST_TICK);
        timer.clear_current();
        timer.enable_counter();
        Self { last: SYST::get_current(), us: 0, rest_ticks: 0 }
    }
}

impl MonotonicClock for Clock {
    fn now_us(&mut self) -> u64 {
        let now = SYST::get_current();
        // It counts down.
        let ticks = (self.last.wrapping_sub(now) & LAST_TICK) + self.rest_ticks;
        self.last = now;
        self.us += u64::from(ticks / TICKS_PER_US);
        self.rest_ticks = ticks % TICKS_PER_US;
        self.us
    }
}
