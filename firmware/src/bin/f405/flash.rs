//! The two parameter slots: sectors 1 and 2 of the flash, 16 KiB each, behind the vector table's sector 0.
//!
//! Written on the registers: stm32f4xx-hal's driver erases with 8-bit parallelism, for 0.4 to 0.8 s, and counts in sectors of 128
//! KiB. With 32 bits (supply of 2.7 V or more) an erase takes 250 ms, at most 500 ms, and a word 16 µs, at most 100 µs
//! (datasheet).
//!
//! The program is fetched from the same bank, so the processor stands still for that time: no sampling interrupt runs, and the
//! clock's and the counters' extension have to bridge the gap (`clock.rs`; a 16-bit counter may move by 32,767 counts in it,
//! which no joint of a PUMA 560 does in 0.5 s). DMA, timers and watchdog go on.

#![allow(unsafe_code)] // memory-mapped flash

use core::ptr;

use ballbar_firmware::ParameterFlash;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};
use stm32f4xx_hal::pac::FLASH;

/// `memory.x` keeps the program off these addresses.
const SLOTS_ADDRESS: usize = 0x0800_4000;
const FIRST_SECTOR: u8 = 1;
const SECTOR_BYTES: usize = 16 * 1024;
const SECTORS: usize = 2;
const WORD_BYTES: usize = 4;

/// Why the flash did not do what it was told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FlashError {
    /// Outside of the slots, or not whole sectors or words.
    Range(NorFlashErrorKind),
    /// The controller did not unlock; only a reset lets it try again.
    Locked,
    /// The sector is write-protected by the option bytes.
    WriteProtected,
    /// The controller refused the sequence, the width or the alignment of a write.
    Refused,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Range(kind) => *kind,
            Self::Locked | Self::WriteProtected | Self::Refused => NorFlashErrorKind::Other,
        }
    }
}

/// The slots; offset 0 is the first byte of the first slot.
pub(crate) struct SlotFlash {
    registers: FLASH,
}

impl SlotFlash {
    /// Nothing is touched until the first erase or write.
    pub(crate) fn new(registers: FLASH) -> Self {
        Self { registers }
    }

    /// Runs one operation between unlocking and locking the controller, and says how it went.
    fn unlocked(&mut self, operation: impl FnOnce(&FLASH) -> Result<(), FlashError>) -> Result<(), FlashError> {
        const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
        // Keys to a controller that is open would lock it until the next reset.
        if self.registers.cr().read().lock().is_locked() {
            for key in KEYS {
                self.registers.keyr().write(|w| w.key().set(key));
            }
        }
        if self.registers.cr().read().lock().is_locked() {
            return Err(FlashError::Locked);
        }
        wait(&self.registers);
        clear_errors(&self.registers);
        let outcome = operation(&self.registers);
        lock(&self.registers);
        outcome
    }
}

// The control register is only ever modified: its reset value, which a plain write starts from, has LOCK set.

/// Says what is to come; nothing begins yet.
fn set_up(registers: &FLASH, operation: Operation) {
    registers.cr().modify(|_, w| {
        w.psize().psize32();
        w.mer().clear_bit();
        w.pg().bit(operation == Operation::Program);
        match operation {
            Operation::Program => w.ser().clear_bit(),
            // SAFETY: the number of a sector, and none that holds any of the program (`erase`).
            Operation::Erase(sector) => unsafe { w.ser().set_bit().snb().bits(sector) },
        }
    });
}

/// What the controller can be set up for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Operation {
    /// Words that are written to memory.
    Program,
    /// A sector, once it is started.
    Erase(u8),
}

/// Leaves the controller as a reset does. In two steps, so that it never has to take LOCK together with an operation.
fn lock(registers: &FLASH) {
    registers.cr().modify(|_, w| {
        w.psize().psize8();
        w.pg().clear_bit();
        w.ser().clear_bit();
        // SAFETY: any number is one that the register takes.
        unsafe { w.snb().bits(0) }
    });
    registers.cr().modify(|_, w| w.lock().locked());
}

fn wait(registers: &FLASH) {
    while registers.sr().read().bsy().is_busy() {}
}

/// Waits for the controller and reads what it has to complain of.
fn finish(registers: &FLASH) -> Result<(), FlashError> {
    wait(registers);
    let status = registers.sr().read();
    if status.wrperr().is_active() {
        Err(FlashError::WriteProtected)
    } else if status.pgserr().is_active()
        || status.pgperr().is_active()
        || status.pgaerr().is_active()
        || status.operr().is_active()
    {
        Err(FlashError::Refused)
    } else {
        Ok(())
    }
}

/// An error of before would be taken for one of now.
fn clear_errors(registers: &FLASH) {
    registers.sr().write(|w| {
        w.operr().clear();
        w.wrperr().clear();
        w.pgaerr().clear();
        w.pgperr().clear();
        w.pgserr().clear()
    });
}

/// An erased sector may still stand in the data cache as it was (RM0090, 3.5.3); it may only be reset while it is off.
fn reset_data_cache(registers: &FLASH) {
    registers.acr().modify(|_, w| w.dcen().disabled());
    registers.acr().modify(|_, w| w.dcrst().reset());
    registers.acr().modify(|_, w| w.dcrst().no_reset());
    registers.acr().modify(|_, w| w.dcen().enabled());
}

impl ErrorType for SlotFlash {
    type Error = FlashError;
}

impl ReadNorFlash for SlotFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len()).map_err(FlashError::Range)?;
        for (address, byte) in (SLOTS_ADDRESS + offset as usize..).zip(bytes) {
            // SAFETY: within the slots, as was checked; volatile, because erases and writes change them.
            *byte = unsafe { ptr::read_volatile(address as *const u8) };
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        SECTORS * SECTOR_BYTES
    }
}

impl NorFlash for SlotFlash {
    const WRITE_SIZE: usize = WORD_BYTES;
    const ERASE_SIZE: usize = SECTOR_BYTES;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to).map_err(FlashError::Range)?;
        self.unlocked(|registers| {
            for sector in from as usize / SECTOR_BYTES..to as usize / SECTOR_BYTES {
                set_up(registers, Operation::Erase(FIRST_SECTOR + sector as u8));
                registers.cr().modify(|_, w| w.strt().start());
                let outcome = finish(registers);
                reset_data_cache(registers);
                outcome?;
            }
            Ok(())
        })
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len()).map_err(FlashError::Range)?;
        self.unlocked(|registers| {
            set_up(registers, Operation::Program);
            let (words, _) = bytes.as_chunks::<WORD_BYTES>();
            for (i, word) in words.iter().enumerate() {
                let address = SLOTS_ADDRESS + offset as usize + i * WORD_BYTES;
                // SAFETY: a whole aligned word within the slots, as was checked, and the controller is set to take words.
                unsafe { ptr::write_volatile(address as *mut u32, u32::from_le_bytes(*word)) };
                cortex_m::asm::dsb(); // by another bus than the controller's registers: it must have arrived before they are asked
                finish(registers)?;
            }
            Ok(())
        })
    }
}

impl ParameterFlash for SlotFlash {
    const STALLS_SAMPLING: bool = true;
    const SLOT_BYTES: u32 = SECTOR_BYTES as u32;
}
