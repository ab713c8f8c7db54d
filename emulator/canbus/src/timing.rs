//! Bit timing: the sample point of a controller, and the size of its resynchronisation steps (ISO 11898-1:2015, 11.3).

use crate::Time;

/// One bit as a controller clocks it: one quantum of synchronisation and two segments, with the sample point between
/// them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitTiming {
    bit: Time,
    segment1: u8,
    segment2: u8,
    jump: u8,
}

impl BitTiming {
    /// A bit of this length; segments (the first one with the propagation segment) and resynchronisation jump width in
    /// quanta.
    ///
    /// # Panics
    /// When a segment or the jump width is 0: no controller has such a bit.
    #[must_use]
    pub const fn new(bit: Time, segment1: u8, segment2: u8, jump: u8) -> BitTiming {
        assert!(segment1 > 0 && segment2 > 0 && jump > 0, "every part of a bit has a quantum");
        BitTiming { bit, segment1, segment2, jump }
    }

    /// Sixteen quanta with the sample point at 87.5 %, as CiA 301 recommends. With eight, a receiver that is a quantum ahead
    /// would end its acknowledgement before a transmitter samples at 88.8 %, because this wire has no delay.
    #[must_use]
    pub const fn nominal(bit: Time) -> BitTiming {
        BitTiming::new(bit, 13, 2, 1)
    }

    /// The length of a bit.
    #[must_use]
    pub const fn bit(self) -> Time {
        self.bit
    }

    /// Whether resynchronisation may keep two participants in step: their bit lengths differ by at most one per cent.
    pub(crate) fn is_near(self, other: BitTiming) -> bool {
        self.bit.0.abs_diff(other.bit.0) * 100 <= other.bit.0
    }

    /// The span from the begin of a bit to its sample point.
    pub(crate) fn sample_point(self) -> Time {
        self.quanta(1 + u64::from(self.segment1))
    }

    /// The span by which the next bit begins sooner, for an edge that comes `early` before it.
    pub(crate) fn sooner(self, early: Time) -> Time {
        self.quanta(early.0.div_ceil(self.quantum()).min(self.jump.into()))
    }

    /// The span by which the bit becomes longer, for an edge that comes `late` after its begin. An edge in the first
    /// quantum is in time.
    pub(crate) fn longer(self, late: Time) -> Time {
        self.quanta((late.0 / self.quantum()).min(self.jump.into()))
    }

    /// The length of a quantum, rounded down. It only serves for comparisons, so the rounding does not add up.
    fn quantum(self) -> u64 {
        (self.bit.0 / self.count()).max(1)
    }

    fn quanta(self, count: u64) -> Time {
        Time(self.bit.0 * count / self.count())
    }

    fn count(self) -> u64 {
        1 + u64::from(self.segment1) + u64::from(self.segment2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMING: BitTiming = BitTiming::new(Time(1600), 13, 2, 2);

    #[test]
    fn the_sample_point_lies_between_the_segments() {
        assert_eq!(TIMING.sample_point(), Time(1400));
        assert_eq!(BitTiming::nominal(Time(1600)).sample_point(), Time(1400));
    }

    #[test]
    fn an_edge_moves_the_sample_point_by_the_jump_width_at_most() {
        for (error, sooner, longer) in
            [(0, 0, 0), (1, 100, 0), (99, 100, 0), (100, 100, 100), (250, 200, 200), (900, 200, 200)]
        {
            assert_eq!(TIMING.sooner(Time(error)), Time(sooner), "{error} early");
            assert_eq!(TIMING.longer(Time(error)), Time(longer), "{error} late");
        }
    }
}
