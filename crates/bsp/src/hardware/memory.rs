//! The regions of memory.x, as the linker knows them.

use core::ops::Range;

use crate::checksum::CRC;

unsafe extern "C" {
    static _stack_start: u8;
    static _stack_end: u8;
    static _ram_end: u8;
    static _parameters_start: u8;
    static _parameters_end: u8;
    static _application_start: u8;
    static _application_end: u8;
    static _program_end: u8;
}

fn region(start: &'static u8, end: &'static u8) -> Range<u32> {
    (&raw const *start) as u32..(&raw const *end) as u32
}

/// The stack: it begins at the end and grows towards the start.
pub fn stack() -> Range<u32> {
    // SAFETY: only the addresses are used.
    unsafe { region(&_stack_end, &_stack_start) }
}

/// All of RAM.
pub fn ram() -> Range<u32> {
    // SAFETY: only the addresses are used.
    unsafe { region(&_stack_end, &_ram_end) }
}

/// The application: its vector table is at the start.
pub fn application() -> Range<u32> {
    // SAFETY: only the addresses are used.
    unsafe { region(&_application_start, &_application_end) }
}

/// The two pages of the parameter store.
pub fn parameters() -> Range<u32> {
    // SAFETY: only the addresses are used.
    unsafe { region(&_parameters_start, &_parameters_end) }
}

/// Identifies the program: the CRC-32 of its code and constants.
pub fn program_id() -> u32 {
    let start = application().start;
    let end = (&raw const _program_end) as u32;
    let len = end.saturating_sub(start) as usize;
    // SAFETY: the linker puts the program there: flash, readable for ever, and nobody programs it while it runs.
    let program = unsafe { core::slice::from_raw_parts(start as *const u8, len) };
    CRC.checksum(program)
}

/// Size of each of the two pages: a sector (memory.x).
pub const PARAMETER_PAGE: u32 = 16 * 1024;
