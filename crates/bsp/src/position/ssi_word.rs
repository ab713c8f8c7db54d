//! The word of an encoder with synchronous serial interface (SSI), as an SPI clocks it in.

/// Number of clocks of the longest frame: eight bytes.
pub const LONGEST: u32 = 64;

/// Bits of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SsiWord {
    /// The bits, the last one in bit 0.
    pub bits: u64,
    /// Number of bits.
    pub clocks: u32,
}

/// Number of bytes to clock in for a word of `length` bits: one bit of rest level before the word, and at least one low
/// bit after the word. An SPI clocks whole bytes, so up to seven more bits follow.
#[must_use]
pub fn bytes(length: u32) -> usize {
    let clocks = length.saturating_add(2).min(LONGEST);
    clocks.div_ceil(8) as usize
}

/// Packs the received bytes of a frame, eight at most, in their order, each with its first bit on top.
#[must_use]
pub fn pack(bytes: impl IntoIterator<Item = u8>) -> SsiWord {
    let bytes = bytes.into_iter().take(LONGEST as usize / 8);
    bytes.fold(SsiWord::default(), |word, byte| SsiWord {
        bits: word.bits << 8 | u64::from(byte),
        clocks: word.clocks + 8,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_bit_that_came_is_the_highest() {
        assert_eq!(pack([0x80, 0x00, 0x01]), SsiWord { bits: 0x80_0001, clocks: 24 });
        assert_eq!(pack([]), SsiWord::default());
        assert_eq!(pack([0xFF; 9]), SsiWord { bits: u64::MAX, clocks: 64 });
    }

    #[test]
    fn there_is_room_for_the_rest_level_and_a_low_bit() {
        for length in 1..=62 {
            let clocks = 8 * bytes(length);
            assert!((length as usize + 2..length as usize + 10).contains(&clocks), "{length}");
        }
        assert_eq!(bytes(13), 2);
        assert_eq!(bytes(25), 4);
        assert_eq!(bytes(u32::MAX), 8);
    }
}
