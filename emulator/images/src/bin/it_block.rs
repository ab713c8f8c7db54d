//! An exception taken inside an IT block must return to the rest of the block.
//!
//! The block contains a conditional SVC as its second instruction, and two more instructions follow, one for each
//! outcome of the condition. Without the IT state both would run.
#![no_std]
#![no_main]

use core::arch::asm;

use cortex_m_rt::{entry, exception};
use mechanics_images::{expect, finish};

#[entry]
fn main() -> ! {
    let (then, other): (u32, u32);
    unsafe {
        asm!(
            "mov {t}, #0", "mov {o}, #0",
            "cmp {t}, #0",
            "ittte eq",
            "addeq {t}, #1",
            "svceq #0",
            "addeq {t}, #2",
            "addne {o}, #1",
            t = out(reg) then, o = out(reg) other,
        );
    }
    finish(expect(then == 3, 1).and_then(|()| expect(other == 0, 2)))
}

#[exception]
fn SVCall() {
    // The handler changes the flags.
    unsafe { asm!("cmp {0}, #1", in(reg) 0_u32) };
}
