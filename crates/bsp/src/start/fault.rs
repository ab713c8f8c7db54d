//! Handlers of events that must never happen: faults, a failure of the clock, and interrupts without a handler.
//!
//! The stack lies at the very start of RAM, so a stack that overflows leaves RAM, which is a fault. The handler of that
//! fault has no stack left, so it switches to a small emergency stack first.
#![expect(unsafe_code, reason = "the handlers of faults")]

use core::arch::naked_asm;
use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use cortex_m::peripheral::SCB;

use crate::can::controller;
use crate::chip::crash;
use crate::chip::crash_record::{Crash, Fault};
use crate::chip::memory;

const EMERGENCY_BYTES: usize = 1024;

#[repr(align(8))]
struct EmergencyStack(
    #[expect(dead_code, reason = "used by its address")] UnsafeCell<MaybeUninit<[u8; EMERGENCY_BYTES]>>,
);

// SAFETY: only the fault handler uses the stack; nothing interrupts the handler, and it does not return.
unsafe impl Sync for EmergencyStack {}

#[unsafe(link_section = ".uninit.emergency_stack")]
static EMERGENCY: EmergencyStack = EmergencyStack(UnsafeCell::new(MaybeUninit::uninit()));

/// The handler of every fault: no configurable fault is enabled, so all escalate to HardFault (PM0214, 2.4.2).
///
/// Replaces the trampoline of cortex-m-rt, which pushes to the stack that may just have overflowed.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn HardFault() -> ! {
    naked_asm!(
        "mov r0, sp",
        "movw r1, #:lower16:({stack} + {size})",
        "movt r1, #:upper16:({stack} + {size})",
        "mov sp, r1",
        "b {record}",
        stack = sym EMERGENCY,
        size = const EMERGENCY_BYTES,
        record = sym record,
    )
}

/// `sp` is the address at which the core pushed the registers of the program, if it could.
extern "C" fn record(sp: u32) -> ! {
    // SAFETY: reads of system control registers, by the only code that is still running.
    let scb = unsafe { &*SCB::PTR };
    let cfsr = scb.cfsr.read();
    let [lr, pc] = stacked(sp).unwrap_or_default();
    let address = if cfsr & BFAR_VALID != 0 { scb.bfar.read() } else { scb.mmfar.read() };
    crash::restart(&Crash::Fault(Fault { pc, lr, sp, cfsr, hfsr: scb.hfsr.read(), address }))
}

/// CFSR: BFAR holds the address of a bus fault.
const BFAR_VALID: u32 = 1 << 15;

/// LR and PC of the eight words that the core pushes (PM0214, 2.3.7), if the words lie in the stack.
fn stacked(sp: u32) -> Option<[u32; 2]> {
    let stack = memory::stack();
    let readable = sp.is_multiple_of(4) && sp >= stack.start && sp.checked_add(32)? <= stack.end;
    // SAFETY: the words lie in the stack, whose owner has ended.
    readable.then(|| unsafe { ((sp + 20) as *const [u32; 2]).read_volatile() })
}

/// The clock on OSC_IN has failed: the core runs from HSI, and the bit timing is wrong. The node restarts and waits for
/// the clock.
///
/// The controller leaves the bus before the crash record is written. At the slow clock the checksum of the record takes
/// longer than a frame, and in that time an error frame with wrong bit timing would destroy the frames of others.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() -> ! {
    controller::hold_in_reset();
    crash::restart(&Crash::Clock)
}

/// An interrupt without a handler: the program has enabled an interrupt that it does not serve.
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    crash::restart(&Crash::Interrupt(number))
}
