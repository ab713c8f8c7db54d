//! Two simultaneous interrupts of one priority: the second follows the first without unstacking, and faster.
#![no_std]
#![no_main]

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::{DWT, NVIC};
use cortex_m_rt::entry;
use mechanics_images::{expect, finish, note};
use stm32f4::stm32f446::{Interrupt, interrupt};

static END: AtomicU32 = AtomicU32::new(0);
static START: AtomicU32 = AtomicU32::new(0);

#[entry]
fn main() -> ! {
    let mut core = cortex_m::Peripherals::take().unwrap();
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    cortex_m::interrupt::disable();
    unsafe {
        NVIC::unmask(Interrupt::TIM2);
        NVIC::unmask(Interrupt::TIM3);
    }
    NVIC::pend(Interrupt::TIM2);
    NVIC::pend(Interrupt::TIM3);
    unsafe { cortex_m::interrupt::enable() };
    cortex_m::asm::isb();
    let gap = START.load(Ordering::Relaxed).wrapping_sub(END.load(Ordering::Relaxed));
    note(0, gap);
    finish(expect(gap < 30, gap))
}

#[interrupt]
fn TIM2() {
    END.store(DWT::cycle_count(), Ordering::Relaxed);
}

#[interrupt]
fn TIM3() {
    START.store(DWT::cycle_count(), Ordering::Relaxed);
}
