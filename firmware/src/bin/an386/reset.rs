//! Why the processor started, and the watchdog.
//!
//! The emulated processor does not say why it was reset, so every way to a reset leaves a mark in memory that a reset does not clear.

#![allow(unsafe_code)] // memory that outlives resets

use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU32, Ordering};

use ballbar::wire::ResetReason;
use cortex_m::peripheral::SCB;

use crate::crash;
use crate::pac::{CLOCK_HZ, Watchdog};

const WATCHDOG_PERIOD_S: u32 = 5;

// Marks, all unlike what memory holds after power-on.
const RUNNING: u32 = 0xB0A2_D001;
const SOFTWARE: u32 = 0xB0A2_D002;
const WATCHDOG: u32 = 0xB0A2_D003;

#[unsafe(link_section = ".uninit.reset_mark")]
static MARK: MaybeUninit<AtomicU32> = MaybeUninit::uninit();

fn mark() -> &'static AtomicU32 {
    // SAFETY: any bits are an `AtomicU32`, and the memory of a static is never unreadable.
    unsafe { MARK.assume_init_ref() }
}

/// Why the processor started. Clears what it reads.
pub(crate) fn take_reason() -> ResetReason {
    let found = mark().swap(RUNNING, Ordering::Relaxed);
    if let Some(message) = crash::take() {
        return ResetReason::Panic(message);
    }
    match found {
        SOFTWARE => ResetReason::Software,
        WATCHDOG => ResetReason::Watchdog,
        // Nothing that runs here has reset it.
        RUNNING => ResetReason::Pin,
        _ => ResetReason::PowerOn,
    }
}

/// Resets the processor because it was asked to. No exchange with the plant is under way then: it belongs to an interrupt, and the
/// main loop, which is here, does not run while there is one.
pub(crate) fn reset() -> ! {
    cortex_m::interrupt::disable();
    mark().store(SOFTWARE, Ordering::Relaxed);
    SCB::sys_reset()
}

/// Starts the watchdog.
pub(crate) fn start_watchdog() -> Watchdog {
    Watchdog::start(WATCHDOG_PERIOD_S * CLOCK_HZ)
}

/// The watchdog has run down; it would reset by itself after another period, leaving no mark.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() -> ! {
    mark().store(WATCHDOG, Ordering::Relaxed);
    SCB::sys_reset()
}
