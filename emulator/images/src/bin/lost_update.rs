//! A counter that a program and an interrupt increment without protection. On silicon some counts are lost; if
//! interrupts come between blocks of code only, no count is lost.
#![no_std]
#![no_main]

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{DWT, NVIC};
use cortex_m_rt::{entry, exception};
use mechanics_images::{finish, note};
use stm32f4::stm32f446::{Interrupt, interrupt};

const TIMES: u32 = 20_000;

static SHARED: AtomicU32 = AtomicU32::new(0);
static INTERRUPTS: AtomicU32 = AtomicU32::new(0);

/// `x++`: a load, an addition and a store.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn bump() {
    SHARED.store(SHARED.load(Relaxed) + 1, Relaxed);
}

/// The number of lost counts; restarts the count.
fn lost() -> u32 {
    let expected = TIMES + INTERRUPTS.swap(0, Relaxed);
    expected - SHARED.swap(0, Relaxed)
}

fn bump_often() {
    (0..TIMES).for_each(|_| bump());
}

#[entry]
fn main() -> ! {
    let mut core = cortex_m::Peripherals::take().unwrap();
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    unsafe { NVIC::unmask(Interrupt::TIM2) };
    // The program causes no interrupt here; only the test may cause one.
    bump_often();
    note(0, lost());

    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(996);
    core.SYST.clear_current();
    core.SYST.enable_interrupt();
    core.SYST.enable_counter();
    bump_often();
    core.SYST.disable_interrupt();
    core.SYST.disable_counter();
    note(1, INTERRUPTS.load(Relaxed));
    note(2, lost());

    let start = DWT::cycle_count();
    unsafe { core::arch::asm!(".rept 100", "nop", ".endr") };
    note(3, DWT::cycle_count().wrapping_sub(start));
    finish(Ok(()))
}

fn interrupted() {
    bump();
    INTERRUPTS.store(INTERRUPTS.load(Relaxed) + 1, Relaxed);
}

#[interrupt]
fn TIM2() {
    interrupted();
}

#[exception]
fn SysTick() {
    interrupted();
}
