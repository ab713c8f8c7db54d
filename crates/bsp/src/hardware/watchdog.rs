//! The independent watchdog: it runs from an oscillator of its own and cannot be stopped.

use stm32f4xx_hal::pac::{DBGMCU, IWDG};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::watchdog::IndependentWatchdog;

use crate::supervision::{Part, Supervision};

/// Nominal time-out in milliseconds. The oscillator is 17 to 47 kHz instead of 32 (STM32F446 datasheet, 6.3.10), so it is
/// 136 to 376 ms; the parts report every 20 ms at the latest.
const TIMEOUT_MS: u32 = 200;

/// What KR takes to start again from the top.
const RELOAD: u16 = 0xAAAA;

/// The running watchdog. It is fed when all [`Part`]s have made progress.
pub struct Watchdog {
    supervision: Supervision,
}

impl Watchdog {
    /// Starts it. A debugger that halts the core halts it too.
    pub(crate) fn start(iwdg: IWDG, debug: &DBGMCU) -> Watchdog {
        let mut watchdog = IndependentWatchdog::new(iwdg);
        watchdog.stop_on_debug(debug, true);
        watchdog.start(TIMEOUT_MS.millis());
        Watchdog { supervision: Supervision::new() }
    }

    /// `part` has done its work once more.
    pub fn progress(&self, part: Part) {
        if self.supervision.progress(part) {
            // SAFETY: the peripheral was given to `start`. Writing the key is one store, from whatever priority.
            unsafe { (*IWDG::ptr()).kr().write(|w| w.key().bits(RELOAD)) };
        }
    }
}
