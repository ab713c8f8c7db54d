//! Data types of dictionary entries (CiA 301, 7.4.7).

/// A data type that an entry can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Type {
    /// BOOLEAN, a byte of 0 or 1. A PDO carries it as eight bits.
    Boolean,
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
    /// UNSIGNED48
    Unsigned48,
    /// UNSIGNED64; the default value can have at most 63 bits.
    Unsigned64,
    /// REAL32, a finite number. Infinities and NaN are refused: as a default they do not compile, a download gets the
    /// abort code 0609 0030h, a PDO leaves them out, and stored values with them count as damaged. The application may
    /// write them to the image, for example to mark a measured value as invalid; they are sent as they are.
    Real32,
    /// `VISIBLE_STRING` of at most this many characters.
    VisibleString(u8),
    /// DOMAIN: data of any length that the application holds.
    Domain,
}

impl Type {
    /// Size of a value in the image in bytes.
    #[must_use]
    pub const fn size(self) -> u8 {
        match self {
            Type::Boolean | Type::Integer8 | Type::Unsigned8 => 1,
            Type::Integer16 | Type::Unsigned16 => 2,
            Type::Integer32 | Type::Unsigned32 | Type::Real32 => 4,
            Type::Unsigned48 => 6,
            Type::Unsigned64 => 8,
            Type::VisibleString(capacity) => capacity,
            Type::Domain => 0,
        }
    }

    /// Index of the type in the dictionary (CiA 301), the `DataType` of an EDS.
    #[must_use]
    pub const fn code(self) -> u16 {
        match self {
            Type::Boolean => 0x01,
            Type::Integer8 => 0x02,
            Type::Integer16 => 0x03,
            Type::Integer32 => 0x04,
            Type::Unsigned8 => 0x05,
            Type::Unsigned16 => 0x06,
            Type::Unsigned32 => 0x07,
            Type::Real32 => 0x08,
            Type::VisibleString(_) => 0x09,
            Type::Domain => 0x0F,
            Type::Unsigned48 => 0x19,
            Type::Unsigned64 => 0x1B,
        }
    }

    /// Smallest and largest value of an integer type; `None` for other types.
    #[must_use]
    pub const fn range(self) -> Option<(i64, i64)> {
        match self {
            Type::Boolean => Some((0, 1)),
            Type::Integer8 => Some((i8::MIN as i64, i8::MAX as i64)),
            Type::Integer16 => Some((i16::MIN as i64, i16::MAX as i64)),
            Type::Integer32 => Some((i32::MIN as i64, i32::MAX as i64)),
            Type::Unsigned8 => Some((0, u8::MAX as i64)),
            Type::Unsigned16 => Some((0, u16::MAX as i64)),
            Type::Unsigned32 => Some((0, u32::MAX as i64)),
            Type::Unsigned48 => Some((0, (1 << 48) - 1)),
            Type::Unsigned64 => Some((0, i64::MAX)),
            Type::Real32 | Type::VisibleString(_) | Type::Domain => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_range_of_an_integer_follows_from_its_size() {
        let unsigned = [Type::Unsigned8, Type::Unsigned16, Type::Unsigned32, Type::Unsigned48];
        let signed = [Type::Integer8, Type::Integer16, Type::Integer32];
        for kind in unsigned {
            assert_eq!(kind.range(), Some((0, (1_i64 << (kind.size() * 8)) - 1)), "{kind:?}");
        }
        for kind in signed {
            let half = 1_i64 << (kind.size() * 8 - 1);
            assert_eq!(kind.range(), Some((-half, half - 1)), "{kind:?}");
        }
        assert_eq!(Type::Unsigned48.range(), Some((0, 0xFFFF_FFFF_FFFF)));
        assert_eq!(Type::Unsigned64.range(), Some((0, i64::MAX)));
        assert_eq!(Type::Boolean.range(), Some((0, 1)));
    }
}
