//! A NOR flash that loses its power, fails, and refuses what NOR flash cannot do.

use ballbar_firmware::ParameterFlash;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Bytes of an erase block.
const BLOCK: usize = 512;
/// Two slots of three blocks: a slot just holds the longest image and all renewals.
const SLOT: usize = 3 * BLOCK;

/// What a cut leaves of the operation that it ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Debris {
    /// The byte under way is a mixture of its bits before and after; all behind it is as it was.
    OneByte,
    /// Every bit of the rest, either as before or as after.
    Mixture,
    /// Every bit of the rest anything.
    Random,
}

impl Debris {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::OneByte, Self::Mixture, Self::Random];
}

/// What the flash does to those who use it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// Nothing.
    None,
    /// The power fails after this many bytes were erased or written, and all behind is refused.
    CutAfter {
        /// Bytes that are still erased or written.
        bytes: usize,
        /// What is left of the operation.
        debris: Debris,
    },
    /// There is no power: everything ends with an error.
    Off,
    /// Erasing ends with an error.
    Erase,
    /// Writing ends with an error, from this word on.
    Write {
        /// Words written before.
        words: usize,
    },
    /// Writing is said to succeed and leaves one bit as it was.
    StuckBit,
    /// Reading ends with an error.
    Read,
}

/// Two slots of flash with words of `WORD` bytes.
#[derive(Clone)]
pub struct MockFlash<const WORD: usize> {
    /// What stands in it.
    pub memory: [u8; 2 * SLOT],
    /// What it does next.
    pub trouble: Trouble,
    /// Bytes erased or written so far.
    pub bytes_changed: usize,
    is_erased: [bool; 2 * SLOT],
    rng: ChaCha8Rng,
}

/// Why an operation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MockError;

impl NorFlashError for MockError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl<const WORD: usize> MockFlash<WORD> {
    /// Bytes in all.
    pub const BYTES: usize = 2 * SLOT;

    /// As it comes from the factory.
    pub fn new(seed: u64) -> Self {
        Self {
            memory: [0xff; 2 * SLOT],
            trouble: Trouble::None,
            bytes_changed: 0,
            is_erased: [true; 2 * SLOT],
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// How many of `wanted` bytes the power lasts for.
    fn lasts_for(&mut self, wanted: usize) -> usize {
        let done = match &mut self.trouble {
            Trouble::CutAfter { bytes, .. } => {
                let done = wanted.min(*bytes);
                *bytes -= done;
                done
            }
            _ => wanted,
        };
        self.bytes_changed += done;
        done
    }

    /// Leaves debris in the bytes from `start` on, which were to become `target`.
    fn cut(&mut self, start: usize, target: &[u8]) -> MockError {
        let Trouble::CutAfter { debris, .. } = core::mem::replace(&mut self.trouble, Trouble::Off) else { return MockError };
        let length = if debris == Debris::OneByte { 1 } else { target.len() };
        for (cell, target) in self.memory[start..].iter_mut().zip(&target[..length]) {
            let random = self.rng.next_u32() as u8;
            *cell = if debris == Debris::Random { random } else { (*cell & random) | (target & !random) };
        }
        // A word that still reads as erased can be written like one: nobody can tell them apart.
        for byte in start..start + length {
            let word = byte / WORD * WORD;
            self.is_erased[byte] = self.memory[word..word + WORD] == [0xff; WORD];
        }
        MockError
    }
}

impl<const WORD: usize> ErrorType for MockFlash<WORD> {
    type Error = MockError;
}

impl<const WORD: usize> ReadNorFlash for MockFlash<WORD> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), MockError> {
        check_read(self, offset, bytes.len()).expect("a read outside the flash");
        if matches!(self.trouble, Trouble::Read | Trouble::Off) {
            return Err(MockError);
        }
        bytes.copy_from_slice(&self.memory[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.memory.len()
    }
}

impl<const WORD: usize> NorFlash for MockFlash<WORD> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = BLOCK;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), MockError> {
        check_erase(self, from, to).expect("an erase of something else than blocks");
        if matches!(self.trouble, Trouble::Erase | Trouble::Off) {
            return Err(MockError);
        }
        for start in (from as usize..to as usize).step_by(BLOCK) {
            let done = self.lasts_for(BLOCK);
            self.memory[start..start + done].fill(0xff);
            self.is_erased[start..start + done].fill(true);
            if done < BLOCK {
                return Err(self.cut(start + done, &[0xff; BLOCK][done..]));
            }
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), MockError> {
        check_write(self, offset, bytes.len()).expect("a write of something else than words");
        let start = offset as usize;
        assert!(self.is_erased[start..start + bytes.len()].iter().all(|&erased| erased), "a write to words that are not erased");
        let wanted = match self.trouble {
            Trouble::Off => 0,
            Trouble::Write { words } => bytes.len().min(words * WORD),
            _ => bytes.len(),
        };
        let done = self.lasts_for(wanted);
        self.memory[start..start + done].copy_from_slice(&bytes[..done]);
        self.is_erased[start..start + done].fill(false);
        if self.trouble == Trouble::StuckBit {
            self.memory[start] |= 1 << bytes[0].trailing_ones().min(7);
        }
        match self.trouble {
            Trouble::Write { .. } | Trouble::Off if done < bytes.len() => Err(MockError),
            _ if done < bytes.len() => Err(self.cut(start + done, &bytes[done..])),
            _ => Ok(()),
        }
    }
}

impl<const WORD: usize> ParameterFlash for MockFlash<WORD> {
    const STALLS_SAMPLING: bool = true;
    const SLOT_BYTES: u32 = SLOT as u32;
}
