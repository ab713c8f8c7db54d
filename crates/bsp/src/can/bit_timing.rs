//! Bit timing of bxCAN (RM0390, 30.7.7): exact for every bit rate of CiA 301, including 800 kbit/s.
//!
//! 800 kbit/s is not exact with APB1 at 42 or 45 MHz, the usual clocks. With 36 MHz all rates are exact.

use crate::boards::APB1_HZ;

/// One bit in time quanta: one quantum of synchronisation, then the two segments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitTiming {
    kbit: u16,
    prescaler: u16,
    segment1: u8,
    segment2: u8,
}

/// Prescalers and segments with the sample point near the 87.5 % of CiA 301. The second segment has two quanta. With
/// one quantum, as with eight quanta per bit, the answer of a receiver whose clock is a quantum ahead falls on the
/// sample point of the transmitter as soon as the oscillators differ by 0.1 % (`host-tests/tests/node/bit_timing.rs`).
static TABLE: [BitTiming; 8] = [
    BitTiming { kbit: 1000, prescaler: 2, segment1: 15, segment2: 2 },
    BitTiming { kbit: 800, prescaler: 3, segment1: 12, segment2: 2 },
    BitTiming { kbit: 500, prescaler: 4, segment1: 15, segment2: 2 },
    BitTiming { kbit: 250, prescaler: 9, segment1: 13, segment2: 2 },
    BitTiming { kbit: 125, prescaler: 18, segment1: 13, segment2: 2 },
    BitTiming { kbit: 50, prescaler: 45, segment1: 13, segment2: 2 },
    BitTiming { kbit: 20, prescaler: 100, segment1: 15, segment2: 2 },
    BitTiming { kbit: 10, prescaler: 225, segment1: 13, segment2: 2 },
];

const _: () = {
    let mut row = 0;
    while row < TABLE.len() {
        assert!(TABLE[row].is_exact(), "a bit rate that APB1 does not divide to");
        assert!(TABLE[row].fits_register(), "a value that has no room in BTR");
        row += 1;
    }
};

impl BitTiming {
    /// Bit timing of 1 Mbit/s.
    pub const FASTEST: BitTiming = BitTiming::at(1000);

    /// The timing for a bit rate in kbit/s; `None` if CiA 301 does not have the rate.
    #[must_use]
    #[inline(never)]
    pub const fn of(kbit: u16) -> Option<BitTiming> {
        let mut rest = TABLE.as_slice();
        while let [timing, others @ ..] = rest {
            if timing.kbit == kbit {
                return Some(*timing);
            }
            rest = others;
        }
        None
    }

    /// The timing for a constant bit rate; any rate that CiA 301 does not have is a compile error.
    pub(crate) const fn at(kbit: u16) -> BitTiming {
        match BitTiming::of(kbit) {
            Some(timing) => timing,
            None => panic!("no bit rate of CiA 301"),
        }
    }

    /// The bit rate in kbit/s.
    #[must_use]
    pub fn kbit(self) -> u16 {
        self.kbit
    }

    /// Value of `CAN_BTR`. The resynchronisation jump width is one quantum.
    #[must_use]
    pub const fn btr(self) -> u32 {
        (self.segment2 as u32 - 1) << 20 | (self.segment1 as u32 - 1) << 16 | (self.prescaler as u32 - 1)
    }

    /// Quanta in one bit.
    const fn quanta(self) -> u32 {
        1 + self.segment1 as u32 + self.segment2 as u32
    }

    const fn is_exact(self) -> bool {
        self.kbit as u32 * 1000 * self.prescaler as u32 * self.quanta() == APB1_HZ
    }

    const fn fits_register(self) -> bool {
        matches!(self.prescaler, 1..=1024)
            && matches!(self.segment1, 1..=16)
            && matches!(self.segment2, 1..=8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// CiA 301 recommends 87.5 %; it allows 85 % to 90 % up to 500 kbit/s, and 75 % to 90 % above.
    #[test]
    fn the_sample_point_is_where_cia_301_wants_it() {
        for timing in TABLE {
            let per_mille = 1000 * (1 + u32::from(timing.segment1)) / timing.quanta();
            assert!((850..=900).contains(&per_mille), "{timing:?}: {per_mille}");
        }
    }

    #[test]
    fn btr_has_the_fields_of_the_reference_manual() {
        assert_eq!(BitTiming::of(1000).unwrap().btr(), 0x001E_0001);
        assert_eq!(BitTiming::of(800).unwrap().btr(), 0x001B_0002);
        assert_eq!(BitTiming::of(20).unwrap().btr(), 0x001E_0063);
    }

    #[test]
    fn a_rate_that_is_not_in_cia_301_is_refused() {
        assert_eq!(BitTiming::of(100), None);
        assert_eq!(BitTiming::of(0), None);
    }
}
