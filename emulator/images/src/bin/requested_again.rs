//! An interrupt that is requested again while its handler runs: the second request waits for the end of the first run.
#![no_std]
#![no_main]

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::NVIC;
use cortex_m_rt::entry;
use mechanics_images::{expect, finish};
use stm32f4::stm32f446::{Interrupt, interrupt};

/// Cycles of a run of the handler, at least.
const RUN: u32 = 1000;

static RUNS: AtomicU32 = AtomicU32::new(0);

#[entry]
fn main() -> ! {
    unsafe { NVIC::unmask(Interrupt::TIM2) };
    NVIC::pend(Interrupt::TIM2);
    cortex_m::asm::isb();
    let runs = RUNS.load(Ordering::Relaxed);
    finish(expect(runs == 2, runs))
}

#[interrupt]
fn TIM2() {
    if RUNS.fetch_add(1, Ordering::Relaxed) == 0 {
        NVIC::pend(Interrupt::TIM2);
    }
    cortex_m::asm::delay(RUN);
}
