//! Instructions that silicon refuses: floating point while the unit is off, accesses to an unaligned address, and
//! trapped operations: a division by zero, and any access to an unaligned word. The handler notes the status and
//! returns behind the instruction; all these instructions have 32 bits.
#![no_std]
#![no_main]

use core::arch::{asm, global_asm};
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use cortex_m_rt::entry;
use mechanics_images::{expect, finish};

const CPACR: *mut u32 = 0xE000_ED88 as *mut u32;
const CCR: *mut u32 = 0xE000_ED14 as *mut u32;
const SHCSR: *mut u32 = 0xE000_ED24 as *mut u32;

/// Bits of CFSR.
const NOCP: u32 = 1 << 19;
const UNALIGNED: u32 = 1 << 24;
const DIVBYZERO: u32 = 1 << 25;

#[unsafe(no_mangle)]
static SEEN: AtomicU32 = AtomicU32::new(0);

global_asm!(
    ".global UsageFault",
    ".thumb_func",
    "UsageFault:",
    "mrs r0, msp",
    "ldr r1, [r0, #24]",
    "adds r1, #4",
    "str r1, [r0, #24]",
    "ldr r1, =0xE000ED28",
    "ldr r2, [r1]",
    "str r2, [r1]",
    "ldr r3, =SEEN",
    "str r2, [r3]",
    "bx lr",
    ".ltorg",
);

/// The status of the last refused instruction.
fn seen() -> u32 {
    SEEN.swap(0, Relaxed)
}

#[entry]
fn main() -> ! {
    let words = [1_u32, 2, 3, 4];
    let odd = words.as_ptr() as u32 + 2;
    unsafe {
        SHCSR.write_volatile(1 << 18);
        let allowed = CPACR.read_volatile();
        CPACR.write_volatile(0);
        asm!("dsb", "isb", "vadd.f32 s0, s0, s0", "nop");
        CPACR.write_volatile(allowed);
        asm!("dsb", "isb");
    }
    let without_floats = seen();
    unsafe { asm!("ldrd r2, r3, [{0}]", in(reg) odd, out("r2") _, out("r3") _) };
    let double = seen();
    unsafe { asm!("ldm.w {0}, {{r2, r3}}", in(reg) odd, out("r2") _, out("r3") _) };
    let multiple = seen();
    unsafe { asm!("vldr s0, [{0}]", in(reg) odd, out("s0") _) };
    let float = seen();
    unsafe { asm!("ldrex r2, [{0}]", in(reg) odd, out("r2") _) };
    let exclusive = seen();
    unsafe {
        CCR.write_volatile(CCR.read_volatile() | 1 << 4);
        asm!("dsb", "isb", "udiv {0}, {0}, {1}", inout(reg) odd => _, in(reg) 0);
    }
    let division = seen();
    let word: u32;
    unsafe { asm!("ldr.w {0}, [{1}]", out(reg) word, in(reg) odd) };
    let allowed = seen() == 0 && word == 2 << 16;
    unsafe {
        CCR.write_volatile(CCR.read_volatile() | 1 << 3);
        asm!("dsb", "isb", "ldr.w {0}, [{1}]", out(reg) _, in(reg) odd);
    }
    let any = seen();
    finish(
        expect(without_floats == NOCP, 1)
            .and_then(|()| expect(double == UNALIGNED, 2))
            .and_then(|()| expect(multiple == UNALIGNED, 3))
            .and_then(|()| expect(float == UNALIGNED, 4))
            .and_then(|()| expect(exclusive == UNALIGNED, 5))
            .and_then(|()| expect(division == DIVBYZERO, 6))
            .and_then(|()| expect(allowed, 7))
            .and_then(|()| expect(any == UNALIGNED, 8)),
    )
}
