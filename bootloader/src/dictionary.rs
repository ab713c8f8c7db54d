//! The objects of the bootloader: communication (CiA 301) and the program (CiA 302-3).

use canopen::dictionary::{Access, Dictionary, Object, Type};
use canopen::objects;
use update::AUTHORISATION_KEY;

/// 'BOOT': the device type (1000h) of a bootloader.
const BOOT: u32 = 0x424F_4F54;

const fn fixed(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadOnly)
}

/// Permission to change the program, in a bootloader with an authorisation key.
const AUTHORISATION: &[Object] = if AUTHORISATION_KEY.is_some() {
    &[
        Object::highest(0x2003, 3, "Program authorisation"),
        fixed(0x2003, 1, "State", Type::Unsigned8),
        fixed(0x2003, 2, "Challenge", Type::Unsigned64),
        Object::new(0x2003, 3, "Response", Type::Unsigned64, Access::WriteOnly).handled(),
    ]
} else {
    &[]
};

/// The board, which the header of an image names.
const BOARD: &[Object] = &[
    Object::highest(0x2004, 1, "Program state"),
    Object::new(0x2004, 1, "Board", Type::Unsigned32, Access::ReadOnly)
        .value(profiles::product::BOARD as i64),
];

/// 1F51h, whose commands the bootloader decides on.
const CONTROL: [Object; 2] = {
    let [highest, control] = objects::program_control();
    [highest, control.handled()]
};

pub(crate) const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(BOOT), objects::error_register(), objects::device_name("Bootloader")],
    [objects::hardware_version(""), objects::software_version(env!("CARGO_PKG_VERSION"))],
    [objects::heartbeat_producer(1000)],
    objects::identity(0, 0, 0),
    AUTHORISATION,
    BOARD,
    objects::program_data(),
    CONTROL,
    objects::program_identification(),
    objects::flash_status(),
);

pub(crate) static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
