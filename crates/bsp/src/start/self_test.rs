//! Values of the board for its bring-up (2005h), each a word at a fixed address.
//!
//! With the feature `development` the program also counts errors of the bus, measures the erase, tests the board at its
//! start (`start_tests`), and has the commands that break it. A release shows zeros there.
#![expect(unsafe_code, reason = "registers and memory by their addresses")]

use core::sync::atomic::AtomicU32;

use stm32f4xx_hal::pac::{CAN1, DBGMCU, FLASH, GPIOA, GPIOB, GPIOC, PWR, RCC};
use stm32f4xx_hal::rcc::Rcc;

use crate::analog::oversampling::WORDS;
use crate::analog::sampling;
use crate::can::controller::Controller;
use crate::chip::observations::{SEEN, Seen};
use crate::chip::retained;
use crate::position::ssi;
#[cfg(feature = "development")]
use crate::start::start_tests;

/// Results of the tests at the start. Written before the tasks run, apart from the stack.
pub(crate) static FOUND: Found = Found {
    lsi: AtomicU32::new(0),
    loop_back: AtomicU32::new(0),
    clock_wait: AtomicU32::new(0),
    free_stack: AtomicU32::new(0),
};

/// The words, in the order of their numbers.
#[repr(C)]
pub(crate) struct Found {
    /// The frequency of the LSI in hertz.
    pub(crate) lsi: AtomicU32,
    /// 1: a frame in loop-back was received as it was sent. 0: not tested. Others: `start_tests::LoopBack`.
    pub(crate) loop_back: AtomicU32,
    /// From the start of the program to the clock of the PLL, in microseconds.
    pub(crate) clock_wait: AtomicU32,
    /// Bytes of the stack that the program has never used.
    pub(crate) free_stack: AtomicU32,
}

/// A block of words: its address and its length.
type Block = (*const u32, u8);

/// The values, by number from 0.
const BLOCKS: [Block; 15] = [
    (DBGMCU::ptr().cast(), 1),
    // RCC_CR, RCC_PLLCFGR, RCC_CFGR.
    (RCC::ptr().cast(), 3),
    (FLASH::ptr().cast(), 1),
    // FLASH_OPTCR.
    (FLASH::ptr().cast::<u32>().wrapping_add(5), 1),
    // PWR_CSR.
    (PWR::ptr().cast::<u32>().wrapping_add(1), 1),
    // GPIOx_IDR.
    (GPIOA::ptr().cast::<u32>().wrapping_add(4), 1),
    (GPIOB::ptr().cast::<u32>().wrapping_add(4), 1),
    (GPIOC::ptr().cast::<u32>().wrapping_add(4), 1),
    // CAN_ESR.
    (CAN1::ptr().cast::<u32>().wrapping_add(6), 1),
    // VREFIN_CAL in the upper half; TS_CAL1 and TS_CAL2.
    (0x1FFF_7A28 as *const u32, 2),
    ((&raw const SEEN).cast::<u32>(), (size_of::<Seen>() / 4) as u8),
    (retained::CLOCK_TRIES, 1),
    // Bytes 0 to 7 of the last SSI word.
    (ssi::RECEIVED, 2),
    // The conversions of two milliseconds, two in a word.
    (sampling::CONVERSIONS, 2 * WORDS as u8),
    ((&raw const FOUND).cast::<u32>(), (size_of::<Found>() / 4) as u8),
];

/// The value with this number; 0 without one. A command breaks the program.
#[inline(never)]
pub fn value(number: u8) -> u32 {
    #[cfg(feature = "development")]
    {
        development::obey(number);
        if number == start_tests::FREE_STACK {
            start_tests::note_stack();
        }
    }
    let mut place = number;
    for (address, words) in BLOCKS {
        if place < words {
            // SAFETY: registers whose load has no effect, constants in flash, and statics, all aligned to words.
            return unsafe { address.add(place.into()).read_volatile() };
        }
        place -= words;
    }
    0
}

/// To be called first: starts the measurement of the clock.
pub(crate) fn begin() {
    #[cfg(feature = "development")]
    start_tests::begin();
}

/// Takes note of the time to the clock of the PLL, and marks the stack.
pub(crate) fn note_clock() {
    #[cfg(feature = "development")]
    start_tests::note_clock();
}

/// Measures the LSI, which the watchdog has started.
#[allow(unused_variables, reason = "a release measures nothing")]
pub(crate) fn note_lsi(rcc: &mut Rcc) {
    #[cfg(feature = "development")]
    start_tests::note_lsi(rcc);
}

/// Tests the controller in loop-back.
#[allow(unused_variables, reason = "a release tests nothing")]
pub(crate) fn note_loop_back(controller: &mut Controller) {
    #[cfg(feature = "development")]
    start_tests::note_loop_back(controller);
}

/// Takes note of the error counters and of the last error on the bus. To be called every 20 ms.
pub fn note_bus() {
    #[cfg(feature = "development")]
    development::note_bus();
}

#[cfg(feature = "development")]
mod development {
    use core::arch::asm;
    use core::sync::atomic::Ordering;

    use crate::can::controller;
    use crate::chip::crash;
    use crate::chip::observations::SEEN;

    /// The commands, above all values.
    const HANG: u8 = 0xF0;
    const FAULT: u8 = 0xF1;
    const OVERFLOW: u8 = 0xF2;
    const PANIC: u8 = 0xF3;

    pub(super) fn obey(command: u8) {
        match command {
            HANG => loop {
                core::hint::spin_loop();
            },
            FAULT => cortex_m::asm::udf(),
            // SAFETY: the program ends here.
            OVERFLOW => unsafe { asm!("2: push {{r0-r7}}", "b 2b", options(noreturn)) },
            PANIC => crash::panicked(None),
            _ => {}
        }
    }

    pub(super) fn note_bus() {
        let status = controller::registers().esr().read();
        let (transmit, receive) = (u32::from(status.tec().bits()), u32::from(status.rec().bits()));
        let before = SEEN.peaks.load(Ordering::Relaxed);
        let peaks = transmit.max(before & 0xFFFF) | receive.max(before >> 16) << 16;
        SEEN.peaks.store(peaks, Ordering::Relaxed);
        if let Some(count) = SEEN.errors.get(usize::from(status.lec().bits()).wrapping_sub(1)) {
            count.store(count.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
            controller::mark_error_code();
        }
    }
}
