//! Programming clears bits and sets none, also with several stores in one block of code.
#![no_std]
#![no_main]

use core::arch::asm;

use cortex_m_rt::entry;
use mechanics_images::{expect, finish};

/// Erased flash behind the program.
const PLACE: u32 = 0x0802_0000;

/// Stores two bytes at one address, one right after the other; returns what the flash then has.
fn twice(place: u32, first: u32, second: u32) -> u32 {
    unsafe {
        asm!("strb {0}, [{2}]", "strb {1}, [{2}]", "dsb", in(reg) first, in(reg) second, in(reg) place);
        (place as *const u8).read_volatile().into()
    }
}

#[entry]
fn main() -> ! {
    let mut result = Ok(());
    let bytes = [(0x00, 0xFF), (0x0F, 0xF0), (0xFF, 0x5A), (0xA5, 0x3C)];
    for ((number, place), (first, second)) in (1..).zip(PLACE..).zip(bytes) {
        let found = twice(place, first, second);
        result = result.and(expect(found == first & second, number << 8 | found));
    }
    finish(result)
}
