//! Numbers with twice the digits of single precision, as the sum of two numbers.
//!
//! The FPU of a Cortex-M4 has single precision only. Double precision is done in software, where an addition takes some
//! hundred instructions; here it takes ten instructions of the FPU. The rounded sum of two numbers and its rounding
//! error are exact by Knuth (The Art of Computer Programming, volume 2, 4.2.2), and the remainder of a division is
//! exact by Dekker (A floating-point technique for extending the available precision, 1971). Results are accurate to
//! 2^-46.

/// The largest number that is accepted: neither a sum of 255 such numbers nor the difference of two overflows.
pub(super) const LARGEST: f32 = f32::MAX / 512.0;

/// A whole number to divide by, and its reciprocal: a division takes 14 cycles, a product one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Divisor {
    number: f32,
    reciprocal: f32,
}

impl Divisor {
    /// The number must not be 0.
    pub(super) const fn new(number: u8) -> Divisor {
        Divisor { number: number as f32, reciprocal: 1.0 / number as f32 }
    }
}

const TEN: Divisor = Divisor::new(10);

/// A number: the nearest number of single precision, and the rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Precise {
    high: f32,
    low: f32,
}

impl Precise {
    pub(super) const ZERO: Precise = Precise { high: 0.0, low: 0.0 };
    pub(super) const ONE: Precise = Precise { high: 1.0, low: 0.0 };

    /// The nearest number to one of double precision. For constants: the target computes double precision slowly.
    #[allow(clippy::cast_possible_truncation)]
    pub(super) const fn near_double(value: f64) -> Precise {
        let high = value as f32;
        Precise { high, low: (value - high as f64) as f32 }
    }

    /// A number of single precision, limited to ±[`LARGEST`].
    pub(super) fn of(value: f32) -> Precise {
        Precise { high: value.clamp(-LARGEST, LARGEST), low: 0.0 }
    }

    /// The nearest number of single precision.
    pub(super) fn rounded(self) -> f32 {
        self.high
    }

    pub(super) fn plus(self, other: Precise) -> Precise {
        let (sum, lost) = (self.high + other.high, lost(self.high, other.high));
        Precise::near(sum, lost + (self.low + other.low))
    }

    pub(super) fn minus(self, other: Precise) -> Precise {
        self.plus(Precise { high: -other.high, low: -other.low })
    }

    /// Multiplied by ten to the power of `digits`. Ten times a number is the sum of 8 times and 2 times the number,
    /// which are exact.
    pub(super) fn shifted(self, digits: i8) -> Precise {
        let times = |value: Precise, factor| Precise { high: value.high * factor, low: value.low * factor };
        (0..digits.unsigned_abs()).fold(self, |value, _| {
            if digits > 0 { times(value, 8.0).plus(times(value, 2.0)) } else { value.over(TEN) }
        })
    }

    /// Divided by a whole number.
    pub(super) fn over(self, Divisor { number: divisor, reciprocal }: Divisor) -> Precise {
        let quotient = self.high * reciprocal;
        // The upper 16 bits and the lower 8 bits of the quotient: their products with 8 bits are exact.
        let upper = f32::from_bits(quotient.to_bits() & 0xFFFF_FF00);
        let remainder = self.high - upper * divisor - (quotient - upper) * divisor;
        Precise::near(quotient, (remainder + self.low) * reciprocal)
    }

    /// The sum of a number and a much smaller one.
    fn near(large: f32, small: f32) -> Precise {
        let high = large + small;
        Precise { high, low: small - (high - large) }
    }
}

/// The rounding error of a sum.
fn lost(a: f32, b: f32) -> f32 {
    let sum = a + b;
    let of_b = sum - a;
    (a - (sum - of_b)) + (b - of_b)
}
