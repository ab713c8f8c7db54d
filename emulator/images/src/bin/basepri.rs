//! BASEPRI holds back interrupts of its level and below, and lets higher ones through.
#![no_std]
#![no_main]

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::NVIC;
use cortex_m::register::basepri;
use cortex_m_rt::entry;
use mechanics_images::{expect, finish};
use stm32f4::stm32f446::{Interrupt, interrupt};

static LOW: AtomicU32 = AtomicU32::new(0);
static HIGH: AtomicU32 = AtomicU32::new(0);

fn check() -> Result<(), u32> {
    unsafe { basepri::write(0x80) };
    NVIC::pend(Interrupt::TIM2);
    NVIC::pend(Interrupt::TIM3);
    cortex_m::asm::isb();
    expect(HIGH.load(Ordering::Relaxed) == 1, 1)?;
    expect(LOW.load(Ordering::Relaxed) == 0, 2)?;
    expect(NVIC::is_pending(Interrupt::TIM2), 3)?;
    unsafe { basepri::write(0) };
    cortex_m::asm::isb();
    expect(LOW.load(Ordering::Relaxed) == 1, 4)
}

#[entry]
fn main() -> ! {
    let mut core = cortex_m::Peripherals::take().unwrap();
    unsafe {
        core.NVIC.set_priority(Interrupt::TIM2, 0x80);
        core.NVIC.set_priority(Interrupt::TIM3, 0x70);
        NVIC::unmask(Interrupt::TIM2);
        NVIC::unmask(Interrupt::TIM3);
    }
    finish(check())
}

#[interrupt]
fn TIM2() {
    LOW.fetch_add(1, Ordering::Relaxed);
}

#[interrupt]
fn TIM3() {
    HIGH.fetch_add(1, Ordering::Relaxed);
}
