//! What the firmware said before it gave up, kept over the reset in memory that the start-up code leaves alone.

use core::fmt::{self, Write};

use ballbar::crc32;
use heapless::String;

/// Bytes of the message that are kept.
const MESSAGE_BYTES: usize = 96;

/// A message and its CRC. After power-on the memory holds anything; the CRC tells.
#[repr(C)]
pub struct CrashRecord {
    length: u32,
    message: [u8; MESSAGE_BYTES],
    crc: u32,
}

impl CrashRecord {
    /// Holds nothing.
    pub const fn empty() -> Self {
        Self { length: 0, message: [0; MESSAGE_BYTES], crc: 0 }
    }

    /// Keeps a message, cut off where it does not fit.
    pub fn store(&mut self, message: fmt::Arguments<'_>) {
        let mut writer = Writer { bytes: &mut self.message, length: 0 };
        let _ = writer.write_fmt(message);
        self.length = writer.length as u32;
        self.crc = self.expected_crc();
    }

    /// The message that was stored before the reset, once.
    pub fn take(&mut self) -> Option<String<MESSAGE_BYTES>> {
        let is_valid = self.length > 0 && self.crc == self.expected_crc();
        let bytes = self.message.get(..self.length as usize).filter(|_| is_valid);
        // Bytes of a character that was cut in two are left out.
        let text = bytes.and_then(|bytes| match core::str::from_utf8(bytes) {
            Ok(text) => Some(text),
            Err(error) => core::str::from_utf8(&bytes[..error.valid_up_to()]).ok(),
        });
        let message = text.and_then(|text| String::try_from(text).ok());
        *self = Self::empty();
        message
    }

    fn expected_crc(&self) -> u32 {
        // An empty record of zeros must not pass for one, nor a message for another length of it.
        crc32(&self.message) ^ self.length ^ 0x4352_4153
    }
}

struct Writer<'a> {
    bytes: &'a mut [u8; MESSAGE_BYTES],
    length: usize,
}

impl Write for Writer<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for (place, byte) in self.bytes[self.length..].iter_mut().zip(text.bytes()) {
            *place = byte;
            self.length += 1;
        }
        Ok(())
    }
}
