//! PDO objects of CiA 417 from the catalogue. The profile fixes their CAN-IDs and mappings.
//!
//! A device has the PDOs of its virtual devices. It has no PDO of the pre-defined connection set of CiA 301 (1800h to
//! 1803h with 180h + node-ID and up), so no two PDOs of a lift device can have the same CAN-ID.
#![allow(clippy::indexing_slicing, clippy::expect_used, reason = "evaluated by the compiler")]

use crate::communication::{self, inhibit_time, sync_start};
use crate::lift::catalogue::{CobId, Content, Pdo, by_number};
use canopen::dictionary::{self, Access, DefaultValue, Object, Type};

/// Flag of a COB-ID: the PDO is off. `NO_REMOTE`: no remote frames.
const OFF: u32 = 1 << 31;
const NO_REMOTE: u32 = 1 << 30;

/// A COB-ID whose flags alone can be changed.
const fn cob_id(index: u16, default: DefaultValue) -> Object {
    communication::cob_id(index, default).predefined()
}

/// 255: the profile defines the event.
const fn transmission_type(index: u16) -> Object {
    communication::transmission_type(index, 255)
}

const fn event_timer(index: u16) -> Object {
    communication::event_timer(index, 0)
}

/// The COB-ID of a producer.
const fn produced(pdo: &Pdo, flags: u32) -> DefaultValue {
    match pdo.cob_id {
        CobId::Fixed(id) => DefaultValue::Integer((id as u32 | flags) as i64),
        CobId::PlusNode(base) => DefaultValue::NodeId(base as u32 | flags),
    }
}

const fn pdo(number: u16) -> &'static Pdo {
    by_number(number).expect("no PDO of the catalogue has this number")
}

/// The communication parameter of a TPDO, 1800h + `number` - 1. With `is_on` false the TPDO does not send until it is
/// switched on.
///
/// # Panics
/// During compilation, if the catalogue does not have the number.
#[must_use]
pub const fn tpdo(number: u16, name: &'static str, is_on: bool) -> [Object; 6] {
    let pdo = pdo(number);
    let index = pdo.tpdo_index();
    let off = if is_on { 0 } else { OFF };
    [
        Object::highest(index, 6, name),
        cob_id(index, produced(pdo, NO_REMOTE | off)),
        transmission_type(index),
        inhibit_time(index),
        event_timer(index),
        sync_start(index),
    ]
}

/// The communication parameter of TPDO 2, the multiplexed PDO: no bit 30 in its COB-ID, and no SYNC start value.
///
/// # Panics
/// Never: the catalogue has number 2.
#[must_use]
pub const fn multiplexed_tpdo(name: &'static str) -> [Object; 5] {
    let pdo = pdo(2);
    let index = pdo.tpdo_index();
    let highest = Object::highest(index, 5, name);
    [
        highest,
        cob_id(index, produced(pdo, 0)),
        transmission_type(index),
        inhibit_time(index),
        event_timer(index),
    ]
}

/// The communication parameter of the RPDO for the PDO of `producer`. For a PDO with the same CAN-ID in all devices,
/// any producer will do.
///
/// # Panics
/// During compilation, if the catalogue does not have the number.
#[must_use]
pub const fn rpdo(number: u16, producer: u8, name: &'static str) -> [Object; 4] {
    let pdo = pdo(number);
    let index = pdo.rpdo_index(producer).expect("the producer is no node");
    let id = DefaultValue::Integer(pdo.can_id(producer) as i64);
    [Object::highest(index, 5, name), cob_id(index, id), transmission_type(index), event_timer(index)]
}

/// The mapping parameter of a TPDO. `N` is the number of mapped objects plus one.
///
/// # Panics
/// During compilation, if `N` is wrong or the catalogue does not have the number.
#[must_use]
pub const fn tpdo_mapping<const N: usize>(number: u16, name: &'static str) -> [Object; N] {
    let pdo = pdo(number);
    mapping(pdo, pdo.tpdo_index() + MAPPING, name, false)
}

/// The mapping parameter of an RPDO: that of the TPDO, with reserved bytes replaced by dummy objects.
///
/// # Panics
/// In the cases of [`tpdo_mapping`] and [`rpdo`].
#[must_use]
pub const fn rpdo_mapping<const N: usize>(number: u16, producer: u8, name: &'static str) -> [Object; N] {
    let pdo = pdo(number);
    mapping(pdo, pdo.rpdo_index(producer).expect("the producer is no node") + MAPPING, name, true)
}

