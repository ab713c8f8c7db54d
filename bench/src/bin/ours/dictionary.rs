//! The dictionary of the benchmark: every object of the protocol core, four PDOs each way of two INTEGER32, and what
//! the operations read and write. zencan.toml describes the same node.

use canopen::dictionary::{Access, DefaultValue, Dictionary, Group, Mapping, Object, Type};
use canopen::objects;

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

const SENT: [Object; 9] = numbers(0x2000, Access::ReadOnly, Mapping::Tpdo);
const RECEIVED: [Object; 9] = numbers(0x2001, Access::ReadWrite, Mapping::Rpdo);

/// Two of the numbers. Transmission type 254.
const fn rpdo(number: u16) -> [Object; 13] {
    let first = 2 * number as usize - 1;
    objects::multiplexed(objects::with(
        objects::rpdo(number, &[RECEIVED[first], RECEIVED[first + 1]]),
        2,
        254,
    ))
}

/// The first one is sent with every SYNC.
const fn tpdo(number: u16) -> [Object; 15] {
    let first = 2 * number as usize - 1;
    let rows = objects::tpdo(number, &[SENT[first], SENT[first + 1]]);
    objects::multiplexed(objects::with(rows, 2, if number == 1 { 1 } else { 254 }))
}

/// Lines of the scanner list and of the dispatching list.
const fn lines<const N: usize>(index: u16, kind: Type) -> [Object; N] {
    let mut rows = [Object::new(index, 0, "", Type::Unsigned8, Access::ReadWrite); N];
    let mut sub = 1;
    while sub < N {
        rows[sub] = Object::new(index, sub as u8, "", kind, Access::ReadWrite).stored(Group::Communication);
        sub += 1;
    }
    rows[0] = rows[0].limits(0, N as i64 - 1).stored(Group::Communication);
    rows
}

pub(crate) const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register(), objects::device_name("bench")],
    [objects::hardware_version("1"), objects::software_version("1")],
    objects::error_field::<9>(),
    objects::sync_consumer(),
    objects::store_parameters(),
    objects::restore_parameters(),
    objects::emergency(),
    objects::heartbeat_consumer::<5>(),
    [objects::heartbeat_producer(1000)],
    objects::identity(0x1A, 0x2B, 1),
    objects::error_behaviour(0),
    rpdo(1),
    rpdo(2),
    rpdo(3),
    rpdo(4),
    tpdo(1),
    tpdo(2),
    tpdo(3),
    tpdo(4),
    [objects::start_up()],
    lines::<5>(0x1FA0, Type::Unsigned32),
    lines::<3>(0x1FD0, Type::Unsigned64),
    SENT,
    RECEIVED,
    [
        Object::new(0x2002, 0, "", Type::Integer32, Access::ReadWrite).stored(Group::Application),
        Object::new(0x2003, 0, "", Type::VisibleString(32), Access::Const)
            .default(DefaultValue::Text("thirty-two characters, no more..")),
        Object::highest(0x2004, 1, ""),
        Object::new(0x2004, 1, "", Type::Domain, Access::ReadWrite),
        Object::new(0x2005, 0, "", Type::Integer32, Access::ReadWrite).handled(),
    ],
);

pub(crate) static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
