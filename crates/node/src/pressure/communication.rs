//! Communication profile objects, 1000h to 1FFFh (CiA 301, CiA 302-2).

use canopen::dictionary::{Access, Group, Mapping, Object, Rule, Type};

const fn fixed(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadOnly)
}

const fn text(index: u16, name: &'static str, capacity: u8) -> Object {
    Object::new(index, 0, name, Type::VisibleString(capacity), Access::Const)
}

const fn parameter(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadWrite).saved(Group::Communication)
}

const fn error(sub: u8) -> Object {
    fixed(0x1003, sub, "Standard error field", Type::Unsigned32).rule(Rule::ErrorEntry)
}

const fn cob_id(index: u16, default: u32) -> Object {
    use canopen::dictionary::DefaultValue::NodeId;
    parameter(index, 1, "COB-ID", Type::Unsigned32).default(NodeId(default)).rule(Rule::PdoCobId)
}

const fn transmission_type(index: u16) -> Object {
    parameter(index, 2, "Transmission type", Type::Unsigned8).value(255).rule(Rule::PdoType)
}

const fn inhibit_time(index: u16) -> Object {
    parameter(index, 3, "Inhibit time", Type::Unsigned16).unit("100 us").rule(Rule::PdoInhibit)
}

const fn event_timer(index: u16) -> Object {
    parameter(index, 5, "Event timer", Type::Unsigned16).value(1000).unit("ms").rule(Rule::PdoEventTimer)
}

const fn map_count(index: u16, name: &'static str, count: i64) -> Object {
    parameter(index, 0, name, Type::Unsigned8).limits(0, 4).value(count).rule(Rule::PdoCount)
}

const fn map(index: u16, sub: u8, mapped: i64) -> Object {
    parameter(index, sub, "Mapped object", Type::Unsigned32).value(mapped).rule(Rule::PdoSlot)
}

pub(super) const OBJECTS: &[Object] = &[
    fixed(0x1000, 0, "Device type", Type::Unsigned32).value(0x0002_0194),
    fixed(0x1001, 0, "Error register", Type::Unsigned8),
    fixed(0x1002, 0, "Manufacturer status register", Type::Unsigned32).mappable(Mapping::Tpdo),
    Object::new(0x1003, 0, "Pre-defined error field", Type::Unsigned8, Access::ReadWrite)
        .rule(Rule::ErrorCount),
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
    parameter(0x1005, 0, "COB-ID SYNC", Type::Unsigned32).value(0x80).rule(Rule::SyncCobId),
    text(0x1008, "Manufacturer device name", 32)
        .default(canopen::dictionary::DefaultValue::Text("STM32F4 pressure transmitter")),
    text(0x1009, "Manufacturer hardware version", 32),
    text(0x100A, "Manufacturer software version", 50),
    parameter(0x1014, 0, "COB-ID EMCY", Type::Unsigned32)
        .default(canopen::dictionary::DefaultValue::NodeId(0x80))
        .rule(Rule::EmcyCobId),
    parameter(0x1017, 0, "Producer heartbeat time", Type::Unsigned16)
        .value(1000)
        .unit("ms")
        .rule(Rule::HeartbeatTime),
    Object::highest(0x1018, 4, "Identity"),
    fixed(0x1018, 1, "Vendor-ID", Type::Unsigned32),
    fixed(0x1018, 2, "Product code", Type::Unsigned32),
    fixed(0x1018, 3, "Revision number", Type::Unsigned32),
    fixed(0x1018, 4, "Serial number", Type::Unsigned32),
    Object::highest(0x1029, 2, "Error behaviour"),
    // 255 is refused, 3 to 254 are kept and change nothing.
    parameter(0x1029, 1, "Communication error", Type::Unsigned8).limits(0, 254),
    parameter(0x1029, 2, "Device error", Type::Unsigned8).limits(0, 2),
    Object::highest(0x1800, 5, "TPDO 1 communication parameter"),
    cob_id(0x1800, 0x180),
    transmission_type(0x1800),
    inhibit_time(0x1800),
    event_timer(0x1800),
    Object::highest(0x1801, 5, "TPDO 2 communication parameter"),
    cob_id(0x1801, 0x8000_0280),
    transmission_type(0x1801),
    inhibit_time(0x1801),
    event_timer(0x1801),
    map_count(0x1A00, "TPDO 1 mapping parameter", 2),
    map(0x1A00, 1, 0x6130_0120),
    map(0x1A00, 2, 0x6130_0220),
    map(0x1A00, 3, 0),
    map(0x1A00, 4, 0),
    map_count(0x1A01, "TPDO 2 mapping parameter", 0),
    map(0x1A01, 1, 0),
    map(0x1A01, 2, 0),
    map(0x1A01, 3, 0),
    map(0x1A01, 4, 0),
    parameter(0x1F80, 0, "NMT start-up", Type::Unsigned32).rule(Rule::StartUp),
];
