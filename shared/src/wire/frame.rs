//! Frames: postcard, CRC-32 behind it, COBS around both, ended by a zero byte.

use core::fmt;

use postcard::ser_flavors::crc::CrcModifier;
use postcard::ser_flavors::{Cobs, Slice};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::crc32::{crc32, crc32_digest};

/// A message of so many bytes as postcard always fits into a frame.
pub const MAX_PAYLOAD: usize = 1024;
const CRC_BYTES: usize = 4;
/// The most bytes of a frame: COBS adds one byte for every 254 and one more, and the zero ends it.
pub const MAX_FRAME: usize = cobs::max_encoding_length(MAX_PAYLOAD + CRC_BYTES) + 1;

/// A message that does not fit into a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameError;

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the message does not fit into a frame of {MAX_FRAME} bytes")
    }
}

impl core::error::Error for FrameError {}

/// Writes `message` as a frame, its zero byte included, into `buffer`; returns the frame.
///
/// # Errors
/// [`FrameError`] when the message does not fit; with [`MAX_PAYLOAD`] bytes or fewer it always does. A few more pass when zeros
/// among them leave COBS less to add, and are read like any other.
pub fn encode<'a, T: Serialize + ?Sized>(message: &T, buffer: &'a mut [u8; MAX_FRAME]) -> Result<&'a [u8], FrameError> {
    let cobs = Cobs::try_new(Slice::new(buffer)).map_err(|_| FrameError)?;
    let frame = postcard::serialize_with_flavor(message, CrcModifier::new(cobs, crc32_digest()));
    frame.map(|frame| &*frame).map_err(|_| FrameError)
}

/// The message of a frame's payload; `None` when the payload is not exactly one message.
pub fn decode<T: DeserializeOwned>(payload: &[u8]) -> Option<T> {
    match postcard::take_from_bytes(payload) {
        Ok((message, [])) => Some(message),
        _ => None,
    }
}

/// Why a frame was thrown away.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameFault {
    /// More bytes than any frame has came without a zero.
    Overlong,
    /// Not COBS, or too short to hold a CRC.
    Malformed,
    /// The CRC does not fit.
    Crc,
}

/// Frames by their fate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameCounts {
    /// Whole ones.
    pub good: u32,
    /// Thrown away: overlong.
    pub overlong: u32,
    /// Thrown away: malformed.
    pub malformed: u32,
    /// Thrown away: wrong CRC.
    pub crc: u32,
}

impl FrameCounts {
    /// All that were thrown away.
    pub fn thrown_away(&self) -> u32 {
        self.overlong.wrapping_add(self.malformed).wrapping_add(self.crc)
    }
}

/// Finds frames in a stream of bytes. After damage it is in step again at the next zero byte.
#[derive(Clone, Debug)]
pub struct FrameReader {
    buffer: [u8; MAX_FRAME],
    length: usize,
    is_overlong: bool,
    counts: FrameCounts,
}

impl Default for FrameReader {
    fn default() -> Self {
        Self::new()
    }
}

impl FrameReader {
    /// A reader at the beginning of a frame.
    pub const fn new() -> Self {
        let counts = FrameCounts { good: 0, overlong: 0, malformed: 0, crc: 0 };
        Self { buffer: [0; MAX_FRAME], length: 0, is_overlong: false, counts }
    }

    /// Takes one byte. At the end of a frame it returns the payload, or why there is none. Nothing between two zeros is no frame
    /// and no fault: an end that begins to speak may send a zero first.
    pub fn push(&mut self, byte: u8) -> Option<Result<&[u8], FrameFault>> {
        if byte != 0 {
            match self.buffer.get_mut(self.length) {
                Some(place) => {
                    *place = byte;
                    self.length += 1;
                }
                None => self.is_overlong = true,
            }
            return None;
        }
        let length = core::mem::take(&mut self.length);
        if core::mem::take(&mut self.is_overlong) {
            self.counts.overlong = self.counts.overlong.wrapping_add(1);
            return Some(Err(FrameFault::Overlong));
        }
        if length == 0 {
            return None;
        }
        Some(match unpack(&mut self.buffer[..length]) {
            Ok(payload_length) => {
                self.counts.good = self.counts.good.wrapping_add(1);
                Ok(&self.buffer[..payload_length])
            }
            Err(fault) => {
                let count = if fault == FrameFault::Crc { &mut self.counts.crc } else { &mut self.counts.malformed };
                *count = count.wrapping_add(1);
                Err(fault)
            }
        })
    }

    /// How many frames there were, and of what kind.
    pub fn counts(&self) -> FrameCounts {
        self.counts
    }
}

/// Undoes COBS in place and checks the CRC; returns the payload's length.
fn unpack(frame: &mut [u8]) -> Result<usize, FrameFault> {
    let length = cobs::decode_in_place(frame).map_err(|_| FrameFault::Malformed)?;
    let (payload, crc) = frame[..length].split_last_chunk::<CRC_BYTES>().ok_or(FrameFault::Malformed)?;
    if crc32(payload) == u32::from_le_bytes(*crc) { Ok(payload.len()) } else { Err(FrameFault::Crc) }
}
