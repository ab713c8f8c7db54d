//! The objects of the bootloader: communication (CiA 301) and the program (CiA 302-3).

use canopen::dictionary::{self, Access, DefaultValue, Dictionary, Object, Type};

/// 'BOOT': what 1000h reads in a bootloader.
const BOOT: i64 = 0x424F_4F54;

const fn fixed(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadOnly)
}

const OBJECTS: [Object; 19] = [
    fixed(0x1000, 0, "Device type", Type::Unsigned32).value(BOOT),
    fixed(0x1001, 0, "Error register", Type::Unsigned8),
    fixed(0x1008, 0, "Manufacturer device name", Type::VisibleString(10))
        .default(DefaultValue::Text("Bootloader")),
    fixed(0x1009, 0, "Manufacturer hardware version", Type::VisibleString(13)),
    fixed(0x100A, 0, "Manufacturer software version", Type::VisibleString(11))
        .default(DefaultValue::Text(env!("CARGO_PKG_VERSION"))),
    Object::new(0x1017, 0, "Producer heartbeat time", Type::Unsigned16, Access::ReadWrite).value(1000),
    Object::highest(0x1018, 4, "Identity"),
    fixed(0x1018, 1, "Vendor-ID", Type::Unsigned32),
    fixed(0x1018, 2, "Product code", Type::Unsigned32),
    fixed(0x1018, 3, "Revision number", Type::Unsigned32),
    fixed(0x1018, 4, "Serial number", Type::Unsigned32),
    Object::highest(0x1F50, 1, "Program data"),
    Object::new(0x1F50, 1, "Program 1 data", Type::Domain, Access::WriteOnly),
    Object::highest(0x1F51, 1, "Program control"),
    Object::new(0x1F51, 1, "Program 1 control", Type::Unsigned8, Access::ReadWrite).handled(),
    Object::highest(0x1F56, 1, "Program identification"),
    fixed(0x1F56, 1, "Program 1 identification", Type::Unsigned32),
    Object::highest(0x1F57, 1, "Flash status"),
    fixed(0x1F57, 1, "Program 1 flash status", Type::Unsigned32),
];

/// Bytes of the image of all values.
pub(crate) const IMAGE_SIZE: usize = dictionary::image_size(&OBJECTS);

pub(crate) static DICTIONARY: Dictionary = canopen::dictionary!(&OBJECTS);
