//! The timer of the sampling interrupt: TIM7, which can do nothing else, so that no encoder loses its timer to it.

#![allow(unsafe_code)] // the interrupt clears its flag while the main loop owns the timer

use ballbar_firmware::RATE_DEFAULT_HZ;
use stm32f4xx_hal::pac::TIM7;
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

/// 84 MHz / 14. Whole microseconds at the usual rates, and 16 bits still hold a period of 100 Hz.
const TICK_HZ: u32 = 6_000_000;
const PRESCALER: u16 = 14;

/// The running timer.
pub(crate) struct SamplingTimer {
    timer: TIM7,
}

impl SamplingTimer {
    /// Starts at [`RATE_DEFAULT_HZ`].
    pub(crate) fn start(timer: TIM7, rcc: &mut Rcc) -> Self {
        TIM7::enable(rcc);
        TIM7::reset(rcc);
        timer.psc().write(|w| w.psc().set(PRESCALER - 1));
        let mut timer = Self { timer };
        timer.set_rate_hz(RATE_DEFAULT_HZ);
        // Takes the prescaler and the first period over; without it the first period would be 65,536 ticks of 84 MHz.
        timer.timer.egr().write(|w| w.ug().update());
        timer.timer.sr().write(|w| w.uif().clear());
        timer.timer.dier().write(|w| w.uie().enabled());
        timer.timer.cr1().write(|w| {
            w.arpe().enabled();
            w.cen().enabled()
        });
        timer
    }

    /// Changes the rate, from the next period on, so that no period is cut short.
    pub(crate) fn set_rate_hz(&mut self, rate_hz: u16) {
        let rate_hz = u32::from(rate_hz).max(1);
        let ticks = (TICK_HZ + rate_hz / 2) / rate_hz;
        let last_tick = u16::try_from(ticks.saturating_sub(1)).unwrap_or(u16::MAX);
        self.timer.arr().write(|w| w.arr().set(last_tick));
    }
}

/// Clears the timer's flag; the first thing in its interrupt, so that the write has long arrived when the interrupt returns.
pub(crate) fn acknowledge() {
    // SAFETY: the status register is this interrupt's own after the start; writing zero to its one flag clears it.
    unsafe { &*TIM7::ptr() }.sr().write(|w| w.uif().clear());
}
