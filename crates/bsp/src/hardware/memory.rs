//! The regions of memory.x, as the linker knows them.

use core::ops::Range;

unsafe extern "C" {
    static _stack_start: u8;
    static _stack_end: u8;
    static _ram_end: u8;
    static _parameters_start: u8;
    static _parameters_end: u8;
    static _application_start: u8;
    static _application_end: u8;
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

/// What the two pages of the parameter store hold.
pub fn parameters() -> &'static [u8] {
    // SAFETY: only the addresses are used.
    let range = unsafe { region(&_parameters_start, &_parameters_end) };
    // SAFETY: the region is flash, readable for ever, and this image does not program it.
    unsafe { core::slice::from_raw_parts(range.start as *const u8, range.len()) }
}

/// Size of each of the two pages: a sector (memory.x).
pub const PARAMETER_PAGE: u32 = 16 * 1024;
