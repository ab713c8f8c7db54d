//! The objects for the download of a program (CiA 302-3), for a device with one program.

use super::fixed;
use crate::dictionary::{Access, Object, Type};

/// 1F50h, program data: the domain that takes a new program.
#[must_use]
pub const fn program_data() -> [Object; 2] {
    [
        Object::highest(0x1F50, 1, "Program data"),
        Object::new(0x1F50, 1, "Program 1 data", Type::Domain, Access::WriteOnly),
    ]
}

/// 1F51h, program control: starts, stops and clears the program, and reads whether the program runs.
#[must_use]
pub const fn program_control() -> [Object; 2] {
    [
        Object::highest(0x1F51, 1, "Program control"),
        Object::new(0x1F51, 1, "Program 1 control", Type::Unsigned8, Access::ReadWrite),
    ]
}

/// 1F56h, program software identification. The application writes its value.
#[must_use]
pub const fn program_identification() -> [Object; 2] {
    [
        Object::highest(0x1F56, 1, "Program identification"),
        fixed(0x1F56, 1, "Program 1 identification", Type::Unsigned32),
    ]
}

/// 1F57h, flash status. The application writes its value.
#[must_use]
pub const fn flash_status() -> [Object; 2] {
    [Object::highest(0x1F57, 1, "Flash status"), fixed(0x1F57, 1, "Program 1 flash status", Type::Unsigned32)]
}
