//! The independent watchdog: it runs from an oscillator of its own and cannot be stopped.

use stm32f4xx_hal::pac::{DBGMCU, IWDG};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::watchdog::IndependentWatchdog;

use crate::supervision::{Part, Supervision};

/// Nominal time-out in milliseconds. The oscillator is 17 to 47 kHz instead of 32 (STM32F446 datasheet, 6.3.10), so it is
/// 136 to 376 ms; the parts report every 20 ms at the latest.
const TIMEOUT_MS: u32 = 200;

/// Nominal time-out of the start-up in milliseconds, 2 to 6 s: the parameter store may erase two sectors of 16 KiB then, which takes
/// up to 0.8 s each.
const START_UP_MS: u32 = 3_000;

/// The value of KR that starts the countdown again.
const RELOAD: u16 = 0xAAAA;

/// The watchdog while the node starts, with the long time-out.
pub struct StartUpWatchdog(IndependentWatchdog);

impl StartUpWatchdog {
    /// Starts it. A debugger that halts the core halts it too.
    pub(crate) fn new(iwdg: IWDG, debug: &DBGMCU) -> StartUpWatchdog {
        let mut watchdog = IndependentWatchdog::new(iwdg);
        watchdog.stop_on_debug(debug, true);
        watchdog.start(START_UP_MS.millis());
        StartUpWatchdog(watchdog)
    }

    /// Starts the countdown again. For the bootloader, which has one loop: the loop is alive when it calls this.
    pub fn feed(&mut self) {
        self.0.feed();
    }

    /// The start-up is over: from now on all parts must report.
    #[must_use]
    pub fn supervise(mut self) -> Watchdog {
        self.0.start(TIMEOUT_MS.millis());
        Watchdog { supervision: Supervision::new() }
    }
}

/// The watchdog of the running node. It is fed when all [`Part`]s have made progress.
pub struct Watchdog {
    supervision: Supervision,
}

impl Watchdog {
    /// `part` has done its work once more.
    pub fn progress(&self, part: Part) {
        if self.supervision.progress(part) {
            // SAFETY: the peripheral was given to `StartUpWatchdog`. Writing the key is one store, from whatever priority.
            unsafe { (*IWDG::ptr()).kr().write(|w| w.key().bits(RELOAD)) };
        }
    }
}
