//! Manufacturer-specific objects of a pressure transmitter, 1002h, 3000h and 4000h.

use canopen::dictionary::{Access, Group, Mapping, Object, Type};

const fn flags(sub: u8, name: &'static str) -> Object {
    Object::new(0x3000, sub, name, Type::Unsigned32, Access::ReadOnly).mappable(Mapping::Tpdo)
}

const fn user(sub: u8) -> Object {
    Object::new(0x4000, sub, "User word", Type::Unsigned32, Access::ReadWrite).stored(Group::Application)
}

/// 1002h, manufacturer status register.
pub(crate) const STATUS_REGISTER: &[Object] =
    &[Object::new(0x1002, 0, "Manufacturer status register", Type::Unsigned32, Access::ReadOnly)
        .mappable(Mapping::Tpdo)];

pub(crate) const STATUS_AND_USER: &[Object] = &[
    Object::highest(0x3000, 3, "Status flags"),
    flags(1, "Sensor status flags"),
    flags(2, "Internal protocol status flags"),
    flags(3, "System status flags"),
    Object::new(0x4000, 0, "Non-volatile user storage", Type::Unsigned8, Access::Const).value(16),
    user(1),
    user(2),
    user(3),
    user(4),
    user(5),
    user(6),
    user(7),
    user(8),
    user(9),
    user(10),
    user(11),
    user(12),
    user(13),
    user(14),
    user(15),
    user(16),
];
