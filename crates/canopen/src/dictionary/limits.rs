//! The range of values that an entry accepts.

use super::Type;
use crate::sdo::Abort;

/// The limits of an integer of at most 32 bits. An entry of another type accepts any value.
///
/// One comparison checks a value, signed or unsigned: its distance from the lowest value, modulo 2^8, 2^16 or 2^32
/// depending on the type, must not exceed the distance of the highest value from the lowest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Limits {
    /// The lowest value in the top bits of the word. There, a short number wraps around like a number of its type.
    low: u32,
    /// The distance from the lowest to the highest value, in the top bits too.
    span: u32,
}

impl Limits {
    const NONE: Limits = Limits { low: 0, span: u32::MAX };

    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // `check` has verified the ranges.
    pub(super) const fn new(kind: Type, low: i64, high: i64) -> Limits {
        if kind.range().is_none() || kind.size() > 4 {
            return Limits::NONE;
        }
        let (low, high) = (shifted(kind.size(), low as u32), shifted(kind.size(), high as u32));
        Limits { low, span: high.wrapping_sub(low) }
    }

    /// Whether every value of this size is within the limits.
    pub(super) const fn is_none(self, size: u8) -> bool {
        self.span == u32::MAX || self.span == shifted(size, u32::MAX)
    }

    pub(super) const fn is_same(self, other: Limits) -> bool {
        self.low == other.low && self.span == other.span
    }

    /// Checks a value of this type and size, by its first four bytes.
    pub(super) fn check(self, kind: Type, size: u8, value: u32) -> Result<(), Abort> {
        let value = shifted(size, value);
        if value.wrapping_sub(self.low) <= self.span { Ok(()) } else { Err(self.excess(kind, value)) }
    }

    fn excess(self, kind: Type, value: u32) -> Abort {
        let is_low = match kind {
            Type::Integer8 | Type::Integer16 | Type::Integer24 | Type::Integer32 => {
                value.cast_signed() < self.low.cast_signed()
            }
            _ => value < self.low,
        };
        if is_low { Abort::ValueTooLow } else { Abort::ValueTooHigh }
    }
}

/// Moves a value of `size` bytes to the top bits of the word. Without limits, any size is allowed.
const fn shifted(size: u8, value: u32) -> u32 {
    value.wrapping_shl(0_u32.wrapping_sub(size as u32 * 8))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks each word as a value of this type and compares the result.
    fn assert_checked(kind: Type, (low, high): (i64, i64), words: &[(u32, Result<(), Abort>)]) {
        let limits = Limits::new(kind, low, high);
        for &(word, expected) in words {
            assert_eq!(limits.check(kind, kind.size(), word), expected, "{word:#X} as {kind:?}");
        }
    }

    const LOW: Result<(), Abort> = Err(Abort::ValueTooLow);
    const HIGH: Result<(), Abort> = Err(Abort::ValueTooHigh);

    #[test]
    fn limits_hold_with_a_sign_and_without() {
        assert_checked(
            Type::Integer8,
            (-2, 1),
            &[(0x80, LOW), (0xFD, LOW), (0xFE, Ok(())), (0, Ok(())), (1, Ok(())), (2, HIGH), (0x7F, HIGH)],
        );
        assert_checked(
            Type::Integer16,
            (-0x100, -1),
            &[(0x8000, LOW), (0xFEFF, LOW), (0xFF00, Ok(())), (0xFFFF, Ok(())), (0, HIGH), (0x7FFF, HIGH)],
        );
        assert_checked(
            Type::Integer32,
            (5, i64::from(i32::MAX)),
            &[(1 << 31, LOW), (4, LOW), (5, Ok(())), (u32::MAX >> 1, Ok(()))],
        );
        assert_checked(
            Type::Integer24,
            (-2, 1),
            &[(0x80_0000, LOW), (0xFF_FFFD, LOW), (0xFF_FFFE, Ok(())), (1, Ok(())), (2, HIGH)],
        );
        assert_checked(Type::Unsigned24, (1, 0xFF_FFFE), &[(0, LOW), (0xFF_FFFE, Ok(())), (0xFF_FFFF, HIGH)]);
        assert_checked(Type::Unsigned8, (1, 254), &[(0, LOW), (1, Ok(())), (254, Ok(())), (255, HIGH)]);
        assert_checked(
            Type::Unsigned32,
            (0x10, 0xFFFF_FFF0),
            &[(0xF, LOW), (0x10, Ok(())), (1 << 31, Ok(())), (0xFFFF_FFF1, HIGH)],
        );
    }

    #[test]
    fn a_type_without_limits_takes_any_value() {
        for kind in [Type::Integer8, Type::Integer16, Type::Integer32, Type::Unsigned8, Type::Unsigned32] {
            let (low, high) = kind.range().unwrap();
            for word in [0, 1, 0x7F, 0x80, 0xFF] {
                assert_checked(kind, (low, high), &[(word, Ok(()))]);
            }
        }
        for kind in [Type::Unsigned48, Type::Unsigned64, Type::VisibleString(9), Type::Domain] {
            assert_checked(kind, (0, 0), &[(0, Ok(())), (u32::MAX, Ok(()))]);
        }
    }
}
