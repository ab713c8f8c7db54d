//! The dictionary of the benchmark: every object of the protocol core, four PDOs each way of two INTEGER32, and what
//! the operations read and write. zencan.toml describes the same node.

use canopen::dictionary::{self, Access, DefaultValue, Dictionary, Group, Mapping, Object, Type};

const fn fixed(index: u16, sub: u8, kind: Type) -> Object {
    Object::new(index, sub, "", kind, Access::ReadOnly)
}

const fn parameter(index: u16, sub: u8, kind: Type) -> Object {
    Object::new(index, sub, "", kind, Access::ReadWrite).stored(Group::Communication)
}

const fn command(index: u16, sub: u8) -> Object {
    Object::new(index, sub, "", Type::Unsigned32, Access::ReadWrite).value(1)
}

const fn error(sub: u8) -> Object {
    fixed(0x1003, sub, Type::Unsigned32)
}

const fn watch(sub: u8) -> Object {
    parameter(0x1016, sub, Type::Unsigned32)
}

const fn text(index: u16, capacity: u8, text: &'static str) -> Object {
    Object::new(index, 0, "", Type::VisibleString(capacity), Access::Const).default(DefaultValue::Text(text))
}

const COMMUNICATION: &[Object] = &[
    fixed(0x1000, 0, Type::Unsigned32),
    fixed(0x1001, 0, Type::Unsigned8),
    Object::new(0x1003, 0, "", Type::Unsigned8, Access::ReadWrite),
    error(1),
    error(2),
    error(3),
    error(4),
    error(5),
    error(6),
    error(7),
    error(8),
    parameter(0x1005, 0, Type::Unsigned32).value(0x80),
    parameter(0x1006, 0, Type::Unsigned32),
    parameter(0x1007, 0, Type::Unsigned32),
    text(0x1008, 5, "bench"),
    text(0x1009, 1, "1"),
    text(0x100A, 1, "1"),
    Object::highest(0x1010, 1, ""),
    command(0x1010, 1),
    Object::highest(0x1011, 1, ""),
    command(0x1011, 1),
    parameter(0x1014, 0, Type::Unsigned32).default(DefaultValue::NodeId(0x80)),
    parameter(0x1015, 0, Type::Unsigned16),
    Object::highest(0x1016, 4, ""),
    watch(1),
    watch(2),
    watch(3),
    watch(4),
    parameter(0x1017, 0, Type::Unsigned16).value(1000),
    Object::highest(0x1018, 4, ""),
    fixed(0x1018, 1, Type::Unsigned32).value(0x1A),
    fixed(0x1018, 2, Type::Unsigned32).value(0x2B),
    fixed(0x1018, 3, Type::Unsigned32).value(1),
    fixed(0x1018, 4, Type::Unsigned32),
    parameter(0x1019, 0, Type::Unsigned8).limits(0, 240),
    Object::highest(0x1029, 1, ""),
    parameter(0x1029, 1, Type::Unsigned8).limits(0, 2),
];

const fn cob_id(index: u16, base: u32) -> Object {
    parameter(index, 1, Type::Unsigned32).default(DefaultValue::NodeId(base))
}

const fn transmission(index: u16, kind: i64) -> Object {
    parameter(index, 2, Type::Unsigned8).value(kind)
}

const fn event_timer(index: u16) -> Object {
    parameter(index, 5, Type::Unsigned16)
}

const fn rpdo(number: u16) -> [Object; 4] {
    let index = 0x1400 | number;
    let base = 0x200 + 0x100 * number as u32;
    [Object::highest(index, 5, ""), cob_id(index, base), transmission(index, 254), event_timer(index)]
}

/// The first one is sent with every SYNC.
const fn tpdo(number: u16) -> [Object; 6] {
    let index = 0x1800 | number;
    let base = 0x180 + 0x100 * number as u32;
    [
        Object::highest(index, 6, ""),
        cob_id(index, base),
        transmission(index, if number == 0 { 1 } else { 254 }),
        parameter(index, 3, Type::Unsigned16),
        event_timer(index),
        parameter(index, 6, Type::Unsigned8).limits(0, 240),
    ]
}

/// Eight slots, of which two name two INTEGER32 of the object.
const fn mapping(index: u16, object: i64) -> [Object; 9] {
    let mut rows = [parameter(index, 0, Type::Unsigned8).value(2); 9];
    let mut sub = 1;
    while sub <= 8 {
        rows[sub as usize] = parameter(index, sub, Type::Unsigned32);
        sub += 1;
    }
    let first = 2 * (index & 3) as i64 + 1;
    rows[1] = rows[1].value(object << 16 | first << 8 | 32);
    rows[2] = rows[2].value(object << 16 | (first + 1) << 8 | 32);
    rows
}

const fn scanner_line(sub: u8) -> Object {
    parameter(0x1FA0, sub, Type::Unsigned32)
}

const START_UP: &[Object] = &[
    parameter(0x1F80, 0, Type::Unsigned32),
    parameter(0x1FA0, 0, Type::Unsigned8).limits(0, 4),
    scanner_line(1),
    scanner_line(2),
    scanner_line(3),
    scanner_line(4),
    parameter(0x1FD0, 0, Type::Unsigned8).limits(0, 2),
    parameter(0x1FD0, 1, Type::Unsigned64),
    parameter(0x1FD0, 2, Type::Unsigned64),
];

/// Eight INTEGER32 with the values 1 to 8.
const fn numbers(index: u16, access: Access, mapping: Mapping) -> [Object; 9] {
    let mut rows = [Object::highest(index, 8, ""); 9];
    let mut sub = 1;
    while sub <= 8 {
        let row = Object::new(index, sub, "", Type::Integer32, access);
        rows[sub as usize] = row.value(sub as i64).mappable(mapping);
        sub += 1;
    }
    rows
}

const OTHERS: &[Object] = &[
    Object::new(0x2002, 0, "", Type::Integer32, Access::ReadWrite).stored(Group::Application),
    text(0x2003, 32, "thirty-two characters, no more.."),
    Object::highest(0x2004, 1, ""),
    Object::new(0x2004, 1, "", Type::Domain, Access::ReadWrite),
];

const PARTS: &[&[Object]] = &[
    COMMUNICATION,
    &rpdo(0),
    &rpdo(1),
    &rpdo(2),
    &rpdo(3),
    &mapping(0x1600, 0x2001),
    &mapping(0x1601, 0x2001),
    &mapping(0x1602, 0x2001),
    &mapping(0x1603, 0x2001),
    &tpdo(0),
    &tpdo(1),
    &tpdo(2),
    &tpdo(3),
    &mapping(0x1A00, 0x2000),
    &mapping(0x1A01, 0x2000),
    &mapping(0x1A02, 0x2000),
    &mapping(0x1A03, 0x2000),
    START_UP,
    &numbers(0x2000, Access::ReadOnly, Mapping::Tpdo),
    &numbers(0x2001, Access::ReadWrite, Mapping::Rpdo),
    OTHERS,
];

const COUNT: usize = dictionary::count(PARTS);
pub(crate) const ROWS: [Object; COUNT] = dictionary::gather(PARTS);
pub(crate) static DICTIONARY: Dictionary = canopen::dictionary!(&ROWS);
