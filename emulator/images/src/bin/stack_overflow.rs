//! A stack that runs off the start of RAM: the frame cannot be saved, but HardFault must still run.
#![no_std]
#![no_main]

use core::arch::{asm, naked_asm};

use cortex_m::peripheral::SCB;
use cortex_m_rt::{entry, exception};
use mechanics_images::{expect, finish};

const STKERR: u32 = 1 << 12;

#[entry]
fn main() -> ! {
    // The stack pointer is at the start of RAM: the exception frame of the SVC would lie below RAM.
    unsafe { asm!("mov sp, {0}", "svc #0", in(reg) 0x2000_0000_u32, options(noreturn)) }
}

#[exception]
fn SVCall() {
    finish(Err(1))
}

/// The stack is not usable: the handler first sets another one. Replaces the trampoline of cortex-m-rt.
#[unsafe(naked)]
#[unsafe(no_mangle)]
extern "C" fn HardFault() -> ! {
    naked_asm!("ldr r0, =0x20010000", "mov sp, r0", "b {0}", sym report)
}

extern "C" fn report() -> ! {
    let scb = unsafe { &*SCB::PTR };
    finish(expect(scb.cfsr.read() & STKERR != 0, 2))
}
