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
    /// INTEGER24
    Integer24,
    /// INTEGER32
    Integer32,
    /// INTEGER40
    Integer40,
    /// INTEGER48
    Integer48,
    /// INTEGER56
    Integer56,
    /// INTEGER64
    Integer64,
    /// UNSIGNED8
    Unsigned8,
    /// UNSIGNED16
    Unsigned16,
    /// UNSIGNED24
    Unsigned24,
    /// UNSIGNED32
    Unsigned32,
    /// UNSIGNED40
    Unsigned40,
    /// UNSIGNED48
    Unsigned48,
    /// UNSIGNED56
    Unsigned56,
    /// UNSIGNED64; the default value can have at most 63 bits.
    Unsigned64,
    /// REAL32, a finite number. Infinities and NaN are refused: as a default they do not compile, a download gets the
    /// abort code 0609 0030h, a PDO leaves them out, and stored values with them count as damaged. The application may
    /// write them to the image, for example to mark a measured value as invalid; they are sent without a change.
    Real32,
    /// REAL64. Every value is accepted, infinities and NaN too. [`Object::real64`](super::Object::real64) sets its default.
    Real64,
    /// `TIME_OF_DAY`: milliseconds after midnight in the lowest 28 bits, days since 1984-01-01 in the highest 16 of 48.
    TimeOfDay,
    /// `TIME_DIFFERENCE`: milliseconds in the lowest 28 bits, days in the highest 16 of 48.
    TimeDifference,
    /// `OCTET_STRING` of exactly this many bytes.
    OctetString(u8),
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
            Type::Integer24 | Type::Unsigned24 => 3,
            Type::Integer32 | Type::Unsigned32 | Type::Real32 => 4,
            Type::Integer40 | Type::Unsigned40 => 5,
            Type::Integer48 | Type::Unsigned48 | Type::TimeOfDay | Type::TimeDifference => 6,
            Type::Integer56 | Type::Unsigned56 => 7,
            Type::Integer64 | Type::Unsigned64 | Type::Real64 => 8,
            Type::VisibleString(capacity) | Type::OctetString(capacity) => capacity,
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
            Type::OctetString(_) => 0x0A,
            Type::TimeOfDay => 0x0C,
            Type::TimeDifference => 0x0D,
            Type::Domain => 0x0F,
            Type::Integer24 => 0x10,
            Type::Real64 => 0x11,
            Type::Integer40 => 0x12,
            Type::Integer48 => 0x13,
            Type::Integer56 => 0x14,
            Type::Integer64 => 0x15,
            Type::Unsigned24 => 0x16,
            Type::Unsigned40 => 0x18,
            Type::Unsigned48 => 0x19,
            Type::Unsigned56 => 0x1A,
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
            Type::Integer24 => Some((-(1 << 23), (1 << 23) - 1)),
            Type::Integer32 => Some((i32::MIN as i64, i32::MAX as i64)),
            Type::Integer40 => Some((-(1 << 39), (1 << 39) - 1)),
            Type::Integer48 => Some((-(1 << 47), (1 << 47) - 1)),
            Type::Integer56 => Some((-(1 << 55), (1 << 55) - 1)),
            Type::Integer64 => Some((i64::MIN, i64::MAX)),
            Type::Unsigned8 => Some((0, u8::MAX as i64)),
            Type::Unsigned16 => Some((0, u16::MAX as i64)),
            Type::Unsigned32 => Some((0, u32::MAX as i64)),
            Type::Unsigned24 => Some((0, (1 << 24) - 1)),
            Type::Unsigned40 => Some((0, (1 << 40) - 1)),
            Type::Unsigned48 | Type::TimeOfDay | Type::TimeDifference => Some((0, (1 << 48) - 1)),
            Type::Unsigned56 => Some((0, (1 << 56) - 1)),
            Type::Unsigned64 => Some((0, i64::MAX)),
            Type::Real32 | Type::Real64 | Type::VisibleString(_) | Type::OctetString(_) | Type::Domain => {
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_range_of_an_integer_follows_from_its_size() {
        use Type::*;
        let unsigned =
            [Unsigned8, Unsigned16, Unsigned24, Unsigned32, Unsigned40, Unsigned48, Unsigned56, TimeOfDay];
        let signed = [Integer8, Integer16, Integer24, Integer32, Integer40, Integer48, Integer56];
        for kind in unsigned {
            assert_eq!(kind.range(), Some((0, (1_i64 << (kind.size() * 8)) - 1)), "{kind:?}");
        }
        for kind in signed {
            let half = 1_i64 << (kind.size() * 8 - 1);
            assert_eq!(kind.range(), Some((-half, half - 1)), "{kind:?}");
        }
        assert_eq!(Type::Unsigned48.range(), Some((0, 0xFFFF_FFFF_FFFF)));
        assert_eq!(Type::Integer64.range(), Some((i64::MIN, i64::MAX)));
        assert_eq!(Type::Unsigned64.range(), Some((0, i64::MAX)));
        assert_eq!(Type::Boolean.range(), Some((0, 1)));
    }
}
