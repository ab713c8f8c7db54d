//! Multiplication by a fraction without a division.
//!
//! A 64-bit division is a library call of more than a hundred instructions on a Cortex-M4. The method here needs three
//! multiplications.

use core::num::NonZeroU32;

/// A fraction: its whole part and its remainder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Fraction {
    whole: u32,
    /// Numerator of the remainder, less than the denominator.
    numerator: u32,
    denominator: NonZeroU32,
    /// The remainder in units of 2^-32, rounded down.
    approximation: u64,
}

impl Fraction {
    /// `numerator / denominator`.
    pub(super) fn new(numerator: u32, denominator: NonZeroU32) -> Fraction {
        let (whole, numerator) = (numerator / denominator, numerator % denominator);
        let approximation = (u64::from(numerator) << 32) / core::num::NonZeroU64::from(denominator);
        Fraction { whole, numerator, denominator, approximation }
    }

    /// `value * numerator / denominator`, rounded down, exactly, modulo 2^32.
    ///
    /// The approximation is less than 2^-32 too small and the value is below 2^32, so the unrounded estimate is less
    /// than 1 too small. Rounded down, the estimate is the result or the result minus 1; the remainder tells which.
    #[allow(clippy::cast_possible_truncation)] // The fractional part is at most `value`.
    pub(super) fn of(self, value: u32) -> u32 {
        let whole = value.wrapping_mul(self.whole);
        let value = u64::from(value);
        let denominator = u64::from(self.denominator.get());
        let estimate = (value * self.approximation) >> 32;
        let remainder = value * u64::from(self.numerator) - estimate * denominator;
        whole.wrapping_add(estimate as u32 + u32::from(remainder >= denominator))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn check(value: u32, numerator: u32, denominator: u32) {
        let exact = u64::from(value) * u64::from(numerator) / u64::from(denominator) % (1 << 32);
        let fraction = Fraction::new(numerator, NonZeroU32::new(denominator).unwrap());
        assert_eq!(u64::from(fraction.of(value)), exact, "{value} * {numerator} / {denominator}");
    }

    proptest! {
        #[test]
        fn is_exact(numerator: u32, denominator in 1..=u32::MAX, value: u32) {
            check(value, numerator, denominator);
        }
    }

    #[test]
    fn is_exact_for_all_small_numbers_and_at_the_ends() {
        for denominator in 1..60 {
            for numerator in 0..=2 * denominator {
                (0..200).for_each(|value| check(value, numerator, denominator));
            }
        }
        for (numerator, denominator) in
            [(1, u32::MAX), (u32::MAX - 1, u32::MAX), (u32::MAX, u32::MAX), (1, 1)]
        {
            for value in [0, 1, u32::MAX - 1, u32::MAX] {
                check(value, numerator, denominator);
            }
        }
    }
}
