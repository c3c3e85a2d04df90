//! The registers of Arm's MPS2 AN386 that this firmware uses. Addresses and bits: Arm DAI 0386 and the Cortex-M System Design Kit's
//! reference manual (DDI 0479), chapters on the APB UART, timer and watchdog.

#![allow(unsafe_code)] // memory-mapped registers, and the vector table

use core::ptr;

/// Bits of an interrupt's priority.
pub(crate) const NVIC_PRIO_BITS: u8 = 3;

/// Frequency of the peripherals' clock.
pub(crate) const CLOCK_HZ: u32 = 25_000_000;

/// The interrupts in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
#[expect(non_camel_case_types, reason = "RTIC looks for the names of Arm's manual")]
pub(crate) enum Interrupt {
    /// The link has received a byte.
    UART0_RX = 0,
    /// The sampling timer has run down.
    TIMER0 = 8,
}

pub(crate) use Interrupt as interrupt;

// SAFETY: the numbers are those of the vector table below.
unsafe impl cortex_m::interrupt::InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

unsafe extern "C" {
    fn UART0_RX();
    fn TIMER0();
    fn DefaultHandler();
}

/// The handlers of the interrupts, in order; the program starts with the processor's own vectors before them.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [unsafe extern "C" fn(); 32] = {
    let mut vectors: [unsafe extern "C" fn(); 32] = [DefaultHandler; 32];
    vectors[Interrupt::UART0_RX as usize] = UART0_RX;
    vectors[Interrupt::TIMER0 as usize] = TIMER0;
    vectors
};

/// A 32-bit register.
#[derive(Clone, Copy)]
struct Register(usize);

impl Register {
    fn read(self) -> u32 {
        // SAFETY: only this module makes registers, of addresses in the manual.
        unsafe { ptr::read_volatile(self.0 as *const u32) }
    }

    fn write(self, value: u32) {
        // SAFETY: as above.
        unsafe { ptr::write_volatile(self.0 as *mut u32, value) }
    }
}

/// An APB UART.
pub(crate) struct Uart {
    base: usize,
}

/// The link to the host.
pub(crate) const LINK_UART: Uart = Uart { base: 0x4000_4000 };
/// The line to the simulated plant.
pub(crate) const PLANT_UART: Uart = Uart { base: 0x4000_5000 };

impl Uart {
    const TX_FULL: u32 = 1;
    const RX_FULL: u32 = 1 << 1;
    const RX_INTERRUPT: u32 = 1 << 1;
    const ENABLE_BOTH: u32 = 0b11;
    const ENABLE_RX_INTERRUPT: u32 = 1 << 3;
    /// The smallest that enables anything; the emulator does not model the rate.
    const BAUD_DIVIDER: u32 = 16;

    /// Enables both directions.
    pub(crate) fn start(&self, with_rx_interrupt: bool) {
        self.register(0x10).write(Self::BAUD_DIVIDER);
        let interrupt = if with_rx_interrupt { Self::ENABLE_RX_INTERRUPT } else { 0 };
        self.register(0x08).write(Self::ENABLE_BOTH | interrupt);
        // The emulator looks for bytes from outside when this register is read; that there is a receiver now, it does not notice.
        self.register(0x00).read();
    }

    /// Whether a byte can be written.
    pub(crate) fn has_room(&self) -> bool {
        self.register(0x04).read() & Self::TX_FULL == 0
    }

    /// Writes a byte, waiting for room.
    pub(crate) fn write(&self, byte: u8) {
        while !self.has_room() {}
        self.register(0x00).write(u32::from(byte));
    }

    /// Reads a byte, waiting for one.
    pub(crate) fn read(&self) -> u8 {
        while self.register(0x04).read() & Self::RX_FULL == 0 {}
        self.register(0x00).read() as u8
    }

    /// Clears the interrupt that says that a byte has come.
    pub(crate) fn clear_rx_interrupt(&self) {
        self.register(0x0C).write(Self::RX_INTERRUPT);
    }

    fn register(&self, offset: usize) -> Register {
        Register(self.base + offset)
    }
}

/// An APB timer: counts down at [`CLOCK_HZ`].
pub(crate) struct Timer {
    base: usize,
}

/// The sampling timer.
pub(crate) const SAMPLING_TIMER: Timer = Timer { base: 0x4000_0000 };
/// The timer that never stops.
pub(crate) const FREE_TIMER: Timer = Timer { base: 0x4000_1000 };

impl Timer {
    const ENABLE: u32 = 1;
    const ENABLE_INTERRUPT: u32 = 1 << 3;

    /// Counts for ever.
    pub(crate) fn start_free(&self) {
        self.register(0x08).write(u32::MAX);
        self.register(0x04).write(u32::MAX);
        self.register(0x00).write(Self::ENABLE);
    }

    /// Interrupts once, after so many counts.
    pub(crate) fn start_once(&self, counts: u32) {
        self.register(0x08).write(0);
        self.set_once(counts);
        // Behind the value: the emulator complains of a timer that is enabled at zero.
        self.register(0x00).write(Self::ENABLE | Self::ENABLE_INTERRUPT);
    }

    /// As [`Timer::start_once`], when it was started before.
    pub(crate) fn set_once(&self, counts: u32) {
        self.register(0x04).write(counts);
    }

    /// Counts since the start of one that counts for ever, wrapping.
    pub(crate) fn elapsed(&self) -> u32 {
        !self.register(0x04).read()
    }

    /// Clears the interrupt.
    pub(crate) fn clear_interrupt(&self) {
        self.register(0x0C).write(1);
    }

    fn register(&self, offset: usize) -> Register {
        Register(self.base + offset)
    }
}

/// The APB watchdog, which raises the non-maskable interrupt when it has run down, and resets when it has a second time.
pub(crate) struct Watchdog;

impl Watchdog {
    const LOAD: Register = Register(0x4000_8000);
    const CONTROL: Register = Register(0x4000_8008);
    const CLEAR: Register = Register(0x4000_800C);
    const LOCK: Register = Register(0x4000_8C00);
    const KEY: u32 = 0x1ACC_E551;
    const ENABLE_INTERRUPT_AND_RESET: u32 = 0b11;

    /// Starts it.
    pub(crate) fn start(counts: u32) -> Self {
        Self::LOCK.write(Self::KEY);
        Self::LOAD.write(counts);
        Self::CONTROL.write(Self::ENABLE_INTERRUPT_AND_RESET);
        Self
    }

    /// Begins the time anew.
    pub(crate) fn feed(&self) {
        Self::CLEAR.write(1);
    }
}

/// The board's two lamps.
pub(crate) fn set_lamps(bits: u32) {
    Register(0x4002_8000).write(bits);
}