/// Distance from a communication parameter to its mapping parameter.
const MAPPING: u16 = 0x200;
/// The number of mapped objects that makes a PDO a multiplexed one in destination address mode (CiA 301, 7.2.2.6).
const DESTINATION: i64 = 0xFF;

const fn mapping<const N: usize>(
    pdo: &Pdo,
    index: u16,
    name: &'static str,
    is_consumed: bool,
) -> [Object; N] {
    let count = Object::new(index, 0, name, Type::Unsigned8, Access::Const);
    let Content::Objects(objects) = pdo.content else { return [count.value(DESTINATION); N] };
    assert!(objects.len() + 1 == N, "N is not the number of rows");
    let mut rows = [count; N];
    let mut sub: u8 = 1;
    while (sub as usize) < N {
        let object =
            if is_consumed { objects[sub as usize - 1].consumed() } else { objects[sub as usize - 1] };
        let row = Object::new(index, sub, "Mapped object", Type::Unsigned32, Access::Const);
        rows[sub as usize] = row.value(object.entry() as i64);
        rows[0] = count.value(sub as i64);
        sub += 1;
    }
    rows
}

macro_rules! communication {
    ($direction:literal, $number:literal) => {
        concat!($direction, " ", $number, " communication parameter")
    };
}

macro_rules! mapped {
    ($direction:literal, $number:literal) => {
        concat!($direction, " ", $number, " mapping parameter")
    };
}

/// PDOs of this node. It consumes virtual outputs and the multiplexed PDOs of the nodes 1 to 7. It produces its own
/// multiplexed PDO, virtual inputs, the load and the positions. TPDOs whose CAN-ID is the same in every device are off
/// until the virtual device is chosen, because two nodes as delivered must not send with the same CAN-ID.
const PARTS: &[&[Object]] = &[
    &rpdo(2, 1, communication!("RPDO", 2)),
    &rpdo(2, 2, communication!("RPDO", 3)),
    &rpdo(2, 3, communication!("RPDO", 4)),
    &rpdo(2, 4, communication!("RPDO", 5)),
    &rpdo(2, 5, communication!("RPDO", 6)),
    &rpdo(2, 6, communication!("RPDO", 7)),
    &rpdo(2, 7, communication!("RPDO", 8)),
    &rpdo(257, 1, communication!("RPDO", 257)),
    &rpdo_mapping::<1>(2, 1, mapped!("RPDO", 2)),
    &rpdo_mapping::<1>(2, 2, mapped!("RPDO", 3)),
    &rpdo_mapping::<1>(2, 3, mapped!("RPDO", 4)),
    &rpdo_mapping::<1>(2, 4, mapped!("RPDO", 5)),
    &rpdo_mapping::<1>(2, 5, mapped!("RPDO", 6)),
    &rpdo_mapping::<1>(2, 6, mapped!("RPDO", 7)),
    &rpdo_mapping::<1>(2, 7, mapped!("RPDO", 8)),
    &rpdo_mapping::<2>(257, 1, mapped!("RPDO", 257)),
    &multiplexed_tpdo(communication!("TPDO", 2)),
    &tpdo(130, communication!("TPDO", 130), true),
    &tpdo(258, communication!("TPDO", 258), false),
    &tpdo(263, communication!("TPDO", 263), false),
    &tpdo(264, communication!("TPDO", 264), false),
    &tpdo(385, communication!("TPDO", 385), false),
    &tpdo(386, communication!("TPDO", 386), false),
    &tpdo_mapping::<1>(2, mapped!("TPDO", 2)),
    &tpdo_mapping::<2>(130, mapped!("TPDO", 130)),
    &tpdo_mapping::<3>(258, mapped!("TPDO", 258)),
    &tpdo_mapping::<2>(263, mapped!("TPDO", 263)),
    &tpdo_mapping::<2>(264, mapped!("TPDO", 264)),
    &tpdo_mapping::<2>(385, mapped!("TPDO", 385)),
    &tpdo_mapping::<2>(386, mapped!("TPDO", 386)),
];

/// The rows in the order of the table.
pub(super) static ROWS: [Object; dictionary::count(PARTS)] = dictionary::gather(PARTS);
