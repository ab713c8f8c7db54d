//! The common part of the programs: the report of the verdict.
#![no_std]

use core::sync::atomic::{AtomicU32, Ordering};

// Links the vector table of the crate, for programs that handle no interrupt of their own too.
use stm32f4 as _;

/// The verdict. The runner of a program finds its address through the symbol.
#[unsafe(no_mangle)]
pub static VERDICT: [AtomicU32; 8] = [const { AtomicU32::new(0) }; 8];

/// The first word of the verdict when the program has finished and all checks passed.
pub const PASSED: u32 = 0x600D_600D;
/// The first word of the verdict when a check failed; the second word is the number of the check.
pub const FAILED: u32 = 0xBAD0_BAD0;

/// Reports the verdict and stops.
pub fn finish(check: Result<(), u32>) -> ! {
    if let Err(code) = check {
        VERDICT[1].store(code, Ordering::Relaxed);
    }
    VERDICT[0].store(if check.is_ok() { PASSED } else { FAILED }, Ordering::Release);
    loop {
        cortex_m::asm::nop();
    }
}

/// Reports a number in words 2 to 7 of the verdict.
pub fn note(word: usize, value: u32) {
    VERDICT[2 + word % 6].store(value, Ordering::Relaxed);
}

/// An error with the number `code` unless `holds`.
pub fn expect(holds: bool, code: u32) -> Result<(), u32> {
    if holds { Ok(()) } else { Err(code) }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    finish(Err(0xFFFF))
}
