//! From a reset to running clocks: why it came, the watchdog, the crystal.

use ballbar::wire::ResetReason;
use stm32f4xx_hal::pac::{DBGMCU, IWDG, RCC};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Config, Rcc};
use stm32f4xx_hal::watchdog::IndependentWatchdog;

use crate::crash;

/// At the nominal 32 kHz of its oscillator; 2.7 s at its fastest (47 kHz), 7.5 s at its slowest (17 kHz). The longest that the
/// main loop stands still is the very first store of parameters, which erases two sectors of flash, 1 s.
const WATCHDOG_PERIOD_MS: u32 = 4_000;

/// Why the processor started. Clears what it reads, so that the next start tells of its own cause only.
pub(crate) fn take_reason(rcc: &RCC) -> ResetReason {
    let flags = rcc.csr().read();
    rcc.csr().modify(|_, w| w.rmvf().clear());
    if let Some(message) = crash::take() {
        return ResetReason::Panic(message);
    }
    // In this order: power-on sets the brown-out flag too, and every reset of its own pulls the reset pin and sets its flag.
    if flags.porrstf().is_reset() {
        ResetReason::PowerOn
    } else if flags.borrstf().is_reset() {
        ResetReason::BrownOut
    } else if flags.wdgrstf().is_reset() || flags.wwdgrstf().is_reset() {
        ResetReason::Watchdog
    } else if flags.sftrstf().is_reset() {
        ResetReason::Software
    } else if flags.padrstf().is_reset() && flags.lpwrrstf().is_no_reset() {
        ResetReason::Pin
    } else {
        ResetReason::Unknown
    }
}

/// Starts the independent watchdog, which nothing but a reset can stop; it pauses while a debugger holds the processor.
pub(crate) fn start_watchdog(iwdg: IWDG, debug: &DBGMCU) -> IndependentWatchdog {
    let mut watchdog = IndependentWatchdog::new(iwdg);
    watchdog.stop_on_debug(debug, true);
    watchdog.start(WATCHDOG_PERIOD_MS.millis());
    // Started, it counts from its longest period; the one asked for is taken some cycles of its oscillator later, and holds from
    // the next feed on. A millisecond of the 16 MHz that the processor starts with.
    cortex_m::asm::delay(16_000);
    watchdog.feed();
    watchdog
}

/// 168 MHz from the crystal of 8 MHz; the buses at their most, 42 and 84 MHz, and their timers at 84 and 168 MHz.
pub(crate) fn start_clocks(rcc: RCC) -> Rcc {
    rcc.freeze(Config::hse(8.MHz()).sysclk(168.MHz()).pclk1(42.MHz()).pclk2(84.MHz()))
}
