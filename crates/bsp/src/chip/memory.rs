//! The regions of memory.x, from symbols of the linker.
#![expect(unsafe_code, reason = "symbols of the linker, and memory by its address")]

use core::ops::Range;

use update::{HEADER_LEN, Header};

unsafe extern "C" {
    static _stack_start: u8;
    static _stack_end: u8;
    static _ram_end: u8;
    static _parameters_start: u8;
    static _parameters_end: u8;
    static _application_start: u8;
    static _application_end: u8;
    static _updatable_start: u8;
    static _updatable_end: u8;
    static _erasable_start: u8;
    static _program_end: u8;
}

fn region(start: &'static u8, end: &'static u8) -> Range<u32> {
    (&raw const *start) as u32..(&raw const *end) as u32
}

/// The stack, which grows from the end towards the start.
pub fn stack() -> Range<u32> {
    // SAFETY: only the addresses are used.
    unsafe { region(&_stack_end, &_stack_start) }
}

/// The last words of RAM, as a source of random numbers: the values left by the last start and, after power-on, the
/// power-up state of the RAM. Each bit of a static RAM powers up with a value of its own, some bits with a different
/// value each time.
pub fn noise<const WORDS: usize>() -> [u32; WORDS] {
    let mut words = [0; WORDS];
    let first = ram().end.saturating_sub(size_of_val(&words) as u32);
    for (word, address) in words.iter_mut().zip((first..ram().end).step_by(4)) {
        // SAFETY: RAM that exists (memory.x), any content of which is a valid word; nothing else runs while the
        // bootloader decides.
        *word = unsafe { (address as *const u32).read_volatile() };
    }
    words
}

/// All of RAM.
pub fn ram() -> Range<u32> {
    // SAFETY: only the addresses are used.
    unsafe { region(&_stack_end, &_ram_end) }
}

/// The application, with its vector table at the start.
pub fn application() -> Range<u32> {
    // SAFETY: only the addresses are used.
    unsafe { region(&_application_start, &_application_end) }
}

/// The two pages of the parameter store.
pub fn parameters() -> Range<u32> {
    // SAFETY: only the addresses are used.
    unsafe { region(&_parameters_start, &_parameters_end) }
}

/// The two pages of the parameter store, for the bootloader: they are not programmed while the bootloader runs.
pub fn parameter_pages() -> &'static [u8; 2 * PARAMETER_PAGE as usize] {
    // SAFETY: the region has this length (memory.x). It is flash, readable whatever its content, and not programmed in
    // the bootloader.
    unsafe { &*(parameters().start as *const _) }
}

/// The flash that an update may program: the security counter and the revoked keys, the application with its header,
/// staging, and the kept image.
pub(crate) fn updatable() -> Range<u32> {
    // SAFETY: only the addresses are used.
    unsafe { region(&_updatable_start, &_updatable_end) }
}

/// The part of [`updatable`] that an update may erase: the application with its header, staging, and the kept image.
pub(crate) fn erasable() -> Range<u32> {
    // SAFETY: only the addresses are used.
    unsafe { region(&_erasable_start, &_updatable_end) }
}

/// Identifies the program: the CRC-32 of its code and constants, taken from its header. A program written by a debugger
/// has no header, so its CRC is computed.
pub fn program_id() -> u32 {
    Header::parse(header()).map_or_else(|_| own_crc(), |header| header.code_crc())
}

/// The place of the application's header.
pub(crate) fn header() -> &'static [u8; HEADER_LEN] {
    // SAFETY: the header lies in front of the application (memory.x). It is flash, readable whatever its content. Code
    // that programs the header does not hold this reference: it is used to start the application, and by the
    // application.
    unsafe { &*(erasable().start as *const [u8; HEADER_LEN]) }
}

/// The CRC at the end of the application's header, whether right or wrong.
pub(crate) fn header_crc() -> u32 {
    header().last_chunk().map_or(0, |crc| u32::from_le_bytes(*crc))
}

fn own_crc() -> u32 {
    let start = application().start;
    let end = (&raw const _program_end) as u32;
    let len = end.saturating_sub(start) as usize;
    // SAFETY: the linker has placed the program there: flash, always readable, and not programmed while the program
    // runs.
    let program = unsafe { core::slice::from_raw_parts(start as *const u8, len) };
    storage::checksum::of(program)
}

/// Size of each of the two pages: one sector (memory.x).
pub const PARAMETER_PAGE: u32 = 16 * 1024;
