//! A function in RAM programs a word and reads another one. The read waits until the flash is ready; the code in RAM
//! does not wait.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use mechanics_images::{expect, finish};

/// Two words far from all other content of the flash.
const WORDS: usize = 0x0804_0000;
const CYCCNT: *const u32 = 0xE000_1004 as *const u32;
/// Cycles of programming (16 us in the bench) at the 16 MHz after a reset.
const BUSY: u32 = 256;

/// Cycles of the store, and of a load from flash after it.
#[unsafe(link_section = ".data.program_and_read")]
#[inline(never)]
fn program_and_read(words: *mut u32) -> (u32, u32) {
    // SAFETY: the words are in flash, and the architecture defines the address of the counter.
    unsafe {
        let start = CYCCNT.read_volatile();
        words.write_volatile(0);
        cortex_m::asm::isb();
        let stored = CYCCNT.read_volatile();
        words.add(1).read_volatile();
        (stored.wrapping_sub(start), CYCCNT.read_volatile().wrapping_sub(stored))
    }
}

#[entry]
fn main() -> ! {
    if let Some(mut core) = cortex_m::Peripherals::take() {
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
    }
    let (store, load) = program_and_read(WORDS as *mut u32);
    finish(expect(store < BUSY / 2, store << 8 | 1).and_then(|()| expect(load > BUSY / 2, load << 8 | 2)))
}
