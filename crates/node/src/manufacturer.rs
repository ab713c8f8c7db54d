//! Manufacturer-specific objects that every personality has.

use crate::Personality;
use canopen::dictionary::{Access, Object, Type};

/// Index of the object that says which personality the node has after the next reset.
pub(crate) const PERSONALITY: u16 = 0x2000;

/// 2000h. Stored at once, with node-ID and bit rate: no 1010h is needed. The parameters that are saved belong to the
/// personality that saved them.
#[allow(clippy::cast_possible_wrap)] // There are only a few.
pub(crate) const fn personality(own: Personality) -> Object {
    Object::new(PERSONALITY, 0, "Personality", Type::Unsigned8, Access::ReadWrite)
        .value(own.number() as i64)
        .limits(0, Personality::ALL.len() as i64 - 1)
        .setting()
}

/// 2F00h, the one domain there is.
pub(crate) const TRANSFER_BUFFER: Object =
    Object::new(0x2F00, 0, "Transfer buffer", Type::Domain, Access::ReadWrite);
