//! Three interrupts, each pended by the one below: a higher one starts at once; an equal or lower one waits.
#![no_std]
#![no_main]

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::NVIC;
use cortex_m_rt::entry;
use mechanics_images::{expect, finish};
use stm32f4::stm32f446::{Interrupt, interrupt};

static LOG: AtomicU32 = AtomicU32::new(0);

/// Adds a digit to the log.
fn log(digit: u32) {
    LOG.store(LOG.load(Ordering::Relaxed) * 16 + digit, Ordering::Relaxed);
}

#[entry]
fn main() -> ! {
    let mut core = cortex_m::Peripherals::take().unwrap();
    for (interrupt, priority) in
        [(Interrupt::TIM2, 0xC0), (Interrupt::TIM3, 0x80), (Interrupt::TIM4, 0x40), (Interrupt::TIM5, 0x40)]
    {
        unsafe {
            core.NVIC.set_priority(interrupt, priority);
            NVIC::unmask(interrupt);
        }
    }
    NVIC::pend(Interrupt::TIM2);
    cortex_m::asm::isb();
    let seen = LOG.load(Ordering::Relaxed);
    finish(expect(seen == 0x12_34_5B_6A, seen))
}

#[interrupt]
fn TIM2() {
    log(1);
    NVIC::pend(Interrupt::TIM3);
    cortex_m::asm::isb();
    log(0xA);
}

#[interrupt]
fn TIM3() {
    log(2);
    NVIC::pend(Interrupt::TIM4);
    cortex_m::asm::isb();
    log(6);
}

#[interrupt]
fn TIM4() {
    log(3);
    // TIM5 has the same priority: this handler must end first.
    NVIC::pend(Interrupt::TIM5);
    cortex_m::asm::isb();
    log(4);
}

#[interrupt]
fn TIM5() {
    log(5);
    log(0xB);
}
