//! WFE, SEV and YIELD are hints: the program continues with the next instruction.
#![no_std]
#![no_main]

use core::arch::asm;

use cortex_m_rt::entry;
use mechanics_images::{expect, finish};

#[entry]
fn main() -> ! {
    let mut count = 0_u32;
    unsafe {
        asm!(
            "sev",
            "adds {n}, #1",
            "wfe",
            "adds {n}, #2",
            "yield",
            "adds {n}, #4",
            "sev",
            "sev",
            "adds {n}, #8",
            n = inout(reg) count,
        );
    }
    finish(expect(count == 15, count))
}
