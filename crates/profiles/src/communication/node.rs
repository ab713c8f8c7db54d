//! Manufacturer-specific objects that every device of the project has.

use canopen::dictionary::{Access, Object, Type};

/// Index of the object that says which personality the node has after the next reset.
pub const PERSONALITY: u16 = 0x2000;

/// 2000h, in a node with so many personalities. Stored at once, with node-ID and bit rate: no 1010h is needed. The
/// parameters that are stored belong to the personality that stored them.
#[allow(clippy::cast_possible_wrap)] // There are only a few.
#[must_use]
pub const fn personality(own: u8, count: usize) -> Object {
    Object::new(PERSONALITY, 0, "Personality", Type::Unsigned8, Access::ReadWrite)
        .value(own as i64)
        .limits(0, count as i64 - 1)
        .setting()
}

/// 2F00h: a domain in RAM, for trying out transfers.
pub const TRANSFER_BUFFER: Object =
    Object::new(0x2F00, 0, "Transfer buffer", Type::Domain, Access::ReadWrite);
