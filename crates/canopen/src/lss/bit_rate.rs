//! Bit rates by their index in the bit timing table of CiA 305.

/// A bit rate of CiA 301, or automatic detection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BitRate(u16);

/// Bit rates in kbit/s by index. Index 5 (formerly 100 kbit/s) is reserved; the last index is automatic detection.
const TABLE: [Option<u16>; 10] =
    [Some(1000), Some(800), Some(500), Some(250), Some(125), None, Some(50), Some(20), Some(10), Some(0)];

impl BitRate {
    /// Automatic detection.
    pub const AUTO: BitRate = BitRate(0);

    /// 1 Mbit/s.
    pub const FASTEST: BitRate = BitRate(1000);

    /// The bit rate of an index; `None` for a reserved index.
    #[must_use]
    pub fn from_index(index: u8) -> Option<BitRate> {
        TABLE.get(usize::from(index)).copied().flatten().map(BitRate)
    }

    /// The bit rate of `kbit` kbit/s, 0 for automatic detection; `None` if CiA 301 does not define it.
    #[must_use]
    pub fn from_kbit(kbit: u16) -> Option<BitRate> {
        TABLE.contains(&Some(kbit)).then_some(BitRate(kbit))
    }

    /// In kbit/s; 0 for automatic detection.
    #[must_use]
    pub const fn kbit(self) -> u16 {
        self.0
    }

    /// The index in the bit timing table.
    #[must_use]
    pub fn index(self) -> u8 {
        let index = TABLE.iter().position(|&kbit| kbit == Some(self.0));
        index.and_then(|index| u8::try_from(index).ok()).unwrap_or(u8::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_index_but_the_reserved_ones_is_a_bit_rate() {
        for index in 0..=u8::MAX {
            let rate = BitRate::from_index(index);
            assert_eq!(rate.is_some(), index < 10 && index != 5);
            if let Some(rate) = rate {
                assert_eq!((rate.index(), BitRate::from_kbit(rate.kbit())), (index, Some(rate)));
            }
        }
        assert_eq!(BitRate::from_kbit(100), None);
    }
}
