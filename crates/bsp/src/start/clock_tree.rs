//! The clock tree of both images, set register by register: the HAL waits for HSE without a bound, and computes the
//! dividers at run time, which takes 2 KiB of flash. Also the clock security system.
#![expect(unsafe_code, reason = "registers")]

use cortex_m::peripheral::SCB;
use stm32f4xx_hal::pac::{DBGMCU, FLASH, RCC};

use crate::boards::BOARD;
use crate::chip::retained;
use crate::pins::led;

/// 144 MHz from HSE: 2 MHz * 144 / 2. APB1 has a quarter of this clock, because the bit rates need it, APB2 a half.
const DIVIDER_M: u8 = (BOARD.oscillator.hertz / 2_000_000) as u8;
const MULTIPLIER_N: u16 = 144;
/// 4 wait states from 120 MHz on at 2.7 V and more (RM0390, table 6), caches and prefetch on.
const WAIT_STATES: u8 = 4;
/// Number of polls of HSERDY in one try: about a second with HSI. The watchdog allows two at least.
const CLOCK_POLLS: u32 = 1 << 20;
/// Number of polls of any other flag of RCC: 10 ms at least with HSI.
const FLAG_POLLS: u32 = 1 << 14;
/// Number of polls between two changes of the LED: about 60 ms.
const LED_POLLS: u32 = 1 << 16;
/// AHB cycles until a new divider of a bus is in force (RM0390, 6.3.3, PPRE1).
const PRESCALER_CYCLES: u32 = 16;

/// Raises the clocks from their reset state.
pub(crate) fn raise(rcc: &RCC, flash: &FLASH) {
    start_hse(rcc);
    // SAFETY: M and N are within their ranges (RM0390, 6.3.2); P = 2 is the reset value.
    rcc.pllcfgr().modify(|_, w| unsafe { w.pllsrc().hse().pllm().bits(DIVIDER_M).plln().bits(MULTIPLIER_N) });
    rcc.cr().modify(|_, w| w.pllon().set_bit());
    // SAFETY: LATENCY takes any number.
    flash.acr().write(|w| unsafe {
        w.latency().bits(WAIT_STATES).prften().bit(can_prefetch()).icen().set_bit().dcen().set_bit()
    });
    wait(|| rcc.cr().read().pllrdy().bit_is_set());
    rcc.cfgr().modify(|_, w| w.ppre1().div4().ppre2().div2());
    cortex_m::asm::delay(PRESCALER_CYCLES);
    rcc.cfgr().modify(|_, w| w.sw().pll());
    wait(|| rcc.cfgr().read().sws().is_pll());
    watch(rcc);
}

/// Switches HSE on. The clock of an ST-LINK may come seconds after the supply of the board, so the wait has a bound: the
/// LED flickers, and the chip is reset for the next try. Without a watchdog reset, the cause of the start is still the
/// supply.
fn start_hse(rcc: &RCC) {
    rcc.cr().modify(|_, w| w.hsebyp().bit(BOARD.oscillator.is_bypassed).hseon().set_bit());
    let led = led::Pin::new(rcc);
    for polls in 1..=CLOCK_POLLS {
        if rcc.cr().read().hserdy().bit_is_set() {
            return;
        }
        if polls % LED_POLLS == 0 {
            led.toggle();
        }
    }
    try_again()
}

/// Waits for a flag of RCC, which comes within 300 us (t_LOCK; STM32F446 datasheet, 6.3.11). Without it the chip is reset
/// for the next try.
#[inline(never)]
fn wait(has_come: impl Fn() -> bool) {
    if !(0..FLAG_POLLS).any(|_| has_come()) {
        try_again()
    }
}

/// Counts the try, and resets the chip for the next one.
fn try_again() -> ! {
    retained::set_clock_tries(retained::clock_tries().saturating_add(1));
    SCB::sys_reset()
}

/// Whether this revision of the chip can prefetch.
fn can_prefetch() -> bool {
    const REVISION_A: u16 = 0x1000;
    // SAFETY: a read of a constant.
    BOARD.chip.revision_a_prefetches
        || unsafe { (*DBGMCU::ptr()).idcode().read().rev_id().bits() } != REVISION_A
}

/// Switches the clock security system on: if HSE fails, the core continues with HSI and NMI is raised (RM0390, 6.2.7).
fn watch(rcc: &RCC) {
    rcc.cr().modify(|_, w| w.csson().set_bit());
}

/// Restores the reset state of the clocks, which the application expects (RM0390, 6.3.1 to 6.3.3). The dividers follow
/// the switch to HSI: before it, APB1 would run at 144 MHz.
pub(crate) fn lower(rcc: &RCC) {
    rcc.cr().modify(|_, w| w.csson().clear_bit());
    rcc.cfgr().modify(|_, w| w.sw().hsi());
    wait(|| rcc.cfgr().read().sws().is_hsi());
    rcc.cfgr().reset();
    rcc.cr().modify(|_, w| w.pllon().clear_bit().hseon().clear_bit());
    wait(|| rcc.cr().read().pllrdy().bit_is_clear());
    rcc.cr().modify(|_, w| w.hsebyp().clear_bit());
    rcc.pllcfgr().reset();
    // SAFETY: the flash driver has done its work. Without an operation under way no code depends on the wait states and
    // the caches, and the reset value of ACR suits the present 16 MHz.
    let acr = unsafe { (*FLASH::ptr()).acr() };
    acr.reset();
    // The caches are off, so they can be emptied: the application may be another one than before (RM0390, 3.4.2).
    acr.write(|w| w.icrst().set_bit().dcrst().set_bit());
    acr.reset();
}
