//! CRC-32 (ISO HDLC) in two sizes.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

/// For a few bytes now and then: without a table of its own.
pub(crate) const SMALL: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// For a whole program: with a table, which takes 1 KiB of flash and is too large for a stack. A reference to a constant: the linker
/// then keeps one copy of the table for this crate and `storage`, whose tables are equal.
#[cfg(target_os = "none")]
pub(crate) static FAST: &Crc<u32> = &Crc::<u32>::new(&CRC_32_ISO_HDLC);
