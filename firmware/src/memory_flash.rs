//! Flash made of memory, for boards that have none to spare and for the host.

use core::fmt;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

use crate::ParameterFlash;

/// Two slots of memory that behaves as NOR flash: an erase sets a block to ones, a write only clears bits.
pub struct MemoryFlash<M> {
    memory: M,
}

/// An access outside the memory or its words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryFlashError(NorFlashErrorKind);

impl fmt::Display for MemoryFlashError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl core::error::Error for MemoryFlashError {}

impl NorFlashError for MemoryFlashError {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

impl<M: AsRef<[u8]> + AsMut<[u8]>> MemoryFlash<M> {
    /// Bytes of memory that the flash needs.
    pub const BYTES: usize = 2 * Self::SLOT;
    const SLOT: usize = 2048;

    /// Flash in `memory`, with what stands in it.
    pub fn new(memory: M) -> Self {
        Self { memory }
    }

    /// The memory.
    pub fn memory(&self) -> &M {
        &self.memory
    }
}

impl<M> ErrorType for MemoryFlash<M> {
    type Error = MemoryFlashError;
}

impl<M: AsRef<[u8]> + AsMut<[u8]>> ReadNorFlash for MemoryFlash<M> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        check_read(self, offset, bytes.len()).map_err(MemoryFlashError)?;
        let start = offset as usize;
        bytes.copy_from_slice(&self.memory.as_ref()[start..start + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.memory.as_ref().len()
    }
}

impl<M: AsRef<[u8]> + AsMut<[u8]>> NorFlash for MemoryFlash<M> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = Self::SLOT;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        check_erase(self, from, to).map_err(MemoryFlashError)?;
        self.memory.as_mut()[from as usize..to as usize].fill(0xff);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        check_write(self, offset, bytes.len()).map_err(MemoryFlashError)?;
        for (cell, byte) in self.memory.as_mut()[offset as usize..].iter_mut().zip(bytes) {
            *cell &= byte;
        }
        Ok(())
    }
}

impl<M: AsRef<[u8]> + AsMut<[u8]>> ParameterFlash for MemoryFlash<M> {
    const STALLS_SAMPLING: bool = false;
    const SLOT_BYTES: u32 = Self::SLOT as u32;
}
