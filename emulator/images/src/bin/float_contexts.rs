//! Four contexts compute with all floating-point registers; no context may see the values of another.
#![no_std]
#![no_main]

use core::arch::asm;

use cortex_m::peripheral::NVIC;
use cortex_m_rt::entry;
use mechanics_images::{expect, finish};
use stm32f4::stm32f446::{Interrupt, interrupt};

/// Fills S0..S15 with a value, pends an interrupt through STIR, and returns whether the registers still hold the value.
fn holds(value: u32, pend: u32) -> bool {
    let changed: u32;
    unsafe {
        asm!(
            "vmov s0, {v}", "vmov s1, {v}", "vmov s2, {v}", "vmov s3, {v}",
            "vmov s4, {v}", "vmov s5, {v}", "vmov s6, {v}", "vmov s7, {v}",
            "vmov s8, {v}", "vmov s9, {v}", "vmov s10, {v}", "vmov s11, {v}",
            "vmov s12, {v}", "vmov s13, {v}", "vmov s14, {v}", "vmov s15, {v}",
            "str {p}, [{stir}]", "dsb", "isb", "nop",
            "vmov {p}, s0", "eor {c}, {p}, {v}",
            "vmov {p}, s5", "eor {p}, {v}", "orr {c}, {p}",
            "vmov {p}, s10", "eor {p}, {v}", "orr {c}, {p}",
            "vmov {p}, s15", "eor {p}, {v}", "orr {c}, {p}",
            v = in(reg) value,
            p = inout(reg) pend => _,
            c = out(reg) changed,
            stir = in(reg) 0xE000_EF00_u32,
            out("s0") _, out("s1") _, out("s2") _, out("s3") _, out("s4") _, out("s5") _, out("s6") _,
            out("s7") _, out("s8") _, out("s9") _, out("s10") _, out("s11") _, out("s12") _, out("s13") _,
            out("s14") _, out("s15") _,
        );
    }
    changed == 0
}

static mut CLEAN: [bool; 3] = [false; 3];

#[entry]
fn main() -> ! {
    let mut core = cortex_m::Peripherals::take().unwrap();
    for (interrupt, priority) in [(Interrupt::TIM2, 0xC0), (Interrupt::TIM3, 0x80), (Interrupt::TIM4, 0x40)] {
        unsafe {
            core.NVIC.set_priority(interrupt, priority);
            NVIC::unmask(interrupt);
        }
    }
    let thread = holds(0x3F80_0000, Interrupt::TIM2 as u32);
    let clean = unsafe { CLEAN };
    let mixed =
        [thread, clean[0], clean[1], clean[2]].iter().fold(0, |bits, clean| bits * 2 + u32::from(!*clean));
    finish(expect(mixed == 0, mixed))
}

#[interrupt]
fn TIM2() {
    unsafe { CLEAN[0] = holds(0x4000_0000, Interrupt::TIM3 as u32) };
}

#[interrupt]
fn TIM3() {
    unsafe { CLEAN[1] = holds(0x4040_0000, Interrupt::TIM4 as u32) };
}

#[interrupt]
fn TIM4() {
    // The highest level pends no further exception: the line is not enabled.
    unsafe { CLEAN[2] = holds(0x4080_0000, Interrupt::TIM5 as u32) };
}
