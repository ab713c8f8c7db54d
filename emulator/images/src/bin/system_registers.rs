//! Details of system registers and exceptions that are easily wrong: SysTick, the cycle counter, states of exceptions,
//! SVC under PRIMASK, unprivileged Thread mode, BASEPRI and the choice of the stack.
#![no_std]
#![no_main]

use core::arch::{asm, global_asm};
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use cortex_m_rt::{entry, exception};
use mechanics_images::{expect, finish, note};

const SYST_CSR: *mut u32 = 0xE000_E010 as *mut u32;
const SYST_RVR: *mut u32 = 0xE000_E014 as *mut u32;
const SYST_CVR: *mut u32 = 0xE000_E018 as *mut u32;
const ICSR: *mut u32 = 0xE000_ED04 as *mut u32;
const SHCSR: *mut u32 = 0xE000_ED24 as *mut u32;
const DEMCR: *mut u32 = 0xE000_EDFC as *mut u32;
const DWT_CTRL: *mut u32 = 0xE000_1000 as *mut u32;
const DWT_CYCCNT: *mut u32 = 0xE000_1004 as *mut u32;

/// Values seen by the handlers: SHCSR, ICSR and CONTROL in SVCall, HFSR and CFSR in HardFault.
static STATES: AtomicU32 = AtomicU32::new(0);
static CONTROL_STATE: AtomicU32 = AtomicU32::new(0);
static SELECTED: AtomicU32 = AtomicU32::new(0);
static HARD: AtomicU32 = AtomicU32::new(0);
static STATUS: AtomicU32 = AtomicU32::new(0);

fn read(register: *mut u32) -> u32 {
    unsafe { register.read_volatile() }
}

fn write(register: *mut u32, value: u32) {
    unsafe { register.write_volatile(value) }
}

/// SysTick is zero after a write, counts from the reload value, and keeps its count while stopped.
fn systick() -> Result<(), u32> {
    write(SYST_RVR, 99_999);
    write(SYST_CVR, 1);
    expect(read(SYST_CVR) == 0, 1)?;
    write(SYST_CSR, 0b101);
    unsafe { asm!("isb", "nop", "nop") };
    let running = read(SYST_CVR);
    expect(running > 99_000 && running <= 99_999, 2)?;
    write(SYST_CSR, 0);
    let held = read(SYST_CVR);
    unsafe { asm!("isb", "nop", "nop") };
    expect(held > 99_000 && read(SYST_CVR) == held, 3)
}

fn cycle_counter() -> Result<(), u32> {
    write(DEMCR, 0);
    write(DWT_CTRL, 1);
    unsafe { asm!("isb") };
    expect(read(DWT_CYCCNT) == 0 && read(DWT_CTRL) & 1 == 0, 11)?;
    write(DEMCR, 1 << 24);
    write(DWT_CTRL, 1);
    unsafe { asm!("isb") };
    expect(read(DWT_CYCCNT) > 0, 12)
}

fn states() -> Result<(), u32> {
    unsafe { asm!("svc 0") };
    expect(STATES.load(Relaxed) & 1 << 7 != 0, 21)?;
    let control = CONTROL_STATE.load(Relaxed);
    expect(control & 0x1FF == 11 && control & 1 << 11 != 0, 22)?;
    expect(control >> 12 & 0x1FF == 14, 23)?;
    expect(read(SHCSR) & 1 << 7 == 0, 24)
}

/// A masked SVC cannot be taken: it becomes a forced HardFault.
fn masked_call() -> Result<(), u32> {
    unsafe { asm!("cpsid i", "svc 0", "nop", "cpsie i") };
    expect(HARD.swap(0, Relaxed) == 1 << 30, 31)
}

fn thread_mode() -> Result<(), u32> {
    unprivileged().and(stacks())
}

fn unprivileged() -> Result<(), u32> {
    unsafe {
        asm!("msr control, {0}", "isb", "ldr r3, [r2]", "isb", "nop", "svc 1", in(reg) 1, in("r2") SYST_CVR, out("r3") _);
    }
    // PRECISERR and BFARVALID.
    expect(STATUS.swap(0, Relaxed) == 0x8200 && HARD.swap(0, Relaxed) == 1 << 30, 41)
}

/// The chip implements the upper four of eight priority bits.
fn priority_bits() -> Result<(), u32> {
    let read: u32;
    unsafe {
        asm!("msr basepri, {0}", "isb", "mrs {0}, basepri", "msr basepri, {1}", inout(reg) 0xFF => read, in(reg) 0)
    };
    expect(read == 0xF0, 51)
}

/// A handler runs on the main stack, and CONTROL shows it; Thread mode finds its own stack again, with and without
/// privileges.
fn stacks() -> Result<(), u32> {
    stack_of_thread(0b10).and(stack_of_thread(0b11))
}

fn stack_of_thread(chosen: u32) -> Result<(), u32> {
    let mut stack = [0_u32; 64];
    let top = stack.as_mut_ptr_range().end;
    let (control, stack_pointer): (u32, u32);
    unsafe {
        asm!(
            "msr psp, {top}", "msr control, {psp}", "isb", "svc 2", "mrs {control}, control", "mov {pointer}, sp",
            "msr control, {msp}", "isb",
            top = in(reg) top, psp = in(reg) chosen, msp = in(reg) 0, control = out(reg) control, pointer = out(reg) stack_pointer,
        );
    }
    expect(SELECTED.load(Relaxed) & 2 == 0, 61)?;
    expect(control & 2 != 0 && stack_pointer == top as u32, 62)
}

/// Every check is made even if an earlier check failed: another core may differ in several.
#[entry]
fn main() -> ! {
    let checks = [systick, cycle_counter, states, masked_call, thread_mode, priority_bits];
    let mut result = Ok(());
    for (word, check) in checks.into_iter().enumerate() {
        let found = check();
        note(word, found.err().unwrap_or(0));
        result = result.and(found);
    }
    finish(result)
}

/// The handler pends PendSV, to see it pending, and returns with privileges.
#[exception]
fn SVCall() {
    write(ICSR, 1 << 28);
    STATES.store(read(SHCSR), Relaxed);
    CONTROL_STATE.store(read(ICSR), Relaxed);
    let control: u32;
    unsafe { asm!("mrs {0}, control", out(reg) control) };
    SELECTED.store(control, Relaxed);
    unsafe { asm!("msr control, {0}", "isb", in(reg) 0) };
}

#[exception]
fn PendSV() {}

// Notes the cause and returns behind the instruction of 16 bits, with interrupts enabled.
global_asm!(
    ".global HardFault",
    ".thumb_func",
    "HardFault:",
    "mrs r0, msp",
    "ldr r1, [r0, #24]",
    "adds r1, #2",
    "str r1, [r0, #24]",
    "ldr r0, =0xE000ED2C",
    "ldr r1, [r0]",
    "str r1, [r0]",
    "ldr r2, ={hard}",
    "str r1, [r2]",
    "ldr r0, =0xE000ED28",
    "ldr r1, [r0]",
    "str r1, [r0]",
    "ldr r2, ={status}",
    "str r1, [r2]",
    "cpsie i",
    "bx lr",
    ".ltorg",
    hard = sym HARD,
    status = sym STATUS,
);
