//! An IT block that accesses pages for the first time: the instructions after the block must not count as part of it.
#![no_std]
#![no_main]

use core::arch::asm;

use cortex_m_rt::entry;
use mechanics_images::{expect, finish};

/// Pages of RAM without other use.
const FIRST: u32 = 0x2001_0000;
const PAGE: u32 = 0x400;

/// Stores when `condition` is zero; then counts from zero to two.
fn count(address: u32, condition: u32) -> u32 {
    let counted: u32;
    unsafe {
        asm!(
            "movs {counted}, #0",
            "cmp {condition}, #0",
            "ittt eq",
            "streq {counted}, [{address}]",
            "ldreq {scratch}, [{address}]",
            "moveq {scratch}, #0",
            "b 2f",
            "2: adds {counted}, #1",
            "adds {counted}, #1",
            counted = out(reg) counted,
            condition = in(reg) condition,
            address = in(reg) address,
            scratch = out(reg) _,
        );
    }
    counted
}

#[entry]
fn main() -> ! {
    let all = (0..32).all(|page| count(FIRST + page * PAGE, page % 2) == 2);
    finish(expect(all, 1))
}
