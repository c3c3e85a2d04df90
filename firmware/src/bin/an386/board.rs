//! The slow side's hardware, put together.

#![allow(unsafe_code)] // memory that plays the flash

use core::convert::Infallible;
use core::slice;

use ballbar::wire::ResetReason;
use ballbar_firmware::{BoardFacts, Hardware, MemoryFlash};
use embedded_hal::digital::{ErrorType, OutputPin};

use crate::pac::{self, Watchdog};
use crate::serial::SerialLink;
use crate::{reset, sampling, stack};

type Flash = MemoryFlash<&'static mut [u8]>;

/// Everything that the main loop owns.
pub(crate) struct An386 {
    link: SerialLink,
    flash: Flash,
    lamp: Lamp,
    watchdog: Watchdog,
}

impl An386 {
    /// Takes over hardware that was started. There must be one at a time: the flash is one and the same memory.
    pub(crate) fn new(link: SerialLink, watchdog: Watchdog, reset_reason: &ResetReason) -> Self {
        Self { link, flash: flash(*reset_reason == ResetReason::PowerOn), lamp: Lamp { is_on: None }, watchdog }
    }
}

/// The PSRAM, which a reset leaves as it is. At power-on it is erased, as flash is when it comes from the shelf.
fn flash(is_new: bool) -> Flash {
    const PSRAM: usize = 0x2100_0000;
    // SAFETY: the linker places nothing there, and this is called once.
    let memory = unsafe { slice::from_raw_parts_mut(PSRAM as *mut u8, Flash::BYTES) };
    if is_new {
        memory.fill(0xff);
    }
    Flash::new(memory)
}

impl Hardware for An386 {
    type Link = SerialLink;
    type Flash = Flash;
    type Lamp = Lamp;

    fn facts(&self) -> BoardFacts {
        // A latch is one moment of the plant, and the LVDT's code is that of the same moment.
        BoardFacts { name: "an386", unique_id: *b"emulated    ", encoder_skew_ns: 0, lvdt_delay_ns: 0 }
    }

    fn link(&mut self) -> &mut SerialLink {
        &mut self.link
    }

    fn flash(&mut self) -> &mut Flash {
        &mut self.flash
    }

    fn lamp(&mut self) -> &mut Lamp {
        &mut self.lamp
    }

    fn set_rate_hz(&mut self, rate_hz: u16) {
        sampling::set_rate_hz(rate_hz);
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.feed();
    }

    fn reset(&mut self) {
        reset::reset();
    }

    fn stack_unused_bytes(&self) -> u32 {
        stack::unused_bytes()
    }
}

/// The board's first lamp, written only when it changes: an access to a register is slow in the emulator.
pub(crate) struct Lamp {
    is_on: Option<bool>,
}

impl Lamp {
    fn set(&mut self, is_on: bool) {
        if self.is_on.replace(is_on) != Some(is_on) {
            pac::set_lamps(is_on.into());
        }
    }
}

impl ErrorType for Lamp {
    type Error = Infallible;
}

impl OutputPin for Lamp {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.set(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.set(true);
        Ok(())
    }
}
