//! The enumerations of CiA 306: object type, data type, access type.

use std::fmt;

/// Object type (CiA 301, 7.4.3): the kind of object at an index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ObjectType {
    /// A large block of data.
    Domain,
    /// A single value.
    Var,
    /// Values of one type, and their number at sub-index 0.
    Array,
    /// Values of any types, and their number at sub-index 0.
    Record,
}

impl ObjectType {
    /// The code in an EDS.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            ObjectType::Domain => 2,
            ObjectType::Var => 7,
            ObjectType::Array => 8,
            ObjectType::Record => 9,
        }
    }

    /// The object type of a code; `None` for a code that no object of a device has.
    #[must_use]
    pub const fn from_code(code: u8) -> Option<ObjectType> {
        Some(match code {
            2 => ObjectType::Domain,
            7 => ObjectType::Var,
            8 => ObjectType::Array,
            9 => ObjectType::Record,
            _ => return None,
        })
    }

    /// Whether such an object has sub-indices beyond 0.
    #[must_use]
    pub const fn has_subs(self) -> bool {
        matches!(self, ObjectType::Array | ObjectType::Record)
    }
}

/// Access type. The last two are for objects whose PDO direction does not follow from the access by SDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// `const`: never changes.
    Const,
    /// `ro`
    ReadOnly,
    /// `wo`
    WriteOnly,
    /// `rw`
    ReadWrite,
    /// `rwr`: read and write by SDO, read by PDO.
    ReadWriteInput,
    /// `rww`: read and write by SDO, written by PDO.
    ReadWriteOutput,
}

impl Access {
    const ALL: [Access; 6] = [
        Access::Const,
        Access::ReadOnly,
        Access::WriteOnly,
        Access::ReadWrite,
        Access::ReadWriteInput,
        Access::ReadWriteOutput,
    ];

    /// The text in an EDS.
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            Access::Const => "const",
            Access::ReadOnly => "ro",
            Access::WriteOnly => "wo",
            Access::ReadWrite => "rw",
            Access::ReadWriteInput => "rwr",
            Access::ReadWriteOutput => "rww",
        }
    }

    /// The access type of a text in any case.
    #[must_use]
    pub fn from_text(text: &str) -> Option<Access> {
        Access::ALL.into_iter().find(|access| access.text().eq_ignore_ascii_case(text))
    }

    /// Whether an SDO upload is allowed.
    #[must_use]
    pub const fn is_readable(self) -> bool {
        !matches!(self, Access::WriteOnly)
    }

    /// Whether an SDO download is allowed.
    #[must_use]
    pub const fn is_writable(self) -> bool {
        !matches!(self, Access::Const | Access::ReadOnly)
    }
}

/// The form of the values of a data type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Integer of this many bits, two's complement.
    Signed(u8),
    /// Integer of this many bits; BOOLEAN has one.
    Unsigned(u8),
    /// IEEE 754 number of this many bits: 32 or 64.
    Real(u8),
    /// Characters.
    Text,
    /// Any other type: bytes.
    Bytes,
}

/// Data type, by its index in the dictionary.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct DataType(pub u16);

/// The static data types (CiA 301, 7.4.7).
#[rustfmt::skip]
const TYPES: [(u16, &str, Class); 25] = [
    (0x01, "BOOLEAN", Class::Unsigned(1)),
    (0x02, "INTEGER8", Class::Signed(8)),
    (0x03, "INTEGER16", Class::Signed(16)),
    (0x04, "INTEGER32", Class::Signed(32)),
    (0x05, "UNSIGNED8", Class::Unsigned(8)),
    (0x06, "UNSIGNED16", Class::Unsigned(16)),
    (0x07, "UNSIGNED32", Class::Unsigned(32)),
    (0x08, "REAL32", Class::Real(32)),
    (0x09, "VISIBLE_STRING", Class::Text),
    (0x0A, "OCTET_STRING", Class::Bytes),
    (0x0B, "UNICODE_STRING", Class::Text),
    (0x0C, "TIME_OF_DAY", Class::Bytes),
    (0x0D, "TIME_DIFFERENCE", Class::Bytes),
    (0x0F, "DOMAIN", Class::Bytes),
    (0x10, "INTEGER24", Class::Signed(24)),
    (0x11, "REAL64", Class::Real(64)),
    (0x12, "INTEGER40", Class::Signed(40)),
    (0x13, "INTEGER48", Class::Signed(48)),
    (0x14, "INTEGER56", Class::Signed(56)),
    (0x15, "INTEGER64", Class::Signed(64)),
    (0x16, "UNSIGNED24", Class::Unsigned(24)),
    (0x18, "UNSIGNED40", Class::Unsigned(40)),
    (0x19, "UNSIGNED48", Class::Unsigned(48)),
    (0x1A, "UNSIGNED56", Class::Unsigned(56)),
    (0x1B, "UNSIGNED64", Class::Unsigned(64)),
];

impl DataType {
    /// UNSIGNED8, the type of every sub-index 0.
    pub const UNSIGNED8: DataType = DataType(0x05);
    /// DOMAIN
    pub const DOMAIN: DataType = DataType(0x0F);

    /// The form of the values of this type. Types that CiA 301 does not define are bytes.
    #[must_use]
    pub fn class(self) -> Class {
        self.row().map_or(Class::Bytes, |row| row.2)
    }

    fn row(self) -> Option<&'static (u16, &'static str, Class)> {
        TYPES.iter().find(|row| row.0 == self.0)
    }
}

/// The name in CiA 301, else the number of the type.
impl fmt::Display for DataType {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.row() {
            Some(row) => f.pad(row.1),
            None => write!(f, "{:04X}h", self.0),
        }
    }
}

impl fmt::Debug for DataType {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{self}")
    }
}
