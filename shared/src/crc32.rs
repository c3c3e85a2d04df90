//! The one checksum of the project: CRC-32 of Ethernet and zip, on the wire, in flash and over crash records.

use crc::{CRC_32_ISO_HDLC, Crc, Digest, Table};

static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// CRC-32 of `bytes`.
pub fn crc32(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// CRC-32 of bytes that come piece by piece.
pub fn crc32_digest() -> Digest<'static, u32, Table<1>> {
    CRC.digest()
}
