//! Communication profile objects, 1000h to 1029h (CiA 301).

use canopen::dictionary::{Access, DefaultValue, Group, Object, Type};

const fn fixed(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadOnly)
}

const fn text(index: u16, name: &'static str, capacity: u8) -> Object {
    Object::new(index, 0, name, Type::VisibleString(capacity), Access::Const)
}

const fn parameter(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadWrite).stored(Group::Communication)
}

const fn constant(index: u16, name: &'static str, highest: i64) -> Object {
    Object::new(index, 0, name, Type::Unsigned8, Access::Const).value(highest)
}

const fn command(index: u16, sub: u8, name: &'static str) -> Object {
    // Reads 1: stores on command, restores defaults.
    Object::new(index, sub, name, Type::Unsigned32, Access::ReadWrite).value(1)
}

const fn error(sub: u8) -> Object {
    fixed(0x1003, sub, "Standard error field", Type::Unsigned32)
}

const fn watch(sub: u8) -> Object {
    parameter(0x1016, sub, "Watched node and time", Type::Unsigned32)
}

/// 1000h.
#[must_use]
pub const fn device_type(code: i64) -> Object {
    fixed(0x1000, 0, "Device type", Type::Unsigned32).value(code)
}

/// 1001h.
pub const ERROR_REGISTER: Object = fixed(0x1001, 0, "Error register", Type::Unsigned8);

/// 1003h to 1007h.
pub const ERRORS_AND_SYNC: &[Object] = &[
    Object::new(0x1003, 0, "Pre-defined error field", Type::Unsigned8, Access::ReadWrite),
    error(1),
    error(2),
    error(3),
    error(4),
    error(5),
    error(6),
    error(7),
    error(8),
    error(9),
    error(10),
    parameter(0x1005, 0, "COB-ID SYNC", Type::Unsigned32).value(0x80),
    parameter(0x1006, 0, "Communication cycle period", Type::Unsigned32).unit("us"),
    parameter(0x1007, 0, "Synchronous window length", Type::Unsigned32).unit("us"),
];

/// 1008h, at most 32 characters.
#[must_use]
pub const fn device_name(name: &'static str) -> Object {
    text(0x1008, "Manufacturer device name", 32).default(DefaultValue::Text(name))
}

/// 1009h to 1019h.
pub const SERVICES: &[Object] = &[
    text(0x1009, "Manufacturer hardware version", 32),
    text(0x100A, "Manufacturer software version", 50),
    constant(0x1010, "Store parameters", 3),
    command(0x1010, 1, "Save all"),
    command(0x1010, 2, "Save communication"),
    command(0x1010, 3, "Save application"),
    constant(0x1011, "Restore default parameters", 3),
    command(0x1011, 1, "Restore all"),
    command(0x1011, 2, "Restore communication"),
    command(0x1011, 3, "Restore application"),
    parameter(0x1014, 0, "COB-ID EMCY", Type::Unsigned32).default(DefaultValue::NodeId(0x80)),
    parameter(0x1015, 0, "Inhibit time EMCY", Type::Unsigned16).unit("100 us"),
    Object::highest(0x1016, 4, "Consumer heartbeat time"),
    watch(1),
    watch(2),
    watch(3),
    watch(4),
    parameter(0x1017, 0, "Producer heartbeat time", Type::Unsigned16).value(1000).unit("ms"),
    Object::highest(0x1018, 4, "Identity"),
    fixed(0x1018, 1, "Vendor-ID", Type::Unsigned32),
    fixed(0x1018, 2, "Product code", Type::Unsigned32),
    fixed(0x1018, 3, "Revision number", Type::Unsigned32),
    fixed(0x1018, 4, "Serial number", Type::Unsigned32),
    parameter(0x1019, 0, "Synchronous counter overflow value", Type::Unsigned8).limits(0, 240),
];

/// 1029h, with what a fault of the device does by default: 0 pre-operational, 1 nothing.
#[must_use]
pub const fn error_behaviour(device_error: i64) -> [Object; 3] {
    [
        Object::highest(0x1029, 2, "Error behaviour"),
        // 255 is refused, 3 to 254 are kept and change nothing.
        parameter(0x1029, 1, "Communication error", Type::Unsigned8).limits(0, 254),
        parameter(0x1029, 2, "Device error", Type::Unsigned8).limits(0, 2).value(device_error),
    ]
}
