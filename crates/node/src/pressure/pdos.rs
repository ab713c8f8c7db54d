//! PDO objects: eight PDOs each way. TPDO 1 and 2 are those of the pressure transmitter; the others wait for a use.

use canopen::dictionary::{Access, DefaultValue, Group, Object, Rule, Type};

/// The default COB-ID of a PDO that is switched off: the first four have a place in the pre-defined connection set.
const fn off(base: u32, number: u16) -> DefaultValue {
    match number {
        0..=3 => DefaultValue::NodeId((1 << 31) + base + 0x100 * number as u32),
        _ => DefaultValue::Integer(1 << 31),
    }
}

const fn parameter(index: u16, sub: u8, name: &'static str, kind: Type, rule: Rule) -> Object {
    Object::new(index, sub, name, kind, Access::ReadWrite).saved(Group::Communication).rule(rule)
}

const fn cob_id(index: u16, default: DefaultValue) -> Object {
    parameter(index, 1, "COB-ID", Type::Unsigned32, Rule::PdoCobId).default(default)
}

const fn transmission_type(index: u16) -> Object {
    parameter(index, 2, "Transmission type", Type::Unsigned8, Rule::PdoType).value(255)
}

const fn inhibit_time(index: u16) -> Object {
    parameter(index, 3, "Inhibit time", Type::Unsigned16, Rule::PdoInhibit).unit("100 us")
}

const fn event_timer(index: u16, milliseconds: i64) -> Object {
    parameter(index, 5, "Event timer", Type::Unsigned16, Rule::PdoEventTimer).value(milliseconds).unit("ms")
}

const fn sync_start(index: u16) -> Object {
    parameter(index, 6, "SYNC start value", Type::Unsigned8, Rule::PdoSyncStart).limits(0, 240)
}

const fn count(index: u16, name: &'static str, slots: i64, used: i64) -> Object {
    parameter(index, 0, name, Type::Unsigned8, Rule::PdoCount).limits(0, slots).value(used)
}

const fn slot(index: u16, sub: u8, mapped: i64) -> Object {
    parameter(index, sub, "Mapped object", Type::Unsigned32, Rule::PdoSlot).value(mapped)
}

/// The four objects of a TPDO of the transmitter: neither a SYNC start value nor more than four mapped objects.
const fn transmitter(index: u16, name: &'static str, default: DefaultValue) -> [Object; 5] {
    let highest = Object::highest(index, 5, name);
    [highest, cob_id(index, default), transmission_type(index), inhibit_time(index), event_timer(index, 1000)]
}

const TPDO1: [Object; 5] = transmitter(0x1800, "TPDO 1 communication parameter", DefaultValue::NodeId(0x180));
const TPDO2: [Object; 5] = transmitter(0x1801, "TPDO 2 communication parameter", off(0x180, 1));

const TRANSMITTER_MAPPING: &[Object] = &[
    count(0x1A00, "TPDO 1 mapping parameter", 4, 2),
    slot(0x1A00, 1, 0x6130_0120),
    slot(0x1A00, 2, 0x6130_0220),
    slot(0x1A00, 3, 0),
    slot(0x1A00, 4, 0),
    count(0x1A01, "TPDO 2 mapping parameter", 4, 0),
    slot(0x1A01, 1, 0),
    slot(0x1A01, 2, 0),
    slot(0x1A01, 3, 0),
    slot(0x1A01, 4, 0),
];

const fn tpdo(number: u16, name: &'static str) -> [Object; 6] {
    let index = 0x1800 | number;
    let [highest, sync] = [Object::highest(index, 6, name), sync_start(index)];
    let [cob_id, event] = [cob_id(index, off(0x180, number)), event_timer(index, 0)];
    [highest, cob_id, transmission_type(index), inhibit_time(index), event, sync]
}

const fn rpdo(number: u16, name: &'static str) -> [Object; 4] {
    let index = 0x1400 | number;
    let highest = Object::highest(index, 5, name);
    [highest, cob_id(index, off(0x200, number)), transmission_type(index), event_timer(index, 0)]
}

const fn mapping(index: u16, name: &'static str) -> [Object; 9] {
    // No limit in the table: 254 and 255 make it a multiplexed PDO, and the rule knows how many slots there are.
    let count = parameter(index, 0, name, Type::Unsigned8, Rule::PdoCount);
    let mut rows = [count; 9];
    let mut sub = 1;
    while sub <= 8 {
        rows[sub as usize] = slot(index, sub, 0);
        sub += 1;
    }
    rows
}

/// All of them, in the order of the table.
pub(super) const PARTS: &[&[Object]] = &[
    &rpdo(0, "RPDO 1 communication parameter"),
    &rpdo(1, "RPDO 2 communication parameter"),
    &rpdo(2, "RPDO 3 communication parameter"),
    &rpdo(3, "RPDO 4 communication parameter"),
    &rpdo(4, "RPDO 5 communication parameter"),
    &rpdo(5, "RPDO 6 communication parameter"),
    &rpdo(6, "RPDO 7 communication parameter"),
    &rpdo(7, "RPDO 8 communication parameter"),
    &mapping(0x1600, "RPDO 1 mapping parameter"),
    &mapping(0x1601, "RPDO 2 mapping parameter"),
    &mapping(0x1602, "RPDO 3 mapping parameter"),
    &mapping(0x1603, "RPDO 4 mapping parameter"),
    &mapping(0x1604, "RPDO 5 mapping parameter"),
    &mapping(0x1605, "RPDO 6 mapping parameter"),
    &mapping(0x1606, "RPDO 7 mapping parameter"),
    &mapping(0x1607, "RPDO 8 mapping parameter"),
    &TPDO1,
    &TPDO2,
    &tpdo(2, "TPDO 3 communication parameter"),
    &tpdo(3, "TPDO 4 communication parameter"),
    &tpdo(4, "TPDO 5 communication parameter"),
    &tpdo(5, "TPDO 6 communication parameter"),
    &tpdo(6, "TPDO 7 communication parameter"),
    &tpdo(7, "TPDO 8 communication parameter"),
    TRANSMITTER_MAPPING,
    &mapping(0x1A02, "TPDO 3 mapping parameter"),
    &mapping(0x1A03, "TPDO 4 mapping parameter"),
    &mapping(0x1A04, "TPDO 5 mapping parameter"),
    &mapping(0x1A05, "TPDO 6 mapping parameter"),
    &mapping(0x1A06, "TPDO 7 mapping parameter"),
    &mapping(0x1A07, "TPDO 8 mapping parameter"),
];
