//! The regions of memory.x, as the linker knows them.

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

/// The stack: it begins at the end and grows towards the start.
pub fn stack() -> Range<u32> {
    // SAFETY: only the addresses are used.
    unsafe { region(&_stack_end, &_stack_start) }
}

/// The last words of RAM: what the start before has left there, and before it what nobody has written since the power came. Each bit of a
/// static RAM comes up as it will, some of them differently each time.
pub fn noise<const WORDS: usize>() -> [u32; WORDS] {
    let mut words = [0; WORDS];
    let first = ram().end.saturating_sub(size_of_val(&words) as u32);
    for (word, address) in words.iter_mut().zip((first..ram().end).step_by(4)) {
        // SAFETY: RAM that is there (memory.x), of which any content is a word, and nobody else runs while the bootloader decides.
        *word = unsafe { (address as *const u32).read_volatile() };
    }
    words
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

/// The two pages of the parameter store, for the bootloader: nobody programs the pages while the bootloader runs.
pub fn parameter_pages() -> &'static [u8; 2 * PARAMETER_PAGE as usize] {
    // SAFETY: the region is as long (memory.x): flash, readable whatever it holds, and in the bootloader nobody programs it.
    unsafe { &*(parameters().start as *const _) }
}

/// The flash that an update may program: the security counter and the revoked keys, the application with its header, staging, and the
/// kept image.
pub(super) fn updatable() -> Range<u32> {
    // SAFETY: only the addresses are used.
    unsafe { region(&_updatable_start, &_updatable_end) }
}

/// The part of [`updatable`] that an update may erase: the application with its header, staging, and the kept image.
pub(super) fn erasable() -> Range<u32> {
    // SAFETY: only the addresses are used.
    unsafe { region(&_erasable_start, &_updatable_end) }
}

/// Identifies the program: the CRC-32 of its code and constants, as its header says. A program that a debugger has put
/// there has no header, and counts for itself.
pub fn program_id() -> u32 {
    Header::parse(header()).map_or_else(|_| own_crc(), |header| header.code_crc())
}

/// The place of the application's header.
pub(super) fn header() -> &'static [u8; HEADER_LEN] {
    // SAFETY: it lies in front of the application (memory.x): flash, readable whatever it holds. Whoever programs it does
    // not hold on to this reference meanwhile: it is used to start the application, and by the application.
    unsafe { &*(erasable().start as *const [u8; HEADER_LEN]) }
}

/// The CRC at the end of the application's header, right or not.
pub(super) fn header_crc() -> u32 {
    header().last_chunk().map_or(0, |crc| u32::from_le_bytes(*crc))
}

fn own_crc() -> u32 {
    let start = application().start;
    let end = (&raw const _program_end) as u32;
    let len = end.saturating_sub(start) as usize;
    // SAFETY: the linker puts the program there: flash, readable for ever, and nobody programs it while it runs.
    let program = unsafe { core::slice::from_raw_parts(start as *const u8, len) };
    checksum::of(program)
}

/// Size of each of the two pages: a sector (memory.x).
pub const PARAMETER_PAGE: u32 = 16 * 1024;
