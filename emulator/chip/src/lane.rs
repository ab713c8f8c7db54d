//! Accesses narrower than a word.

use crate::peripherals::BusFault;

/// The bytes of a word that an access covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Lane {
    shift: u32,
    mask: u32,
}

impl Lane {
    /// The lane of an access of `size` bytes; an access across its natural boundary is an error.
    pub(crate) fn of(address: u32, size: u8) -> Result<Self, BusFault> {
        let mask = match size {
            1 => 0xFF,
            2 => 0xFFFF,
            4 => u32::MAX,
            _ => return Err(BusFault),
        };
        let aligned = address.is_multiple_of(u32::from(size));
        aligned.then_some(Self { shift: address % 4 * 8, mask }).ok_or(BusFault)
    }

    /// The value of the lane in a word.
    pub(crate) fn extract(self, word: u32) -> u32 {
        word >> self.shift & self.mask
    }

    /// The word with the lane replaced.
    pub(crate) fn insert(self, word: u32, value: u32) -> u32 {
        word & !(self.mask << self.shift) | (value & self.mask) << self.shift
    }

    /// The value repeated over the whole word.
    pub(crate) fn repeat(self, value: u32) -> u32 {
        let value = value & self.mask;
        match self.mask {
            0xFF => value * 0x0101_0101,
            0xFFFF => value * 0x0001_0001,
            _ => value,
        }
    }
}
