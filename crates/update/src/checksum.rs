//! CRC-32 (ISO HDLC, the one of Ethernet and zip), bit by bit: the bootloader has no kilobyte for a table. It is the larger
//! part of what a start takes; docs/update.md has the figures.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

static CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// A CRC in the making.
pub(crate) type Digest = crc::Digest<'static, u32, NoTable>;

/// The CRC of nothing yet.
pub(crate) fn begin() -> Digest {
    CRC.digest()
}

/// The CRC of `bytes`.
pub(crate) fn of(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}
