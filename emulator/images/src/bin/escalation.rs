//! A fault becomes a HardFault while its own exception is disabled, and its own exception while that is enabled; the
//! status registers show the cause.
#![no_std]
#![no_main]

use core::arch::{asm, naked_asm};
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, entry, exception};
use mechanics_images::{expect, finish};

/// An address without memory or register.
const NOWHERE: *const u32 = 0x6000_0000 as *const u32;
const FORCED: u32 = 1 << 30;
const PRECISERR: u32 = 1 << 9;
static BUS_FAULTS: AtomicU32 = AtomicU32::new(0);

#[entry]
fn main() -> ! {
    let mut core = cortex_m::Peripherals::take().unwrap();
    core.SCB.enable(cortex_m::peripheral::scb::Exception::BusFault);
    load(NOWHERE);
    core.SCB.disable(cortex_m::peripheral::scb::Exception::BusFault);
    load(NOWHERE);
    finish(Err(0x99))
}

/// Counts, clears the status, and returns behind the load, which is two bytes long. The return address is the seventh
/// word of the frame.
#[unsafe(naked)]
#[unsafe(no_mangle)]
extern "C" fn BusFault() {
    naked_asm!(
        "ldr r0, [sp, #24]", "adds r0, #2", "str r0, [sp, #24]",
        "ldr r0, ={faults}", "ldr r1, [r0]", "adds r1, #1", "str r1, [r0]",
        "ldr r0, =0xE000ED28", "movs r1, #0", "mvns r1, r1", "str r1, [r0]",
        "bx lr",
        faults = sym BUS_FAULTS,
    )
}

/// Loads a word with an instruction of two bytes.
#[inline(never)]
fn load(address: *const u32) -> u32 {
    let word;
    unsafe { asm!("ldr r0, [r0]", inout("r0") address => word) };
    word
}

#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    let scb = unsafe { &*SCB::PTR };
    let check = expect(BUS_FAULTS.load(Ordering::Relaxed) == 1, 1)
        .and_then(|()| expect(scb.hfsr.read() & FORCED != 0, 2))
        .and_then(|()| expect(scb.cfsr.read() & PRECISERR != 0, 3))
        .and_then(|()| expect(scb.bfar.read() == NOWHERE as u32, 4));
    finish(check)
}
