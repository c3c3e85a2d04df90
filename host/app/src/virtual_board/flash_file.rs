//! Flash that a file keeps over the end of the program.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use ballbar_firmware::{MemoryFlash, MemoryFlashError, ParameterFlash};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use thiserror::Error;

use crate::files::write_atomically_with;

type Memory = MemoryFlash<Vec<u8>>;

/// Flash in memory, and in a file where one was named: the file is replaced, by rename, after every erase and write.
pub(super) struct FlashFile {
    memory: Memory,
    path: Option<PathBuf>,
}

/// Why the flash did not do what was asked.
#[derive(Debug, Error)]
pub(super) enum FlashFileError {
    /// An access outside the memory or its words.
    #[error(transparent)]
    Access(#[from] MemoryFlashError),
    /// The file could not be written.
    #[error("the flash's file cannot be written: {0}")]
    File(#[from] io::Error),
}

impl NorFlashError for FlashFileError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Access(error) => error.kind(),
            Self::File(_) => NorFlashErrorKind::Other,
        }
    }
}

impl FlashFile {
    /// Flash with the file's content; erased when there is no file yet, or none was named.
    #[expect(clippy::disallowed_methods, reason = "the flash keeps this file for itself, and replaces it")]
    pub(super) fn open(path: Option<&Path>) -> io::Result<Self> {
        let bytes = match path.map(std::fs::read) {
            Some(Ok(bytes)) if bytes.len() == Memory::BYTES => bytes,
            Some(Ok(bytes)) => {
                let message = format!("it has {} bytes, a virtual board's flash has {}", bytes.len(), Memory::BYTES);
                return Err(io::Error::new(io::ErrorKind::InvalidData, message));
            }
            Some(Err(error)) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => vec![0xff; Memory::BYTES],
        };
        let flash = Self { memory: Memory::new(bytes), path: path.map(Path::to_owned) };
        // A file that cannot be written is to be known now and not at the first commit.
        flash.save()?;
        Ok(flash)
    }

    fn save(&self) -> io::Result<()> {
        let Some(path) = &self.path else { return Ok(()) };
        write_atomically_with(path, |file| file.write_all(self.memory.memory())).map_err(io::Error::other)
    }
}

impl ErrorType for FlashFile {
    type Error = FlashFileError;
}

impl ReadNorFlash for FlashFile {
    const READ_SIZE: usize = <Memory as ReadNorFlash>::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashFileError> {
        Ok(self.memory.read(offset, bytes)?)
    }

    fn capacity(&self) -> usize {
        self.memory.capacity()
    }
}

impl NorFlash for FlashFile {
    const WRITE_SIZE: usize = <Memory as NorFlash>::WRITE_SIZE;
    const ERASE_SIZE: usize = <Memory as NorFlash>::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashFileError> {
        self.memory.erase(from, to)?;
        Ok(self.save()?)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashFileError> {
        self.memory.write(offset, bytes)?;
        Ok(self.save()?)
    }
}

impl ParameterFlash for FlashFile {
    const STALLS_SAMPLING: bool = Memory::STALLS_SAMPLING;
    const SLOT_BYTES: u32 = Memory::SLOT_BYTES;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_holds_what_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flash.bin");
        FlashFile::open(Some(&path)).unwrap().write(4, b"word").unwrap();
        let mut bytes = [0; 8];
        FlashFile::open(Some(&path)).unwrap().read(2, &mut bytes).unwrap();
        assert_eq!(&bytes, b"\xff\xffword\xff\xff");
    }

    #[test]
    fn a_file_of_another_size_is_refused_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notes.txt");
        std::fs::write(&path, "something else").unwrap();
        assert!(FlashFile::open(Some(&path)).is_err());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "something else");
    }
}
