//! The independent watchdog, which runs from its own oscillator and cannot be stopped.

use stm32f4xx_hal::pac::{DBGMCU, IWDG};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::watchdog::IndependentWatchdog;

use crate::supervision::{Part, Supervision};

/// Nominal time-out in milliseconds. The oscillator has 17 to 47 kHz instead of 32 kHz (STM32F446 datasheet, 6.3.10),
/// so the real time-out is 136 to 376 ms. The supervised parts report at least every 20 ms.
const TIMEOUT_MS: u32 = 200;

/// Nominal time-out of the start-up in milliseconds, in reality 2 to 6 s: the parameter store may erase two sectors of
/// 16 KiB during the start-up, which takes up to 0.8 s each.
const START_UP_MS: u32 = 3_000;

/// Nominal time-out in milliseconds while a flash page is erased, in reality 690 ms to 1.9 s: the erase takes up to 0.5 s.
/// The longest with the prescaler of the running node.
const PAUSE_MS: u32 = 1_023;

/// Values of KR: restarts the countdown, unlocks the other registers (RM0390, 20.4.1).
const RELOAD: u16 = 0xAAAA;
const UNLOCK: u16 = 0x5555;
/// Ticks of the countdown in a millisecond: 32 kHz nominal, divided by 8.
const TICKS: u32 = 4;
/// Number of reads of SR for five cycles of the oscillator, after which a new value is in force (RM0390, 20.4.3).
const UPDATE_POLLS: u32 = 1 << 14;

/// The watchdog while the node starts, with the long time-out.
pub struct StartUpWatchdog(IndependentWatchdog);

impl StartUpWatchdog {
    /// Starts the watchdog. A debugger that halts the core halts the watchdog too.
    pub(crate) fn new(iwdg: IWDG, debug: &DBGMCU) -> StartUpWatchdog {
        let mut watchdog = IndependentWatchdog::new(iwdg);
        watchdog.stop_on_debug(debug, true);
        watchdog.start(START_UP_MS.millis());
        StartUpWatchdog(watchdog)
    }

    /// Restarts the countdown. For the bootloader, whose single loop is alive if it calls this.
    pub fn feed(&mut self) {
        self.0.feed();
    }

    /// Ends the start-up: from now on all parts must report.
    #[must_use]
    pub fn supervise(mut self) -> Watchdog {
        self.0.start(TIMEOUT_MS.millis());
        Watchdog { supervision: Supervision::new() }
    }
}

/// The watchdog of the running node. It is fed once all [`Part`]s have made progress.
pub struct Watchdog {
    supervision: Supervision,
}

impl Watchdog {
    /// Takes note that `part` has made progress.
    pub fn progress(&self, part: Part) {
        if self.supervision.progress(part) {
            // SAFETY: the peripheral was given to `StartUpWatchdog`. Writing the key is one store, at any priority.
            unsafe { (*IWDG::ptr()).kr().write(|w| w.key().bits(RELOAD)) };
        }
    }

    /// Does something that stops all parts for up to 0.5 s: the erase of a flash page.
    pub fn extend<R>(&self, pause: impl FnOnce() -> R) -> R {
        set_time_out(PAUSE_MS);
        let result = pause();
        set_time_out(TIMEOUT_MS);
        result
    }
}

/// Changes the time-out of the running node, and restarts the countdown.
fn set_time_out(milliseconds: u32) {
    let value = u16::try_from(milliseconds * TICKS).unwrap_or(u16::MAX);
    // SAFETY: the peripheral was given to `StartUpWatchdog`. Only the task of the lowest priority comes here; the others
    // write nothing but KR, and not between the two writes below.
    let watchdog = unsafe { &*IWDG::ptr() };
    let is_updated = || (0..UPDATE_POLLS).any(|_| watchdog.sr().read().rvu().bit_is_clear());
    is_updated();
    cortex_m::interrupt::free(|_| {
        // SAFETY: this is the key.
        watchdog.kr().write(|w| unsafe { w.key().bits(UNLOCK) });
        watchdog.rlr().write(|w| w.rl().set(value));
    });
    is_updated();
    // SAFETY: this is the key.
    watchdog.kr().write(|w| unsafe { w.key().bits(RELOAD) });
}
