//! The dictionary of the device under test.

use canopen::dictionary::{Access, DefaultValue, Dictionary, Entry, Group, Mapping, Object, Type};

const fn parameter(index: u16, sub: u8, kind: Type) -> Object {
    Object::new(index, sub, "", kind, Access::ReadWrite).stored(Group::Communication)
}

const fn value(index: u16, sub: u8, kind: Type) -> Object {
    Object::new(index, sub, "", kind, Access::ReadOnly).mappable(Mapping::Tpdo)
}

const fn command(index: u16, sub: u8) -> Object {
    Object::new(index, sub, "", Type::Unsigned32, Access::ReadWrite).value(1)
}

pub(crate) const ROWS: &[Object] = &[
    Object::new(0x1000, 0, "", Type::Unsigned32, Access::ReadOnly).value(0x0002_0194),
    Object::new(0x1001, 0, "", Type::Unsigned8, Access::ReadOnly),
    Object::new(0x1003, 0, "", Type::Unsigned8, Access::ReadWrite),
    Object::new(0x1003, 1, "", Type::Unsigned32, Access::ReadOnly),
    Object::new(0x1003, 2, "", Type::Unsigned32, Access::ReadOnly),
    parameter(0x1005, 0, Type::Unsigned32).value(0x80),
    parameter(0x1006, 0, Type::Unsigned32),
    parameter(0x1007, 0, Type::Unsigned32),
    Object::new(0x1008, 0, "", Type::VisibleString(32), Access::Const)
        .default(DefaultValue::Text("a name of twenty-six chars")),
    Object::highest(0x1010, 3, ""),
    command(0x1010, 1),
    command(0x1010, 2),
    command(0x1010, 3),
    Object::highest(0x1011, 3, ""),
    command(0x1011, 1),
    command(0x1011, 2),
    command(0x1011, 3),
    parameter(0x1014, 0, Type::Unsigned32).default(DefaultValue::NodeId(0x80)),
    parameter(0x1015, 0, Type::Unsigned16),
    Object::highest(0x1016, 4, ""),
    parameter(0x1016, 1, Type::Unsigned32),
    parameter(0x1016, 2, Type::Unsigned32),
    parameter(0x1016, 3, Type::Unsigned32),
    parameter(0x1016, 4, Type::Unsigned32),
    parameter(0x1017, 0, Type::Unsigned16).value(1000),
    Object::highest(0x1018, 4, ""),
    Object::new(0x1018, 1, "", Type::Unsigned32, Access::ReadOnly).value(0x1A),
    Object::new(0x1018, 2, "", Type::Unsigned32, Access::ReadOnly).value(0x2B),
    Object::new(0x1018, 3, "", Type::Unsigned32, Access::ReadOnly).value(0x0001_0002),
    Object::new(0x1018, 4, "", Type::Unsigned32, Access::ReadOnly).value(0x8000_0005),
    parameter(0x1019, 0, Type::Unsigned8).limits(0, 240),
    Object::highest(0x1029, 2, ""),
    parameter(0x1029, 1, Type::Unsigned8).limits(0, 254),
    parameter(0x1029, 2, Type::Unsigned8).limits(0, 2),
    Object::highest(0x1400, 5, ""),
    parameter(0x1400, 1, Type::Unsigned32).default(DefaultValue::NodeId(0x8000_0200)),
    parameter(0x1400, 2, Type::Unsigned8).value(255),
    parameter(0x1400, 5, Type::Unsigned16),
    Object::highest(0x1401, 5, ""),
    parameter(0x1401, 1, Type::Unsigned32).default(DefaultValue::NodeId(0x8000_0300)),
    parameter(0x1401, 2, Type::Unsigned8).value(1),
    parameter(0x1401, 5, Type::Unsigned16),
    parameter(0x1600, 0, Type::Unsigned8),
    parameter(0x1600, 1, Type::Unsigned32),
    parameter(0x1600, 2, Type::Unsigned32),
    parameter(0x1601, 0, Type::Unsigned8).limits(0, 2).value(1),
    parameter(0x1601, 1, Type::Unsigned32).value(0x6200_0010),
    parameter(0x1601, 2, Type::Unsigned32),
    Object::highest(0x1800, 6, ""),
    parameter(0x1800, 1, Type::Unsigned32).default(DefaultValue::NodeId(0x180)),
    parameter(0x1800, 2, Type::Unsigned8).value(255),
    parameter(0x1800, 3, Type::Unsigned16),
    parameter(0x1800, 5, Type::Unsigned16).value(100),
    parameter(0x1800, 6, Type::Unsigned8).limits(0, 240),
    parameter(0x1A00, 0, Type::Unsigned8).value(1),
    parameter(0x1A00, 1, Type::Unsigned32).value(0x6000_0120),
    parameter(0x1A00, 2, Type::Unsigned32),
    parameter(0x1A00, 3, Type::Unsigned32),
    parameter(0x1A00, 4, Type::Unsigned32),
    parameter(0x1F80, 0, Type::Unsigned32),
    parameter(0x1FA0, 0, Type::Unsigned8).limits(0, 2),
    parameter(0x1FA0, 1, Type::Unsigned32),
    parameter(0x1FA0, 2, Type::Unsigned32),
    parameter(0x1FD0, 0, Type::Unsigned8).limits(0, 2),
    parameter(0x1FD0, 1, Type::Unsigned64),
    parameter(0x1FD0, 2, Type::Unsigned64),
    Object::new(0x5F00, 0, "", Type::Unsigned8, Access::ReadWrite).limits(0, 2).setting(),
    parameter(0x5F01, 0, Type::Unsigned8).value(3),
    Object::highest(0x6000, 3, ""),
    value(0x6000, 1, Type::Integer32),
    value(0x6000, 2, Type::Integer16),
    value(0x6000, 3, Type::Integer32),
    Object::new(0x6100, 0, "", Type::Integer16, Access::ReadWrite).limits(-5, 5).stored(Group::Application),
    Object::new(0x6101, 0, "", Type::Real32, Access::ReadWrite).stored(Group::Application),
    Object::new(0x6102, 0, "", Type::Unsigned32, Access::WriteOnly).handled(),
    Object::new(0x6103, 0, "", Type::VisibleString(20), Access::ReadWrite).stored(Group::Application),
    Object::new(0x6104, 0, "", Type::Domain, Access::ReadWrite).handled(),
    Object::new(0x6105, 0, "", Type::Unsigned16, Access::ReadWrite).event_timer_of(0),
    Object::new(0x6106, 0, "", Type::Real32, Access::ReadWrite).stored(Group::Calibration),
    Object::new(0x6107, 0, "", Type::Unsigned32, Access::ReadWrite).value(1).stores_calibration(),
    Object::new(0x6200, 0, "", Type::Unsigned16, Access::ReadWrite).mappable(Mapping::Rpdo),
    Object::new(0x6201, 0, "", Type::Unsigned8, Access::ReadWrite).mappable(Mapping::Rpdo).handled(),
    Object::new(0x6202, 0, "", Type::Boolean, Access::ReadWrite).mappable(Mapping::Rpdo),
    Object::new(0x6203, 0, "", Type::Integer16, Access::ReadWrite).limits(-5, 5).mappable(Mapping::Rpdo),
    Object::new(0x6204, 0, "", Type::Unsigned64, Access::ReadWrite).mappable(Mapping::Both),
];

pub(crate) const DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

/// The rows and their entries, for comparisons.
pub(crate) fn rows() -> impl Iterator<Item = (&'static Object, Entry)> {
    ROWS.iter().zip(DICTIONARY.entries())
}
