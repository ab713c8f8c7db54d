//! SysTick wakes WFI: a sleeping loop runs once per tick, and the cycle counter confirms the period.
#![no_std]
#![no_main]

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::DWT;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::{entry, exception};
use mechanics_images::{expect, finish, note};

const PERIOD: u32 = 16_000;
static TICKS: AtomicU32 = AtomicU32::new(0);

#[entry]
fn main() -> ! {
    let mut core = cortex_m::Peripherals::take().unwrap();
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(PERIOD - 1);
    core.SYST.clear_current();
    core.SYST.enable_interrupt();
    core.SYST.enable_counter();
    let mut loops = 0;
    cortex_m::asm::wfi();
    let start = DWT::cycle_count();
    while TICKS.load(Ordering::Relaxed) < 11 {
        cortex_m::asm::wfi();
        loops += 1;
    }
    let elapsed = DWT::cycle_count().wrapping_sub(start);
    note(0, loops);
    note(1, elapsed);
    finish(expect(loops == 10, 1).and_then(|()| expect(elapsed.abs_diff(10 * PERIOD) < 32, 2)))
}

#[exception]
fn SysTick() {
    TICKS.fetch_add(1, Ordering::Relaxed);
}
