//! PDO objects: eight PDOs in each direction. RPDOs are off by default in every personality; the defaults of the TPDOs
//! depend on the personality.

use canopen::dictionary::{self, Access, DefaultValue, Group, Object, Type};

/// Defaults of a TPDO.
pub struct Tpdo {
    /// Number of the TPDO, from 0.
    pub number: u16,
    /// COB-ID.
    pub cob_id: DefaultValue,
    /// Transmission type.
    pub transmission: i64,
    /// Event timer in ms.
    pub event_timer: i64,
    /// Mapped objects.
    pub mapped: &'static [i64],
}

impl Tpdo {
    /// A TPDO that is off by default. `number` counts from 0.
    #[must_use]
    pub const fn spare(number: u16) -> Tpdo {
        Tpdo { number, cob_id: off(0x180, number), transmission: 255, event_timer: 0, mapped: &[] }
    }
}

/// The default COB-ID of a PDO that is off. The first four PDOs have a CAN-ID in the pre-defined connection set.
#[must_use]
pub const fn off(base: u32, number: u16) -> DefaultValue {
    match number {
        0..=3 => DefaultValue::NodeId((1 << 31) + base + 0x100 * number as u32),
        _ => DefaultValue::Integer(1 << 31),
    }
}

const fn parameter(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadWrite).stored(Group::Communication)
}

/// COB-ID of a PDO, sub-index 1.
#[must_use]
pub const fn cob_id(index: u16, default: DefaultValue) -> Object {
    parameter(index, 1, "COB-ID", Type::Unsigned32).default(default)
}

/// Transmission type of a PDO, sub-index 2.
#[must_use]
pub const fn transmission_type(index: u16, default: i64) -> Object {
    parameter(index, 2, "Transmission type", Type::Unsigned8).value(default)
}

/// Inhibit time of a TPDO in 100 us, sub-index 3.
#[must_use]
pub const fn inhibit_time(index: u16) -> Object {
    parameter(index, 3, "Inhibit time", Type::Unsigned16).unit("100 us")
}

/// Event timer of a PDO in ms, sub-index 5.
#[must_use]
pub const fn event_timer(index: u16, milliseconds: i64) -> Object {
    parameter(index, 5, "Event timer", Type::Unsigned16).value(milliseconds).unit("ms")
}

/// SYNC start value of a TPDO, sub-index 6.
#[must_use]
pub const fn sync_start(index: u16) -> Object {
    parameter(index, 6, "SYNC start value", Type::Unsigned8).limits(0, 240)
}

/// Number of mapped objects. The table has no limit, because 254 and 255 make a multiplexed PDO; the rule of the object
/// checks the number of slots.
#[must_use]
pub const fn count(index: u16, name: &'static str, used: i64) -> Object {
    parameter(index, 0, name, Type::Unsigned8).value(used)
}

/// A mapped object of a PDO: index, sub-index and length in bits.
#[must_use]
pub const fn slot(index: u16, sub: u8, mapped: i64) -> Object {
    parameter(index, sub, "Mapped object", Type::Unsigned32).value(mapped)
}

const fn rpdo(index: u16, cob_id_default: DefaultValue, name: &'static str) -> [Object; 4] {
    let highest = Object::highest(index, 5, name);
    [highest, cob_id(index, cob_id_default), transmission_type(index, 255), event_timer(index, 0)]
}

const fn tpdo(index: u16, default: &Tpdo, name: &'static str) -> [Object; 6] {
    [
        Object::highest(index, 6, name),
        cob_id(index, default.cob_id),
        transmission_type(index, default.transmission),
        inhibit_time(index),
        event_timer(index, default.event_timer),
        sync_start(index),
    ]
}

const fn mapping(index: u16, mapped: &[i64], name: &'static str) -> [Object; 9] {
    let mut rows = [count(index, name, 0); 9];
    let (mut sub, mut used) = (1, 0);
    while sub <= 8 {
        let at = sub as usize - 1;
        rows[sub as usize] = slot(index, sub, if at < mapped.len() { mapped[at] } else { 0 });
        used += (at < mapped.len()) as i64;
        sub += 1;
    }
    rows[0] = count(index, name, used);
    rows
}

const RPDO_NAMES: [[&str; 2]; 8] = [
    ["RPDO 1 communication parameter", "RPDO 1 mapping parameter"],
    ["RPDO 2 communication parameter", "RPDO 2 mapping parameter"],
    ["RPDO 3 communication parameter", "RPDO 3 mapping parameter"],
    ["RPDO 4 communication parameter", "RPDO 4 mapping parameter"],
    ["RPDO 5 communication parameter", "RPDO 5 mapping parameter"],
    ["RPDO 6 communication parameter", "RPDO 6 mapping parameter"],
    ["RPDO 7 communication parameter", "RPDO 7 mapping parameter"],
    ["RPDO 8 communication parameter", "RPDO 8 mapping parameter"],
];

const TPDO_NAMES: [[&str; 2]; 8] = [
    ["TPDO 1 communication parameter", "TPDO 1 mapping parameter"],
    ["TPDO 2 communication parameter", "TPDO 2 mapping parameter"],
    ["TPDO 3 communication parameter", "TPDO 3 mapping parameter"],
    ["TPDO 4 communication parameter", "TPDO 4 mapping parameter"],
    ["TPDO 5 communication parameter", "TPDO 5 mapping parameter"],
    ["TPDO 6 communication parameter", "TPDO 6 mapping parameter"],
    ["TPDO 7 communication parameter", "TPDO 7 mapping parameter"],
    ["TPDO 8 communication parameter", "TPDO 8 mapping parameter"],
];

const fn rpdos() -> [[Object; 4]; 8] {
    let mut rows = [rpdo(0x1400, off(0x200, 0), RPDO_NAMES[0][0]); 8];
    let mut number = 1;
    while number < 8 {
        let name = RPDO_NAMES[number as usize][0];
        rows[number as usize] = rpdo(0x1400 | number, off(0x200, number), name);
        number += 1;
    }
    rows
}

const fn rpdo_mappings() -> [[Object; 9]; 8] {
    let mut rows = [mapping(0x1600, &[], RPDO_NAMES[0][1]); 8];
    let mut number = 1;
    while number < 8 {
        rows[number as usize] = mapping(0x1600 | number, &[], RPDO_NAMES[number as usize][1]);
        number += 1;
    }
    rows
}

const RPDO_PARTS: &[&[Object]] = &[rpdos().as_flattened(), rpdo_mappings().as_flattened()];

/// 1400h to 1607h: eight RPDOs.
pub static RPDOS: [Object; dictionary::count(RPDO_PARTS)] = dictionary::gather(RPDO_PARTS);

/// Communication parameters of these TPDOs.
#[must_use]
pub const fn tpdos<const N: usize>(defaults: &[Tpdo; N]) -> [[Object; 6]; N] {
    let mut rows = [tpdo(0x1800, &defaults[0], ""); N];
    let mut i = 0;
    while i < N {
        let number = defaults[i].number;
        rows[i] = tpdo(0x1800 | number, &defaults[i], TPDO_NAMES[number as usize][0]);
        i += 1;
    }
    rows
}

/// Mapping parameters of these TPDOs.
#[must_use]
pub const fn tpdo_mappings<const N: usize>(defaults: &[Tpdo; N]) -> [[Object; 9]; N] {
    let mut rows = [mapping(0x1A00, &[], ""); N];
    let mut i = 0;
    while i < N {
        let number = defaults[i].number;
        rows[i] = mapping(0x1A00 | number, defaults[i].mapped, TPDO_NAMES[number as usize][1]);
        i += 1;
    }
    rows
}
