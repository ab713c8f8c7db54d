//! The same clocks as in `board`, register by register, for the bootloader: the HAL computes the dividers at run time, which takes
//! 2 KiB of flash that the bootloader does not have. And the clock security system, for both images.

use stm32f4xx_hal::pac::{FLASH, RCC};

/// 144 MHz from HSE: 8 MHz / 4 * 144 / 2. APB1 has a quarter of it, APB2 a half.
const DIVIDER_M: u8 = 4;
const MULTIPLIER_N: u16 = 144;
/// 4 wait states from 120 MHz on at 2.7 V and more (RM0390, table 6), caches and prefetch on.
const WAIT_STATES: u8 = 4;

/// Raises the clocks from what a reset leaves.
pub(super) fn raise(rcc: &RCC, flash: &FLASH) {
    let is_bypassed = cfg!(feature = "stm32f446");
    rcc.cr().modify(|_, w| w.hsebyp().bit(is_bypassed).hseon().set_bit());
    while rcc.cr().read().hserdy().bit_is_clear() {}
    // SAFETY: M and N are within their ranges (RM0390, 6.3.2); P = 2 is what the reset leaves.
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

/// Switches the clock security system on: where HSE fails from now on, the core goes on from HSI, and NMI comes
/// (RM0390, 6.2.7).
pub(super) fn watch(rcc: &RCC) {
    rcc.cr().modify(|_, w| w.csson().set_bit());
}

/// Puts the clocks back as a reset leaves them: the application expects them so (RM0390, 6.3.1 to 6.3.3).
pub(super) fn lower(rcc: &RCC) {
    rcc.cr().modify(|_, w| w.csson().clear_bit());
    rcc.cfgr().reset();
    while !rcc.cfgr().read().sws().is_hsi() {}
    rcc.cr().modify(|_, w| w.pllon().clear_bit().hseon().clear_bit());
    while rcc.cr().read().pllrdy().bit_is_set() {}
    rcc.cr().modify(|_, w| w.hsebyp().clear_bit());
    rcc.pllcfgr().reset();
    // SAFETY: the flash driver has done its work, and without operations under way the wait states and the caches are
    // nobody's: ACR as a reset leaves it suits the 16 MHz of now.
    unsafe { (*FLASH::ptr()).acr().reset() };
}
