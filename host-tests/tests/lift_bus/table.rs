//! The dictionaries of all devices of the small lift: the PDOs that a device produces and consumes, and their mapped
//! objects, as in the catalogue.

use canopen::dictionary::{self, Access, DefaultValue, Dictionary, Mapping, Object, Type};
use profiles::lift::objects::pdos::{multiplexed_tpdo, rpdo, rpdo_mapping, tpdo, tpdo_mapping};

/// Node-IDs.
pub(crate) const CONTROLLER: u8 = 1;
pub(crate) const DRIVE: u8 = 2;
pub(crate) const DOORS: [u8; 2] = [3, 4];
pub(crate) const BARRIERS: [u8; 2] = [5, 6];
pub(crate) const DISPLAY: u8 = 7;
pub(crate) const POSITION: u8 = 16;
pub(crate) const LOAD: u8 = 17;

const COMMUNICATION: &[Object] = &[
    Object::new(0x1000, 0, "Device type", Type::Unsigned32, Access::ReadOnly).value(0x01A1),
    Object::new(0x1001, 0, "Error register", Type::Unsigned8, Access::ReadOnly),
    Object::highest(0x1010, 1, "Store parameters"),
    Object::new(0x1010, 1, "Save all", Type::Unsigned32, Access::ReadWrite).value(1),
    Object::new(0x1014, 0, "COB-ID EMCY", Type::Unsigned32, Access::ReadWrite)
        .default(DefaultValue::NodeId(0x80)),
    Object::new(0x1017, 0, "Producer heartbeat time", Type::Unsigned16, Access::ReadWrite).value(1000),
];

const fn array(index: u16, highest: u8) -> Object {
    Object::highest(index, highest, "")
}

/// An object that the device produces.
const fn out(index: u16, sub: u8, kind: Type) -> Object {
    Object::new(index, sub, "", kind, Access::ReadOnly).mappable(Mapping::Tpdo)
}

/// An object that the device consumes.
const fn take(index: u16, sub: u8, kind: Type) -> Object {
    Object::new(index, sub, "", kind, Access::ReadWrite).mappable(Mapping::Rpdo)
}

/// A dictionary from the parts of its table.
macro_rules! dictionary {
    ($name:ident, $parts:expr) => {
        pub(crate) static $name: Dictionary = {
            const PARTS: &[&[Object]] = $parts;
            const COUNT: usize = dictionary::count(PARTS);
            static TABLE: [Object; COUNT] = dictionary::gather(PARTS);
            canopen::dictionary!(&TABLE)
        };
    };
}

dictionary!(
    CALL_CONTROLLER,
    &[
        COMMUNICATION,
        &rpdo(130, LOAD, ""),
        &rpdo(258, 1, ""),
        &rpdo(260, 1, ""),
        &rpdo(263, 1, ""),
        &rpdo(267, 1, ""),
        &rpdo(268, 1, ""),
        &rpdo(269, 1, ""),
        &rpdo(270, 1, ""),
        &rpdo_mapping::<2>(130, LOAD, ""),
        &rpdo_mapping::<3>(258, 1, ""),
        &rpdo_mapping::<5>(260, 1, ""),
        &rpdo_mapping::<2>(263, 1, ""),
        &rpdo_mapping::<3>(267, 1, ""),
        &rpdo_mapping::<2>(268, 1, ""),
        &rpdo_mapping::<3>(269, 1, ""),
        &rpdo_mapping::<2>(270, 1, ""),
        &tpdo(257, "", true),
        &tpdo(259, "", true),
        &tpdo(265, "", true),
        &tpdo_mapping::<2>(257, ""),
        &tpdo_mapping::<5>(259, ""),
        &tpdo_mapping::<5>(265, ""),
        &[
            take(0x6010, 0, Type::Unsigned48),
            out(0x6011, 0, Type::Unsigned48),
            array(0x6300, 4),
            out(0x6300, 1, Type::Unsigned16),
            out(0x6300, 2, Type::Unsigned16),
            out(0x6300, 3, Type::Unsigned16),
            out(0x6300, 4, Type::Unsigned16),
            array(0x6301, 2),
            take(0x6301, 1, Type::Unsigned16),
            take(0x6301, 2, Type::Unsigned16),
            array(0x6302, 2),
            take(0x6302, 1, Type::Unsigned16),
            take(0x6302, 2, Type::Unsigned16),
            array(0x6310, 2),
            take(0x6310, 1, Type::Unsigned8),
            take(0x6310, 2, Type::Unsigned8),
            array(0x6383, 1),
            take(0x6383, 1, Type::Unsigned32),
            out(0x6400, 0, Type::Unsigned16),
            take(0x6401, 0, Type::Unsigned16),
            out(0x6403, 0, Type::Unsigned8),
            take(0x6404, 0, Type::Unsigned8),
            out(0x6430, 0, Type::Integer32),
            take(0x6433, 0, Type::Integer32),
            array(0x6480, 1),
            take(0x6480, 1, Type::Unsigned16),
            array(0x6482, 1),
            take(0x6482, 1, Type::Unsigned8),
            out(0x67FE, 0, Type::Unsigned8),
        ],
    ]
);

