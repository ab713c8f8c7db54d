//! CRC-32 (ISO HDLC, the one of Ethernet and zip) with one table of 1 KiB.
//!
//! Without the table it would be some eight times slower at every start; with sixteen tables of 1 KiB it would be faster
//! than the flash can be read.

use crc::{CRC_32_ISO_HDLC, Crc, Digest};

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// A CRC in the making.
pub(crate) fn begin() -> Digest<'static, u32> {
    CRC.digest()
}

/// The CRC of `bytes`.
pub(crate) fn of(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}
