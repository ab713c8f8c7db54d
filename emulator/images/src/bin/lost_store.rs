//! A store to an unused address is buffered: its fault comes later, without an address, and the program has already
//! continued. With the write buffer off, the fault belongs to the store instruction.
#![no_std]
#![no_main]

use core::arch::{asm, global_asm};
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use cortex_m_rt::entry;
use mechanics_images::{expect, finish};

/// Addresses without memory or register: outside the chip, and between its peripherals.
const NOWHERE: [*mut u32; 2] = [0x6000_0000 as *mut u32, 0x4000_7C00 as *mut u32];
const ACTLR: *mut u32 = 0xE000_E008 as *mut u32;
const SHCSR: *mut u32 = 0xE000_ED24 as *mut u32;
const DISDEFWBUF: u32 = 1 << 1;
/// Bits of CFSR.
const PRECISERR_AND_BFARVALID: u32 = 1 << 9 | 1 << 15;
const IMPRECISERR: u32 = 1 << 10;

static STATUS: AtomicU32 = AtomicU32::new(0);
static FAULTS: AtomicU32 = AtomicU32::new(0);

// Notes and clears the status. After a precise fault, the handler returns behind the instruction, which has 16 bits.
global_asm!(
    ".global BusFault",
    ".thumb_func",
    "BusFault:",
    "ldr r0, =0xE000ED28",
    "ldr r1, [r0]",
    "str r1, [r0]",
    "ldr r2, ={status}",
    "str r1, [r2]",
    "ldr r2, ={faults}",
    "ldr r3, [r2]",
    "adds r3, #1",
    "str r3, [r2]",
    "lsls r1, r1, #22",
    "bpl 1f",
    "mrs r0, msp",
    "ldr r1, [r0, #24]",
    "adds r1, #2",
    "str r1, [r0, #24]",
    "1: bx lr",
    ".ltorg",
    status = sym STATUS,
    faults = sym FAULTS,
);

/// Stores a word at `place`; whether the instructions behind the store ran exactly once.
fn store(place: *mut u32) -> bool {
    let count: u32;
    unsafe {
        asm!("movs r1, #0", "str r1, [r0]", "adds r1, #1", "dsb", "isb", in("r0") place, out("r1") count)
    };
    count == 1
}

#[entry]
fn main() -> ! {
    unsafe { SHCSR.write_volatile(1 << 17) };
    let mut result = Ok(());
    for (code, place) in (1..).zip(NOWHERE) {
        let goes_on = store(place);
        let status = STATUS.swap(0, Relaxed);
        result = result.and(expect(goes_on && status == IMPRECISERR, code));
    }
    result = result.and(expect(FAULTS.load(Relaxed) == 2, 3));
    unsafe { ACTLR.write_volatile(DISDEFWBUF) };
    let goes_on = store(NOWHERE[0]);
    result = result.and(expect(goes_on && STATUS.load(Relaxed) == PRECISERR_AND_BFARVALID, 4));
    finish(result)
}