dictionary!(
    CAR_DRIVE,
    &[
        COMMUNICATION,
        &rpdo(259, 1, ""),
        &rpdo_mapping::<5>(259, 1, ""),
        &tpdo(260, "", true),
        &tpdo_mapping::<5>(260, ""),
        &[
            take(0x6400, 0, Type::Unsigned16),
            out(0x6401, 0, Type::Unsigned16),
            take(0x6403, 0, Type::Unsigned8),
            out(0x6404, 0, Type::Unsigned8),
            take(0x6430, 0, Type::Integer32),
            out(0x6433, 0, Type::Integer32),
            out(0x67FE, 0, Type::Unsigned8),
        ],
    ]
);

/// A door unit, with all four control words, because they come in one PDO.
macro_rules! door {
    ($name:ident, $number:literal, $pdo:literal) => {
        dictionary!(
            $name,
            &[
                COMMUNICATION,
                &rpdo(265, 1, ""),
                &rpdo_mapping::<5>(265, 1, ""),
                &tpdo($pdo, "", true),
                &tpdo_mapping::<3>($pdo, ""),
                &[
                    array(0x6300, 4),
                    take(0x6300, 1, Type::Unsigned16),
                    take(0x6300, 2, Type::Unsigned16),
                    take(0x6300, 3, Type::Unsigned16),
                    take(0x6300, 4, Type::Unsigned16),
                    array(0x6301, $number),
                    out(0x6301, $number, Type::Unsigned16),
                    array(0x6302, $number),
                    out(0x6302, $number, Type::Unsigned16),
                ],
            ]
        );
    };
}
door!(DOOR_1, 1, 267);
door!(DOOR_2, 2, 269);

macro_rules! barrier {
    ($name:ident, $number:literal, $pdo:literal) => {
        dictionary!(
            $name,
            &[
                COMMUNICATION,
                &tpdo($pdo, "", true),
                &tpdo_mapping::<2>($pdo, ""),
                &[array(0x6310, $number), out(0x6310, $number, Type::Unsigned8)],
            ]
        );
    };
}
barrier!(BARRIER_1, 1, 268);
barrier!(BARRIER_2, 2, 270);

// Shows the state of the position unit, which it receives by the unit's multiplexed PDO, and sends its own state.
dictionary!(
    DISPLAY_UNIT,
    &[
        COMMUNICATION,
        &rpdo(2, POSITION, ""),
        &rpdo_mapping::<1>(2, POSITION, ""),
        &multiplexed_tpdo(""),
        &tpdo_mapping::<1>(2, ""),
        &[
            array(0x2303, 1),
            take(0x2303, 1, Type::Unsigned8),
            // A manufacturer-specific object, which no other device has.
            out(0x5000, 0, Type::Unsigned16),
        ],
    ]
);
