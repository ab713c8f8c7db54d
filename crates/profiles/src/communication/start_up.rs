//! Objects after the PDOs: programs, start-up, multiplexed PDOs (CiA 301, CiA 302-2, CiA 302-3).

use canopen::dictionary::{Access, Group, Object, Type};

const fn fixed(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadOnly)
}

const fn parameter(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadWrite).stored(Group::Communication)
}

/// 1F51h to 1FD0h.
pub const START_UP: &[Object] = &[
    Object::highest(0x1F51, 1, "Program control"),
    Object::new(0x1F51, 1, "Program 1 control", Type::Unsigned8, Access::ReadWrite).value(1),
    Object::highest(0x1F56, 1, "Program identification"),
    fixed(0x1F56, 1, "Program 1 identification", Type::Unsigned32),
    Object::highest(0x1F57, 1, "Flash status"),
    fixed(0x1F57, 1, "Program 1 flash status", Type::Unsigned32),
    parameter(0x1F80, 0, "NMT start-up", Type::Unsigned32),
    parameter(0x1FA0, 0, "Object scanner list", Type::Unsigned8).limits(0, 8),
    scanner_line(1),
    scanner_line(2),
    scanner_line(3),
    scanner_line(4),
    scanner_line(5),
    scanner_line(6),
    scanner_line(7),
    scanner_line(8),
    parameter(0x1FD0, 0, "Object dispatching list", Type::Unsigned8).limits(0, 8),
    dispatching_line(1),
    dispatching_line(2),
    dispatching_line(3),
    dispatching_line(4),
    dispatching_line(5),
    dispatching_line(6),
    dispatching_line(7),
    dispatching_line(8),
];

const fn scanner_line(sub: u8) -> Object {
    parameter(0x1FA0, sub, "Scanned objects", Type::Unsigned32)
}

const fn dispatching_line(sub: u8) -> Object {
    parameter(0x1FD0, sub, "Dispatched objects", Type::Unsigned64)
}
