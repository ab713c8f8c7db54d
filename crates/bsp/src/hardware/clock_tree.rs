//! The same clocks as in `board`, set register by register, for the bootloader: the HAL computes the dividers at run
//! time, which takes 2 KiB of flash that the bootloader does not have. Also the clock security system, for both images.

use stm32f4xx_hal::pac::{FLASH, RCC};

/// 144 MHz from HSE: 8 MHz / 4 * 144 / 2. APB1 has a quarter of this clock, APB2 a half.
const DIVIDER_M: u8 = 4;
const MULTIPLIER_N: u16 = 144;
/// 4 wait states from 120 MHz on at 2.7 V and more (RM0390, table 6), caches and prefetch on.
const WAIT_STATES: u8 = 4;

/// Raises the clocks from their reset state.
pub(super) fn raise(rcc: &RCC, flash: &FLASH) {
    let is_bypassed = cfg!(feature = "stm32f446");
    rcc.cr().modify(|_, w| w.hsebyp().bit(is_bypassed).hseon().set_bit());
    while rcc.cr().read().hserdy().bit_is_clear() {}
    // SAFETY: M and N are within their ranges (RM0390, 6.3.2); P = 2 is the reset value.
    rcc.pllcfgr().modify(|_, w| unsafe { w.pllsrc().hse().pllm().bits(DIVIDER_M).plln().bits(MULTIPLIER_N) });
    rcc.cr().modify(|_, w| w.pllon().set_bit());
    // SAFETY: LATENCY takes any number.
    flash.acr().write(|w| unsafe {
        w.latency().bits(WAIT_STATES).prften().set_bit().icen().set_bit().dcen().set_bit()
    });
    while rcc.cr().read().pllrdy().bit_is_clear() {}
    rcc.cfgr().modify(|_, w| w.ppre1().div4().ppre2().div2());
    rcc.cfgr().modify(|_, w| w.sw().pll());
    while !rcc.cfgr().read().sws().is_pll() {}
    watch(rcc);
}

/// Switches the clock security system on: if HSE fails, the core continues with HSI and NMI is raised (RM0390, 6.2.7).
pub(super) fn watch(rcc: &RCC) {
    rcc.cr().modify(|_, w| w.csson().set_bit());
}

/// Restores the reset state of the clocks, which the application expects (RM0390, 6.3.1 to 6.3.3).
pub(super) fn lower(rcc: &RCC) {
    rcc.cr().modify(|_, w| w.csson().clear_bit());
    rcc.cfgr().reset();
    while !rcc.cfgr().read().sws().is_hsi() {}
    rcc.cr().modify(|_, w| w.pllon().clear_bit().hseon().clear_bit());
    while rcc.cr().read().pllrdy().bit_is_set() {}
    rcc.cr().modify(|_, w| w.hsebyp().clear_bit());
    rcc.pllcfgr().reset();
    // SAFETY: the flash driver has done its work. Without an operation under way nobody depends on the wait states and
    // the caches, and the reset value of ACR suits the present 16 MHz.
    unsafe { (*FLASH::ptr()).acr().reset() };
}
