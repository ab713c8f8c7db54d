//! CRC-32 (ISO HDLC, as in Ethernet and zip), four bits at a time. The crate `crc` either needs a table of 1 KiB, for
//! which an image has no room, or works without a table, and the CRC of an application then takes 0.1 s at every start.

/// The polynomial 04C1 1DB7h with its bits reversed.
const POLYNOMIAL: u32 = 0xEDB8_8320;

/// Contribution of four bits to the CRC.
#[allow(clippy::indexing_slicing)] // Computed by the compiler.
static TABLE: [u32; 16] = {
    let mut table = [0; 16];
    let mut at: u8 = 0;
    while at < 16 {
        let mut value = at as u32;
        let mut bit = 0;
        while bit < 4 {
            value = if value & 1 == 0 { value >> 1 } else { value >> 1 ^ POLYNOMIAL };
            bit += 1;
        }
        table[at as usize] = value;
        at += 1;
    }
    table
};

/// A CRC that is being computed.
#[derive(Clone, Debug)]
pub struct Digest(u32);

/// Starts a CRC.
#[must_use]
pub fn begin() -> Digest {
    Digest(u32::MAX)
}

impl Digest {
    /// Adds these bytes.
    #[inline(never)]
    pub fn update(&mut self, bytes: &[u8]) {
        self.0 = bytes.iter().fold(self.0, |crc, byte| {
            let crc = crc ^ u32::from(*byte);
            half(half(crc))
        });
    }

    /// The CRC.
    #[must_use]
    pub fn finalize(self) -> u32 {
        !self.0
    }
}

/// Processes four bits.
#[allow(clippy::indexing_slicing)] // Four bits index sixteen entries.
fn half(crc: u32) -> u32 {
    crc >> 4 ^ TABLE[(crc & 15) as usize]
}

/// The CRC of `bytes`.
#[must_use]
pub fn of(bytes: &[u8]) -> u32 {
    let mut digest = begin();
    digest.update(bytes);
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use crc::{CRC_32_ISO_HDLC, Crc};

    use super::*;

    #[test]
    fn it_is_the_crc_of_the_catalogue() {
        let bytes: [u8; 256] = core::array::from_fn(|at| u8::try_from(at * 7 % 256).unwrap_or(0));
        for len in 0..bytes.len() {
            assert_eq!(of(&bytes[..len]), Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&bytes[..len]));
        }
    }
}
