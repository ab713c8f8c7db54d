//! The memory protection unit restricts the parts of RAM that may run code. A call of a function in another part is a
//! MemManage fault; its handler notes the status and returns to the caller.
#![no_std]
#![no_main]

use core::arch::global_asm;
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use cortex_m_rt::entry;
use mechanics_images::{expect, finish};

const MPU_CTRL: *mut u32 = 0xE000_ED94 as *mut u32;
const MPU_RBAR: *mut u32 = 0xE000_ED9C as *mut u32;
const MPU_RASR: *mut u32 = 0xE000_EDA0 as *mut u32;
const SHCSR: *mut u32 = 0xE000_ED24 as *mut u32;

/// RBAR: the lowest bits hold the region. RASR: no code; full data access; normal memory; region enabled.
const VALID: u32 = 1 << 4;
const XN: u32 = 1 << 28;
const NORMAL: u32 = 3 << 24 | 1 << 17 | 1;
/// Bits of CFSR.
const IACCVIOL: u32 = 1;

#[unsafe(no_mangle)]
static SEEN: AtomicU32 = AtomicU32::new(0);

// The fault is at the first instruction of the function; the link register in the frame is the return address.
global_asm!(
    ".global MemoryManagement",
    ".thumb_func",
    "MemoryManagement:",
    "ldr r1, =0xE000ED28",
    "ldr r2, [r1]",
    "str r2, [r1]",
    "ldr r3, =SEEN",
    "str r2, [r3]",
    "ldr r1, [sp, #20]",
    "bic r1, #1",
    "str r1, [sp, #24]",
    "bx lr",
    ".ltorg",
    // A function in flash.
    ".global ANSWER",
    ".thumb_func",
    "ANSWER:",
    "movs r0, #42",
    "bx lr",
);

/// The function in RAM: `movs r0, #42`, `bx lr`.
static IN_RAM: AtomicU32 = AtomicU32::new(0x4770_202A);

unsafe extern "C" {
    fn ANSWER() -> u32;
}

fn in_ram() -> u32 {
    let code = (IN_RAM.as_ptr() as usize | 1) as *const ();
    // SAFETY: the word is the code of a function of this type.
    let code: extern "C" fn() -> u32 = unsafe { core::mem::transmute(code) };
    code()
}

fn region(number: u32, base: u32, attributes: u32) {
    unsafe {
        MPU_RBAR.write_volatile(base | VALID | number);
        MPU_RASR.write_volatile(attributes);
    }
}

fn switch(control: u32) {
    unsafe { MPU_CTRL.write_volatile(control) };
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}

/// The status of the last refused call.
fn seen() -> u32 {
    SEEN.swap(0, Relaxed)
}

#[entry]
fn main() -> ! {
    unsafe { SHCSR.write_volatile(1 << 16) };
    let before = in_ram();
    // No code in the 128 KiB of RAM.
    region(0, 0x2000_0000, XN | NORMAL | 16 << 1);
    let while_off = in_ram();
    switch(0b101);
    let _ = in_ram();
    let refused = seen();
    let flash_goes_on = unsafe { ANSWER() };
    IN_RAM.store(0x4770_202B, Relaxed);
    let is_data = IN_RAM.load(Relaxed) == 0x4770_202B;
    // Code in the first half is allowed again.
    region(1, 0x2000_0000, NORMAL | 15 << 1);
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    let allowed = in_ram();
    let none = seen();
    // Except in the eighth of that half with the function.
    let eighth = IN_RAM.as_ptr() as u32 >> 13 & 7;
    region(1, 0x2000_0000, NORMAL | 1 << 8 << eighth | 15 << 1);
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    let _ = in_ram();
    let refused_again = seen();
    switch(0);
    let after = in_ram();
    finish(
        expect(before == 42 && while_off == 42, 1)
            .and_then(|()| expect(refused == IACCVIOL, 2))
            .and_then(|()| expect(flash_goes_on == 42 && is_data, 3))
            .and_then(|()| expect(allowed == 43 && none == 0, 4))
            .and_then(|()| expect(refused_again == IACCVIOL, 5))
            .and_then(|()| expect(after == 43, 6)),
    )
}
