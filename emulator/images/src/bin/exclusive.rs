//! An interrupt between LDREX and STREX must make the store fail, even if the interrupt did not access the address.
#![no_std]
#![no_main]

use core::arch::asm;

use cortex_m::peripheral::NVIC;
use cortex_m_rt::entry;
use mechanics_images::{expect, finish};
use stm32f4::stm32f446::{Interrupt, interrupt};

/// Loads exclusively, pends an interrupt (or none), stores exclusively: 0 when the store succeeded.
fn attempt(pend: u32) -> u32 {
    let mut word = 0_u32;
    let failed: u32;
    unsafe {
        asm!(
            "ldrex {x}, [{w}]",
            "str {p}, [{stir}]", "dsb", "isb", "nop",
            "strex {f}, {x}, [{w}]",
            x = out(reg) _, w = in(reg) &raw mut word, p = in(reg) pend, f = out(reg) failed,
            stir = in(reg) 0xE000_EF00_u32,
        );
    }
    failed
}

#[entry]
fn main() -> ! {
    unsafe { NVIC::unmask(Interrupt::TIM2) };
    let undisturbed = attempt(Interrupt::TIM5 as u32);
    let disturbed = attempt(Interrupt::TIM2 as u32);
    finish(expect(undisturbed == 0, 1).and_then(|()| expect(disturbed == 1, 2)))
}

#[interrupt]
fn TIM2() {}
