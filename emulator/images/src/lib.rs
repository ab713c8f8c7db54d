//! What the programs share: how they tell their verdict.
#![no_std]

use core::sync::atomic::{AtomicU32, Ordering};

// Its vector table, for programs that handle no interrupt of their own too.
use stm32f4 as _;

/// The verdict lies here for whoever runs the program: it looks the symbol up.
#[unsafe(no_mangle)]
pub static VERDICT: [AtomicU32; 8] = [const { AtomicU32::new(0) }; 8];

/// The first word of the verdict when the program is through and all was well.
pub const PASSED: u32 = 0x600D_600D;
/// The first word of the verdict when the program found a fault; the second says which.
pub const FAILED: u32 = 0xBAD0_BAD0;

/// Tells the verdict and stops.
pub fn finish(check: Result<(), u32>) -> ! {
    if let Err(code) = check {
        VERDICT[1].store(code, Ordering::Relaxed);
    }
    VERDICT[0].store(if check.is_ok() { PASSED } else { FAILED }, Ordering::Release);
    loop {
        cortex_m::asm::nop();
    }
}

/// Tells a number in words 2 to 7 of the verdict.
pub fn note(word: usize, value: u32) {
    VERDICT[2 + word % 6].store(value, Ordering::Relaxed);
}

/// An error with a number when something does not hold.
pub fn expect(holds: bool, code: u32) -> Result<(), u32> {
    if holds { Ok(()) } else { Err(code) }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    finish(Err(0xFFFF))
}
