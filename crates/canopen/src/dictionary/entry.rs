//! One entry of a dictionary at run time, and the range of its values.

use super::tables::Series;
use super::{Access, Field, Group, Mapping, Rule, Type};
use crate::sdo::Abort;

/// The attributes of an entry, without index, sub-index and offset in the image. Other entries can share them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Attributes {
    pub(crate) limits: Limits,
    pub(crate) kind: Kind,
    /// Size of a value in the image in bytes.
    pub(crate) size: u8,
    pub(crate) access: Access,
    pub(crate) mapping: Mapping,
    pub(crate) group: Option<Group>,
    pub(crate) rule: Rule,
    /// The default value is relative to the node-ID.
    pub(crate) node_relative: bool,
}

/// Properties of a data type that the device treats differently, apart from its size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Kind {
    /// Any bytes of the right length.
    Plain,
    /// A signed integer of at most 32 bits.
    Signed,
    /// A finite number.
    Real32,
    /// A string, which can be shorter than its size.
    Text,
    /// The application holds the content.
    Domain,
}

impl Kind {
    pub(super) const fn of(kind: Type) -> Kind {
        match kind {
            Type::Integer8 | Type::Integer16 | Type::Integer24 | Type::Integer32 => Kind::Signed,
            Type::Real32 => Kind::Real32,
            Type::VisibleString(_) => Kind::Text,
            Type::Domain => Kind::Domain,
            _ => Kind::Plain,
        }
    }
}

/// One entry of the dictionary.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    pub(crate) attributes: &'static Attributes,
    pub(crate) series: &'static Series,
    pub(crate) field: Field,
    pub(crate) sub: u8,
    pub(crate) index: u16,
}

impl Entry {
    /// Index.
    #[must_use]
    pub const fn index(&self) -> u16 {
        self.index
    }

    /// Sub-index.
    #[must_use]
    pub const fn sub(&self) -> u8 {
        self.sub
    }

    /// Location of the value in the image.
    #[must_use]
    pub const fn field(&self) -> Field {
        self.field
    }

    pub(crate) const fn rule(&self) -> Rule {
        self.attributes.rule
    }

    /// Whether every value of the right size is allowed. A PDO writes such a value to the image without a check.
    pub(crate) const fn takes_any(&self) -> bool {
        matches!(self.attributes.rule, Rule::Plain)
            && self.attributes.limits.is_none(self.field.size)
            && !matches!(self.attributes.kind, Kind::Real32)
    }

    /// Whether the application holds the content, of any length.
    pub(crate) const fn is_domain(&self) -> bool {
        matches!(self.attributes.kind, Kind::Domain)
    }

    /// Whether the value is a parameter of the application.
    pub(crate) const fn is_parameter(&self) -> bool {
        !matches!(self.attributes.group, None | Some(Group::Communication))
    }

    pub(crate) const fn is_writable(&self) -> bool {
        self.attributes.access.is_writable()
    }

    /// Checks the length of a value to be written. Only a string may be shorter than its size in the image.
    pub(crate) fn check_length(&self, len: usize) -> Result<(), Abort> {
        let size = usize::from(self.field.size);
        if len == size {
            return Ok(());
        }
        match self.attributes.kind {
            Kind::Text if len < size => Ok(()),
            _ if len < size => Err(Abort::TooShort),
            _ => Err(Abort::TooLong),
        }
    }

    /// Checks a value to be written, by its first four bytes. The length must have been checked before.
    #[inline]
    pub(crate) fn check_value(&self, value: u32) -> Result<(), Abort> {
        match self.attributes.kind {
            Kind::Real32 => check_real(f32::from_bits(value)),
            kind => self.attributes.limits.check(kind, self.field.size, value),
        }
    }
}

/// The first four bytes as a number; missing bytes count as 0.
pub(crate) fn little_endian(bytes: &[u8]) -> u32 {
    if let Some(bytes) = bytes.first_chunk() {
        return u32::from_le_bytes(*bytes);
    }
    few(bytes)
}

#[inline(never)]
fn few(bytes: &[u8]) -> u32 {
    bytes.iter().rfold(0, |value, &byte| value << 8 | u32::from(byte))
}

/// Refuses infinity and NaN: as a parameter, they would make every measured value invalid.
fn check_real(value: f32) -> Result<(), Abort> {
    if value.is_finite() { Ok(()) } else { Err(Abort::InvalidValue) }
}

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
    pub(super) fn check(self, kind: Kind, size: u8, value: u32) -> Result<(), Abort> {
        let value = shifted(size, value);
        if value.wrapping_sub(self.low) <= self.span { Ok(()) } else { Err(self.excess(kind, value)) }
    }

    fn excess(self, kind: Kind, value: u32) -> Abort {
        let is_low = match kind {
            Kind::Signed => value.cast_signed() < self.low.cast_signed(),
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
            assert_eq!(limits.check(Kind::of(kind), kind.size(), word), expected, "{word:#X} as {kind:?}");
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
