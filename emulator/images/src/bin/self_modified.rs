//! Runs a function, changes its code in flash, and runs it again: the new code must run.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use mechanics_images::{expect, finish};

/// Address of two instructions that return a number, far from all other content of the flash.
const FUNCTION: usize = 0x0804_0000;

/// `movs r0, #n; bx lr`
fn code(n: u8) -> u32 {
    0x4770_2000 | u32::from(n)
}

fn run() -> u32 {
    let function: extern "C" fn() -> u32 = unsafe { core::mem::transmute(FUNCTION | 1) };
    function()
}

#[entry]
fn main() -> ! {
    let word = FUNCTION as *mut u32;
    unsafe { word.write_volatile(code(7)) };
    let first = run();
    // Programming only clears bits: 7 becomes 5.
    unsafe { word.write_volatile(code(5)) };
    let second = run();
    finish(expect(first == 7, 1).and_then(|()| expect(second == 5, second << 8 | 2)))
}
