//! Data types of dictionary entries (CiA 301, 7.4.7).

/// A data type that an entry can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    /// INTEGER8
    Integer8,
    /// INTEGER16
    Integer16,
    /// INTEGER32
    Integer32,
    /// UNSIGNED8
    Unsigned8,
    /// UNSIGNED16
    Unsigned16,
    /// UNSIGNED32
    Unsigned32,
    /// REAL32
    Real32,
    /// `VISIBLE_STRING` of at most this many characters.
    VisibleString(u8),
}

impl Type {
    /// Bytes that a value takes in the image.
    #[must_use]
    pub const fn size(self) -> u8 {
        match self {
            Type::Integer8 | Type::Unsigned8 => 1,
            Type::Integer16 | Type::Unsigned16 => 2,
            Type::Integer32 | Type::Unsigned32 | Type::Real32 => 4,
            Type::VisibleString(capacity) => capacity,
        }
    }

    /// Index of the type in the dictionary, the `DataType` of an EDS.
    #[must_use]
    pub const fn code(self) -> u16 {
        match self {
            Type::Integer8 => 0x02,
            Type::Integer16 => 0x03,
            Type::Integer32 => 0x04,
            Type::Unsigned8 => 0x05,
            Type::Unsigned16 => 0x06,
            Type::Unsigned32 => 0x07,
            Type::Real32 => 0x08,
            Type::VisibleString(_) => 0x09,
        }
    }

    /// Smallest and largest value of an integer type; `None` for the others.
    #[must_use]
    pub const fn range(self) -> Option<(i64, i64)> {
        match self {
            Type::Integer8 => Some((i8::MIN as i64, i8::MAX as i64)),
            Type::Integer16 => Some((i16::MIN as i64, i16::MAX as i64)),
            Type::Integer32 => Some((i32::MIN as i64, i32::MAX as i64)),
            Type::Unsigned8 => Some((0, u8::MAX as i64)),
            Type::Unsigned16 => Some((0, u16::MAX as i64)),
            Type::Unsigned32 => Some((0, u32::MAX as i64)),
            Type::Real32 | Type::VisibleString(_) => None,
        }
    }

    /// The value of the little-endian bytes of an integer type.
    pub(crate) fn integer(self, bytes: &[u8]) -> Option<i64> {
        let (low, _) = self.range()?;
        let mut wide = if low < 0 && bytes.last()? & 0x80 != 0 { [0xFF; 8] } else { [0; 8] };
        wide.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(i64::from_le_bytes(wide))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_are_sign_extended_by_their_type() {
        assert_eq!(Type::Integer8.integer(&[0xFE]), Some(-2));
        assert_eq!(Type::Unsigned8.integer(&[0xFE]), Some(254));
        assert_eq!(Type::Integer16.integer(&[0x00, 0x80]), Some(-32768));
        assert_eq!(Type::Unsigned32.integer(&[0xFF; 4]), Some(0xFFFF_FFFF));
        assert_eq!(Type::Real32.integer(&[0; 4]), None);
    }
}
