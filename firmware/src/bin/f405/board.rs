//! The slow side's hardware, put together.

#![allow(unsafe_code)] // the unique number, and the linker's bounds of the stack

use core::ops::Range;
use core::ptr;

use ballbar_firmware::{BoardFacts, Hardware};
use cortex_m::peripheral::SCB;
use stm32f4xx_hal::watchdog::IndependentWatchdog;

use crate::encoders;
use crate::flash::SlotFlash;
use crate::link::SerialLink;
use crate::lvdt;
use crate::pins::Lamp;
use crate::sampling::SamplingTimer;

/// Everything that the main loop owns.
pub(crate) struct F405 {
    link: SerialLink,
    flash: SlotFlash,
    lamp: Lamp,
    timer: SamplingTimer,
    watchdog: IndependentWatchdog,
}

impl F405 {
    /// Takes over hardware that was started.
    pub(crate) fn new(
        link: SerialLink,
        flash: SlotFlash,
        lamp: Lamp,
        timer: SamplingTimer,
        watchdog: IndependentWatchdog,
    ) -> Self {
        Self { link, flash, lamp, timer, watchdog }
    }
}

impl Hardware for F405 {
    type Link = SerialLink;
    type Flash = SlotFlash;
    type Lamp = Lamp;

    fn facts(&self) -> BoardFacts {
        BoardFacts { name: "f405", unique_id: unique_id(), encoder_skew_ns: encoders::SKEW_NS, lvdt_delay_ns: lvdt::DELAY_NS }
    }

    fn link(&mut self) -> &mut SerialLink {
        &mut self.link
    }

    fn flash(&mut self) -> &mut SlotFlash {
        &mut self.flash
    }

    fn lamp(&mut self) -> &mut Lamp {
        &mut self.lamp
    }

    fn set_rate_hz(&mut self, rate_hz: u16) {
        self.timer.set_rate_hz(rate_hz);
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.feed();
    }

    fn reset(&mut self) {
        SCB::sys_reset();
    }

    fn stack_unused_bytes(&self) -> u32 {
        const WORD_BYTES: usize = 4;
        let words = stack().step_by(WORD_BYTES);
        // SAFETY: aligned words of the stack's own memory, which the start-up code painted.
        let untouched =
            words.take_while(|&word| unsafe { ptr::read_volatile(word as *const u32) } == cortex_m_rt::STACK_PAINT_VALUE);
        (untouched.count() * WORD_BYTES) as u32
    }
}

/// The 96 bits that tell this chip from every other (RM0090, 39.1).
fn unique_id() -> [u8; 12] {
    const ADDRESS: usize = 0x1FFF_7A10;
    // SAFETY: read-only memory of every chip of this family.
    unsafe { ptr::read_volatile(ADDRESS as *const [u8; 12]) }
}

/// Addresses of the stack.
fn stack() -> Range<usize> {
    unsafe extern "C" {
        static _stack_start: u32;
        static _stack_end: u32;
    }
    // "Start" is where the stack starts, at the top.
    ptr::addr_of!(_stack_end) as usize..ptr::addr_of!(_stack_start) as usize
}
